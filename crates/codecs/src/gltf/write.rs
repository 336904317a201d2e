//! Writing a binary glTF, attribute after attribute, with little memory.

use std::collections::BTreeMap;
use std::io::Write;
use std::ops::Range;
use std::path::Path;

use motes_scene::{ExtraColumn, Gaussians};
use serde_json::{Value, json};

use super::super::axes::Flip;
use super::super::options::SplatWriteOptions;
use super::super::quantize::{color_byte, sigmoid, unit, unorm8};
use super::super::rows::write_blocks;
use super::document::{
    ARRAY_BUFFER, Accessor, Asset, Buffer, BufferView, FLOAT, Gltf, Mesh, Node, POINTS, Primitive,
    Scene, UNSIGNED_BYTE,
};
use super::{EXTENSION, columns, glb, harmonic_names};
use motes_formats::atomic::write_error;
use motes_formats::error::{FormatError, Result};
use motes_formats::ply::RenderMode;

/// What an attribute holds.
enum Kind<'g> {
    Position,
    Color,
    Rotation,
    Scale,
    Opacity,
    Harmonic(usize),
    Column(&'g ExtraColumn),
}

struct Attribute<'g> {
    name: String,
    kind: Kind<'g>,
    extras: Option<Value>,
}

impl Attribute<'_> {
    fn shape(&self) -> (&'static str, u64) {
        match self.kind {
            Kind::Position | Kind::Scale | Kind::Harmonic(_) => ("VEC3", 12),
            Kind::Rotation => ("VEC4", 16),
            Kind::Color => ("VEC4", 4),
            Kind::Opacity | Kind::Column(_) => ("SCALAR", 4),
        }
    }

    fn append(&self, gaussians: &Gaussians, rows: Range<usize>, bytes: &mut Vec<u8>) {
        let flip = Flip::ABOUT_Z;
        for i in rows {
            if let Kind::Color = self.kind {
                let dc = gaussians.sh_of(i);
                bytes.extend([color_byte(dc[0]), color_byte(dc[1]), color_byte(dc[2])]);
                bytes.push(unorm8(sigmoid(gaussians.opacity_logits[i])));
                continue;
            }
            let mut floats =
                |values: &[f32]| values.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
            match self.kind {
                Kind::Position => floats(&flip.point(gaussians.means[i])),
                Kind::Rotation => {
                    let [w, x, y, z] = flip.rotation(unit(gaussians.rotations[i]));
                    floats(&[x, y, z, w]);
                }
                Kind::Scale => floats(&gaussians.log_scales[i].map(f32::exp)),
                Kind::Opacity => floats(&[sigmoid(gaussians.opacity_logits[i])]),
                Kind::Harmonic(k) => {
                    let sign = flip.sh_sign(k);
                    let rgb = &gaussians.sh_of(i)[3 * k..3 * k + 3];
                    floats(&[sign * rgb[0], sign * rgb[1], sign * rgb[2]]);
                }
                Kind::Column(column) => floats(&[columns::value(column, i)]),
                Kind::Color => {}
            }
        }
    }
}

fn attributes(gaussians: &Gaussians) -> Vec<Attribute<'_>> {
    let of = |name: &str, kind| Attribute { name: name.into(), kind, extras: None };
    let own = |name: &str| format!("{EXTENSION}:{name}");
    let mut all = vec![
        of("POSITION", Kind::Position),
        of("COLOR_0", Kind::Color),
        of(&own("ROTATION"), Kind::Rotation),
        of(&own("SCALE"), Kind::Scale),
        of(&own("OPACITY"), Kind::Opacity),
    ];
    let harmonics = harmonic_names(gaussians.sh_degree).enumerate();
    all.extend(harmonics.map(|(k, name)| of(&name, Kind::Harmonic(k))));
    all.extend(gaussians.extra.iter().filter_map(|column| {
        let (name, extras) = columns::attribute(column)?;
        Some(Attribute { name, kind: Kind::Column(column), extras: Some(extras) })
    }));
    all
}

pub(in super::super) fn write(
    writer: &mut dyn Write,
    gaussians: &Gaussians,
    options: &SplatWriteOptions,
    path: &Path,
) -> Result<()> {
    let refused = |error| write_error(path, error);
    let attributes = attributes(gaussians);
    let document = document(gaussians, &attributes, options);
    let json = serde_json::to_vec(&document).map_err(|error| refused(error.into()))?;
    let head = glb::head(&json, document.buffers[0].byte_length).ok_or_else(|| {
        let cause = format!("{} Gaussians are more than the 4 GiB of a .glb hold", gaussians.len());
        FormatError::not_supported(path, "", cause)
            .with_remedy("take a lower --sh-degree or another format")
    })?;
    writer.write_all(&head).map_err(refused)?;
    for attribute in &attributes {
        let encode =
            |rows: Range<usize>, bytes: &mut Vec<u8>| attribute.append(gaussians, rows, bytes);
        write_blocks(writer, gaussians.len(), encode).map_err(refused)?;
    }
    Ok(())
}

fn document(
    gaussians: &Gaussians,
    attributes: &[Attribute<'_>],
    options: &SplatWriteOptions,
) -> Gltf {
    let count = gaussians.len() as u64;
    let mut gltf = Gltf {
        asset: Asset {
            version: "2.0".into(),
            generator: concat!("motes ", env!("CARGO_PKG_VERSION")).into(),
        },
        extensions_used: vec![EXTENSION.into()],
        scene: Some(0),
        scenes: vec![Scene { nodes: vec![0] }],
        nodes: vec![Node { mesh: Some(0), ..Node::default() }],
        ..Gltf::default()
    };
    let mut offset = 0;
    let mut names = BTreeMap::new();
    for (i, attribute) in attributes.iter().enumerate() {
        let (shape, bytes) = attribute.shape();
        let is_color = matches!(attribute.kind, Kind::Color);
        let bounds = matches!(attribute.kind, Kind::Position).then(|| bounds(gaussians));
        gltf.buffer_views.push(BufferView {
            byte_offset: offset,
            byte_length: bytes * count,
            target: Some(ARRAY_BUFFER),
            ..BufferView::default()
        });
        gltf.accessors.push(Accessor {
            buffer_view: Some(i),
            component_type: if is_color { UNSIGNED_BYTE } else { FLOAT },
            normalized: is_color,
            count,
            shape: shape.into(),
            min: bounds.map(|(low, _)| low.to_vec()),
            max: bounds.map(|(_, high)| high.to_vec()),
            extras: attribute.extras.clone(),
            ..Accessor::default()
        });
        names.insert(attribute.name.clone(), i);
        offset += bytes * count;
    }
    gltf.buffers.push(Buffer { uri: None, byte_length: offset });
    let mut extension = json!({
        "kernel": "ellipse",
        "colorSpace": "srgb_rec709_display",
        "sortingMethod": "cameraDistance",
        "projection": "perspective",
    });
    if options.render_mode == Some(RenderMode::Mip) {
        // The extension has no word for it; ours is understood by ourselves.
        extension["extras"] = json!({ "renderMode": "mip" });
    }
    gltf.meshes.push(Mesh {
        primitives: vec![Primitive {
            indices: None,
            material: None,
            attributes: names,
            mode: POINTS,
            extensions: BTreeMap::from([(EXTENSION.into(), extension)]),
        }],
    });
    gltf
}

fn bounds(gaussians: &Gaussians) -> ([f32; 3], [f32; 3]) {
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for mean in &gaussians.means {
        let point = Flip::ABOUT_Z.point(*mean);
        for axis in 0..3 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
    }
    (low, high)
}
