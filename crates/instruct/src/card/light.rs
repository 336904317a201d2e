//! The light of a scene in a few words.

use glam::DVec3;
use motes_formats::scene_card::{FrameDocument, LightDocument};
use motes_math::luminance::luminance_f64;
use motes_scene::ImageF32;
use motes_shading::environment::{MapAxes, direction_from_uv};

/// Red over blue beyond which light is warm, and its inverse below which it is cool.
const WARM: f64 = 1.15;
/// Sine of the angle to an axis below which a direction is not said to lean that way: 22.5 degrees.
const LEAN: f64 = 0.38;

/// The mean direction and color of a map; `None` of a dark one.
pub(super) fn light(map: &ImageF32, axes: MapAxes, frame: &FrameDocument) -> Option<LightDocument> {
    let orientation = axes.orientation();
    let (mut toward, mut sum, mut solid) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for y in 0..map.height {
        let v = (y as f64 + 0.5) / map.height as f64;
        let weight = (std::f64::consts::PI * v).sin();
        for x in 0..map.width {
            let pixel = map.pixel(x, y);
            let rgb = DVec3::new(pixel[0].into(), pixel[1].into(), pixel[2].into());
            if !rgb.is_finite() {
                continue;
            }
            let rgb = rgb.max(DVec3::ZERO);
            let u = (x as f64 + 0.5) / map.width as f64;
            let direction = orientation.world_from_map(direction_from_uv(u, v));
            toward += direction * (weight * luminance_f64(rgb.to_array()));
            sum += rgb * weight;
            solid += weight;
        }
    }
    let to_light = toward.try_normalize()?;
    let mean = sum / solid;
    let rgb_linear = mean / mean.max_element().max(f64::MIN_POSITIVE);
    let ratio = mean.x / mean.z.max(f64::MIN_POSITIVE);
    let tone = match ratio {
        r if r > WARM => "warm",
        r if r < 1.0 / WARM => "cool",
        _ => "neutral",
    };
    let along = |axis: [f64; 3]| to_light.dot(DVec3::from_array(axis));
    Some(LightDocument {
        to_light: to_light.to_array(),
        from: side(along(frame.right), along(frame.front), along(frame.up)),
        elevation_deg: along(frame.up).clamp(-1.0, 1.0).asin().to_degrees(),
        rgb_linear: rgb_linear.to_array(),
        tone: tone.into(),
    })
}

fn side(right: f64, front: f64, up: f64) -> String {
    let mut words = Vec::new();
    match front {
        f if f > LEAN => words.push("front"),
        f if f < -LEAN => words.push("behind"),
        _ => {}
    }
    match right {
        r if r > LEAN => words.push("right"),
        r if r < -LEAN => words.push("left"),
        _ => {}
    }
    match up {
        u if u < -LEAN => words.push("below"),
        u if u > LEAN || words.is_empty() => words.push("above"),
        _ => {}
    }
    words.join(" ")
}
