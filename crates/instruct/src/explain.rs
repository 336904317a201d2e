//! An operation as a sentence.

use edit::ops::{InsertOp, OpDocument, SetEnvironmentOp, SetMaterialOp, TransformOp};
use edit::run::PlaceDocument;
use glam::DVec3;
use motes_formats::scene_card::SceneCardDocument;
use motes_formats::selectors::{SelectStep, Selector};

/// The operations of a plan, a sentence each; directions are those of the card's frame.
pub fn explain(ops: &[OpDocument], card: &SceneCardDocument) -> Vec<String> {
    ops.iter().map(|op| sentence(op, card)).collect()
}

fn sentence(op: &OpDocument, card: &SceneCardDocument) -> String {
    let of = |target: &Option<String>| match target.as_deref() {
        None => "what is selected".to_owned(),
        Some("all") => "everything".to_owned(),
        Some(name) => format!("\"{name}\""),
    };
    match op {
        OpDocument::Select(op) => {
            let file = op.steps.iter().find_map(|step| match step {
                SelectStep::Select(step) => match &step.selector {
                    Selector::File { path } => Some(path),
                    _ => None,
                },
                SelectStep::Post(_) => None,
            });
            let from = file.map(|file| format!(" by {file}")).unwrap_or_default();
            format!("Select {}{from}.", of(&op.id))
        }
        OpDocument::Transform(op) => transform(op, &of(&op.target), card),
        OpDocument::Duplicate(op) => {
            let count =
                if op.count == 1 { "a copy".into() } else { format!("{} copies", op.count) };
            format!(
                "Make {count} of {}, each shifted {}.",
                of(&op.target),
                shift(op.translate, card)
            )
        }
        OpDocument::Delete(op) => {
            format!("Remove {} and fill the place that it leaves.", of(&op.target))
        }
        OpDocument::Extract(op) => format!("Remove everything but {}.", of(&op.target)),
        OpDocument::Insert(op) => insert(op),
        OpDocument::Swap(op) => format!("Put {} in the place of {}.", op.file, of(&op.target)),
        OpDocument::Recolor(op) => {
            format!("Color {} {}.", of(&op.target), color(op.rgb_linear))
        }
        OpDocument::SetMaterial(op) => set_material(op, &of(&op.target)),
        OpDocument::SetEnvironment(op) => environment(op),
        OpDocument::RemoveFloaters(op) => {
            format!("Remove isolated Gaussians of {}.", of(&op.target))
        }
        other => format!("Apply the operation {}.", other.name()),
    }
}

fn transform(op: &TransformOp, of: &str, card: &SceneCardDocument) -> String {
    let mut parts = Vec::new();
    if let Some(scale) = op.scale {
        parts.push(format!("scale it by {scale}"));
    }
    if let Some(rotation) = &op.rotate_axis {
        let up = DVec3::from_array(card.frame.up);
        let is_upright = DVec3::from_array(rotation.axis).normalize_or_zero().dot(up) > 0.999;
        let (deg, sense) = match rotation.deg < 0.0 {
            true => (-rotation.deg, "clockwise"),
            false => (rotation.deg, "counter-clockwise"),
        };
        parts.push(match is_upright {
            true => format!("turn it by {deg} degrees {sense}, seen from above"),
            false => format!("turn it by {deg} degrees about {:?}", rotation.axis),
        });
    }
    if op.rotate_euler_deg.is_some() || op.rotate_quaternion.is_some() {
        parts.push("turn it".into());
    }
    if let Some(translate) = op.translate {
        parts.push(format!("move it {}", shift(translate, card)));
    }
    format!("Take {of}: {}.", parts.join(", "))
}

/// "0.2 units to the right and 0.1 units up".
fn shift(translate: [f64; 3], card: &SceneCardDocument) -> String {
    let v = DVec3::from_array(translate);
    let frame = &card.frame;
    let axes = [
        (frame.right, "to the right", "to the left"),
        (frame.front, "to the front", "to the back"),
        (frame.up, "up", "down"),
    ];
    let length = v.length();
    let parts: Vec<String> = axes
        .iter()
        .map(|(axis, along, against)| (v.dot(DVec3::from_array(*axis)), along, against))
        .filter(|(way, ..)| way.abs() > 1e-3 * length)
        .map(|(way, along, against)| {
            let metric =
                card.meters_per_unit.map(|m| format!(" ({} cm)", number(100.0 * m * way.abs())));
            let metric = metric.unwrap_or_default();
            format!(
                "{} units{metric} {}",
                number(way.abs()),
                if way > 0.0 { along } else { against }
            )
        })
        .collect();
    if parts.is_empty() { "nowhere".into() } else { parts.join(" and ") }
}

/// Three digits.
fn number(value: f64) -> String {
    let digits = (2 - value.abs().max(1e-9).log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

fn insert(op: &InsertOp) -> String {
    let place = match &op.at {
        Some(PlaceDocument::Point(at)) => format!("at {}, {}, {}", at[0], at[1], at[2]),
        Some(PlaceDocument::Pixel(at)) => {
            format!("where pixel {}, {} of {} is", at.pixel[0], at.pixel[1], at.view)
        }
        None => "on free ground".into(),
    };
    let height = op.height.map(|h| format!(", {} units high", number(h))).unwrap_or_default();
    format!("Insert {} {place}{height}.", op.file)
}

fn color(rgb_linear: [f64; 3]) -> String {
    let [r, g, b] =
        rgb_linear.map(|v| (255.0 * motes_math::srgb::encode_f64(v.clamp(0.0, 1.0))).round());
    format!("{} (sRGB {r}, {g}, {b})", crate::language::color_name(rgb_linear))
}

fn set_material(op: &SetMaterialOp, of: &str) -> String {
    let mut parts = Vec::new();
    parts.extend(op.name.as_ref().map(|name| name.replace('_', " ")));
    parts.extend(op.base_color.as_ref().map(|change| color(change.rgb_linear)));
    parts.extend(op.roughness.map(|v| format!("roughness {}", number(v))));
    parts.extend(op.metallic.map(|v| format!("metallic {}", number(v))));
    format!("Make {of} of {}.", parts.join(", "))
}

fn environment(op: &SetEnvironmentOp) -> String {
    match (&op.sun, &op.file) {
        (Some(sun), _) => format!("Light the scene by {sun}; shadows and reflections follow."),
        (None, Some(file)) => {
            format!("Light the scene with the map {file}; shadows and reflections follow.")
        }
        (None, None) => "Change the light.".into(),
    }
}
