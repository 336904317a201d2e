//! Size, place, color and material of objects.

use edit::changes::ground::find_ground;
use edit::changes::measure::Extent;
use glam::DVec3;
use motes_formats::scene_card::{
    ColorDocument, FrameDocument, MaterialDocument, ObjectDocument, SizeDocument,
};
use motes_formats::selection::BoxDocument;
use motes_math::sh::SH_C0;
use motes_math::sigmoid::sigmoid;
use motes_math::srgb;
use motes_scene::{Gaussians, Materials};

use super::{CardInput, Labeled};
use crate::language::color_name;

/// Metallic from which an object is called metal, and roughness up to which it is called glossy.
const METAL: f64 = 0.5;
const GLOSSY: f64 = 0.35;

/// The objects, in the order of the labels.
pub(super) fn objects(
    input: &CardInput<'_>,
    frame: &FrameDocument,
) -> Result<Vec<ObjectDocument>, String> {
    let materials = input.decomposed.then(|| Materials::of(input.gaussians).ok()).flatten();
    let ground = find_ground(input.gaussians, input.up).map(|ground| ground.height);
    let mut objects: Vec<ObjectDocument> = Vec::with_capacity(input.labeled.len());
    for labeled in input.labeled {
        let id = free_id(&labeled.label.name, &objects);
        let object = object(input, frame, labeled, materials.as_ref(), ground, id);
        objects.push(object.ok_or_else(|| labeled.label.name.clone())?);
    }
    Ok(objects)
}

/// The name with hyphens; a number behind it where it is taken. "all" is every plan's name for everything.
fn free_id(name: &str, objects: &[ObjectDocument]) -> String {
    let words: Vec<String> = name.split_whitespace().map(str::to_lowercase).collect();
    let name = words.join("-");
    let taken = |id: &str| id == "all" || objects.iter().any(|object| object.id == id);
    if !taken(&name) {
        return name;
    }
    let numbered = (2..).map(|k| format!("{name}-{k}")).find(|id| !taken(id));
    numbered.unwrap_or(name)
}

fn object(
    input: &CardInput<'_>,
    frame: &FrameDocument,
    labeled: &Labeled,
    materials: Option<&Materials>,
    ground: Option<f64>,
    id: String,
) -> Option<ObjectDocument> {
    let rows = labeled.selection.rows();
    let along = |axis: [f64; 3]| Extent::of(input.gaussians, &rows, DVec3::from_array(axis));
    let (upright, across, deep) = (along(frame.up)?, along(frame.right)?, along(frame.front)?);
    let label = &labeled.label;
    let mut names = vec![label.name.clone()];
    names.extend(label.also.iter().cloned());
    let rgb_linear = mean_color(input.gaussians, materials, &rows);
    Some(ObjectDocument {
        id,
        names,
        selection: label.selection.clone(),
        count: rows.len() as u64,
        center: upright.centroid.to_array(),
        base: upright.base().to_array(),
        bounds: BoxDocument { min: upright.min.to_array(), max: upright.max.to_array() },
        size: SizeDocument {
            width: across.height(),
            depth: deep.height(),
            height: upright.height(),
        },
        height_above_ground: labeled.ground.or(ground).map(|ground| upright.bottom - ground),
        color: ColorDocument { name: color_name(rgb_linear).into(), rgb_linear },
        material: material(input.gaussians, materials, &rows, label.made_of.as_deref()),
        views: Vec::new(),
    })
}

/// Mean of `value` over rows, weighted by opacity.
fn mean<const N: usize>(
    gaussians: &Gaussians,
    rows: &[u32],
    value: impl Fn(usize) -> [f64; N],
) -> [f64; N] {
    let (mut sum, mut weights) = ([0.0; N], 0.0);
    for row in rows {
        let row = *row as usize;
        let weight = f64::from(sigmoid(gaussians.opacity_logits[row]));
        let found = value(row);
        if weight > 0.0 && found.iter().all(|v| v.is_finite()) {
            weights += weight;
            for (sum, v) in sum.iter_mut().zip(found) {
                *sum += weight * v;
            }
        }
    }
    if weights > 0.0 { sum.map(|v| v / weights) } else { sum }
}

/// Base color where it is known, else the color that is the same from all sides. Linear.
fn mean_color(gaussians: &Gaussians, materials: Option<&Materials>, rows: &[u32]) -> [f64; 3] {
    let color = mean(gaussians, rows, |row| match materials {
        Some(materials) => materials.base_color_linear[row].map(f64::from),
        None => {
            let dc = gaussians.sh_of(row);
            [0, 1, 2].map(|c| {
                let encoded = 0.5 + SH_C0 * f64::from(dc[c]);
                srgb::decode_f64(encoded.clamp(0.0, 1.0))
            })
        }
    });
    color.map(|v| v.clamp(0.0, 1.0))
}

fn material(
    gaussians: &Gaussians,
    materials: Option<&Materials>,
    rows: &[u32],
    made_of: Option<&str>,
) -> Option<MaterialDocument> {
    let made_of = made_of.map(str::to_lowercase);
    let Some(materials) = materials else {
        let class = made_of.clone()?;
        return Some(MaterialDocument { class, made_of, roughness: None, metallic: None });
    };
    let [roughness, metallic] = mean(gaussians, rows, |row| {
        [f64::from(materials.roughness[row]), f64::from(materials.metallic[row])]
    });
    let class = match () {
        () if metallic > METAL => "metal",
        () if roughness < GLOSSY => "glossy",
        () => "matte",
    };
    Some(MaterialDocument {
        class: class.into(),
        made_of,
        roughness: Some(roughness),
        metallic: Some(metallic),
    })
}
