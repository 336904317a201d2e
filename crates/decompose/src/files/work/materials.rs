//! `materials.safetensors`: parts, their materials, and what highlights tell about the scale. Bits are kept, also of what is infinite.

use std::collections::BTreeMap;
use std::path::Path;

use crate::{FoundMaterials, Kind, PartMaterial, ScaleEvidence};
use motes_formats::tensors::{TensorData, read_tensors, write_tensors};
use motes_formats::{FormatError, Result};

const KINDS: [Kind; 3] = [Kind::Matte, Kind::Dielectric, Kind::Metal];

pub(super) fn write(path: &Path, found: &FoundMaterials, made_by: &str) -> Result<()> {
    let (parts, samples) = (&found.parts, found.of_sample.len());
    let count = parts.len();
    let floats = |shape: &[usize], values: Vec<f32>| TensorData::F32(shape.into(), values);
    let color = |p: &PartMaterial| p.metal_color_linear.unwrap_or_default().to_array();
    let base = found.base_color_linear.iter().flat_map(|b| b.to_array());
    let kind = |p: &PartMaterial| KINDS.iter().position(|k| *k == p.kind).unwrap_or(0) as u8;
    let has_color = |p: &PartMaterial| u8::from(p.metal_color_linear.is_some());
    let bytes = |of: &dyn Fn(&PartMaterial) -> u8| parts.iter().map(of).collect::<Vec<u8>>();
    let s = &found.scale;
    let evidence = [s.highlights, s.usual, s.usual_trust, s.least, s.log_spread];
    let tensors = [
        ("part_of_sample", TensorData::U32(vec![samples], found.of_sample.clone())),
        ("base_color_linear", floats(&[samples, 3], base.collect())),
        ("part_kind", TensorData::U8(vec![count], bytes(&kind))),
        ("part_roughness", floats(&[count], parts.iter().map(|p| p.roughness).collect())),
        ("part_has_color", TensorData::U8(vec![count], bytes(&has_color))),
        ("part_color_linear", floats(&[count, 3], parts.iter().flat_map(color).collect())),
        (
            "part_samples",
            TensorData::U64(vec![count], parts.iter().map(|p| p.samples as u64).collect()),
        ),
        ("part_costs", floats(&[count, 4], parts.iter().flat_map(|p| p.costs).collect())),
        ("specular_gain", floats(&[1], vec![found.specular_gain])),
        ("misfit", floats(&[1], vec![found.misfit])),
        ("is_metal_untold", TensorData::U8(vec![1], vec![u8::from(found.is_metal_untold)])),
        ("scale_evidence", floats(&[5], evidence.to_vec())),
        ("scale_tint", floats(&[3], s.tint.to_array().to_vec())),
        ("scale_samples", TensorData::U64(vec![1], vec![s.samples as u64])),
    ];
    let metadata =
        [("format", "motes/decompose-materials"), ("version", "1.0"), ("made_by", made_by)];
    let metadata: BTreeMap<String, String> =
        metadata.into_iter().map(|(k, v)| (k.into(), v.into())).collect();
    write_tensors(path, &tensors.map(|(name, data)| (name.into(), data)), &metadata)
}

/// The tensors of a file, each of which has to be there with its shape.
struct Tensors<'a> {
    path: &'a Path,
    by_name: BTreeMap<String, TensorData>,
}

impl Tensors<'_> {
    fn get<T: Clone>(
        &self,
        name: &str,
        shape: &[usize],
        values: impl Fn(&TensorData) -> Option<&Vec<T>>,
    ) -> Result<Vec<T>> {
        let found = self.by_name.get(name).filter(|tensor| tensor.shape() == shape);
        found.and_then(values).cloned().ok_or_else(|| {
            let cause = format!("there is no such tensor of the shape {shape:?} and its type");
            FormatError::invalid(self.path, name, cause)
        })
    }

    fn f32(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>> {
        self.get(name, shape, |t| if let TensorData::F32(_, v) = t { Some(v) } else { None })
    }

    fn u8(&self, name: &str, count: usize) -> Result<Vec<u8>> {
        self.get(name, &[count], |t| if let TensorData::U8(_, v) = t { Some(v) } else { None })
    }

    fn u64(&self, name: &str, count: usize) -> Result<Vec<u64>> {
        self.get(name, &[count], |t| if let TensorData::U64(_, v) = t { Some(v) } else { None })
    }

    fn len(&self, name: &str) -> usize {
        self.by_name.get(name).and_then(|t| t.shape().first()).copied().unwrap_or(0)
    }
}

pub(super) fn read(path: &Path) -> Result<FoundMaterials> {
    let tensors = Tensors { path, by_name: read_tensors(path)?.0 };
    let (samples, count) = (tensors.len("part_of_sample"), tensors.len("part_kind"));
    let of_sample = tensors.get("part_of_sample", &[samples], |t| {
        if let TensorData::U32(_, v) = t { Some(v) } else { None }
    })?;
    let wrong = |name: &str, cause: &str| FormatError::invalid(path, name, cause);
    if of_sample.iter().any(|part| *part as usize >= count) {
        return Err(wrong("part_of_sample", "a sample belongs to a part that does not exist"));
    }
    let kinds = tensors.u8("part_kind", count)?;
    let has_color = tensors.u8("part_has_color", count)?;
    let roughness = tensors.f32("part_roughness", &[count])?;
    let colors = tensors.f32("part_color_linear", &[count, 3])?;
    let sizes = tensors.u64("part_samples", count)?;
    let costs = tensors.f32("part_costs", &[count, 4])?;
    let part = |k: usize| {
        let kind = KINDS.get(usize::from(kinds[k]));
        let color = glam::Vec3::from_slice(&colors[3 * k..]);
        Ok(PartMaterial {
            kind: *kind.ok_or_else(|| wrong("part_kind", "a kind is 0, 1 or 2"))?,
            roughness: roughness[k],
            metal_color_linear: (has_color[k] != 0).then_some(color),
            samples: sizes[k] as usize,
            costs: [0, 1, 2, 3].map(|c| costs[4 * k + c]),
        })
    };
    let base = tensors.f32("base_color_linear", &[samples, 3])?;
    let evidence = tensors.f32("scale_evidence", &[5])?;
    let tint = tensors.f32("scale_tint", &[3])?;
    Ok(FoundMaterials {
        of_sample,
        parts: (0..count).map(part).collect::<Result<_>>()?,
        base_color_linear: base.chunks_exact(3).map(glam::Vec3::from_slice).collect(),
        specular_gain: tensors.f32("specular_gain", &[1])?[0],
        misfit: tensors.f32("misfit", &[1])?[0],
        is_metal_untold: tensors.u8("is_metal_untold", 1)?[0] != 0,
        scale: ScaleEvidence {
            highlights: evidence[0],
            usual: evidence[1],
            usual_trust: evidence[2],
            least: evidence[3],
            log_spread: evidence[4],
            tint: glam::Vec3::from_slice(&tint),
            samples: tensors.u64("scale_samples", 1)?[0] as usize,
        },
    })
}
