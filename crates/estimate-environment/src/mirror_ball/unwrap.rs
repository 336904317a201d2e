//! From directions to pixels of the ball.
//!
//! A unit ball at the origin, the camera at `C = (0, 0, -D)`, `D` in radii. The point with normal `n = (sin φ l, -cos φ)` (`l` a
//! unit vector across the axis) mirrors the ray from the camera into the direction whose angle to the axis toward the camera is
//!
//! ```text
//! β(φ) = 2 φ + α(φ),   tan α = sin φ / (D - cos φ)
//! ```
//!
//! which grows from 0 to `π - asin(1 / D)` at the outline, `cos φ = 1 / D`. An infinite distance is the orthographic ball, `β = 2 φ`.
//! Directions beyond are hidden by the ball. The point is seen at `tan α` over that of the outline, `1 / sqrt(D² - 1)`.

use glam::{DVec3, Vec3};
use motes_scene::ImageF32;

use super::Outline;
use crate::sphere::texel_direction;

/// Points across a texel that are averaged.
const ACROSS: usize = 2;
/// Share of the radius beyond which a pixel mixes with what is beside the ball.
const RIM: f64 = 0.985;

/// A ball as a map.
#[derive(Clone, Debug)]
pub struct Unwrapped {
    /// Linear RGB, in the axes of the module; black where not seen.
    pub radiance: ImageF32,
    /// How far each texel was seen, 0 to 1.
    pub seen: Vec<f32>,
    /// Whether a texel comes from a pixel that is clipped.
    pub clipped: Vec<bool>,
}

/// Unwraps a linear picture of a ball of `reflectance` (RGB) into a map of `rows` rows. `distance` from the camera to the center of the
/// ball in radii, above 1; infinite for an orthographic picture. `is_clipped` says so of pixels (row-major).
pub fn unwrap(
    picture: &ImageF32,
    outline: &Outline,
    distance: f64,
    reflectance: Vec3,
    rows: usize,
    is_clipped: &dyn Fn(usize) -> bool,
) -> Unwrapped {
    let (w, h) = (2 * rows, rows);
    let mut out = Unwrapped {
        radiance: ImageF32::filled(w, h, 3, 0.0),
        seen: vec![0.0; w * h],
        clipped: vec![false; w * h],
    };
    for y in 0..h {
        for x in 0..w {
            let (mut sum, mut count) = (Vec3::ZERO, 0);
            for k in 0..ACROSS * ACROSS {
                let sub = |at: usize, k: usize| ACROSS * at + k;
                let d =
                    texel_direction(sub(x, k % ACROSS), sub(y, k / ACROSS), ACROSS * w, ACROSS * h);
                let Some(pixel) = pixel_of(DVec3::new(-d.x, -d.y, d.z), outline, distance) else {
                    continue;
                };
                let Some((value, nearest)) = bilinear(picture, pixel) else { continue };
                sum += value / reflectance;
                count += 1;
                out.clipped[y * w + x] |= is_clipped(nearest);
            }
            let i = y * w + x;
            out.seen[i] = count as f32 / (ACROSS * ACROSS) as f32;
            if count > 0 {
                out.radiance.pixel_mut(x, y).copy_from_slice(&(sum / count as f32).to_array());
            }
        }
    }
    out
}

/// Where the ball shows what comes from `direction` (camera axes, unit); `None` where it hides it.
pub(super) fn pixel_of(direction: DVec3, outline: &Outline, distance: f64) -> Option<[f64; 2]> {
    let beta = (-direction.z).clamp(-1.0, 1.0).acos();
    let share = if distance.is_finite() { share_of(beta, distance)? } else { (0.5 * beta).sin() };
    if share > RIM {
        return None;
    }
    let across = direction.x.hypot(direction.y);
    let l = if across > 0.0 { [direction.x / across, direction.y / across] } else { [0.0; 2] };
    Some([0, 1].map(|k| outline.center[k] + outline.radius * share * l[k]))
}

/// Distance of the pixel from the middle, in radii of the outline, of what is mirrored at an angle `beta` to the axis.
fn share_of(beta: f64, distance: f64) -> Option<f64> {
    let alpha = |phi: f64| phi.sin().atan2(distance - phi.cos());
    let last = (1.0 / distance).acos();
    if beta > 2.0 * last + alpha(last) {
        return None;
    }
    let (mut low, mut high) = (0.0, last);
    for _ in 0..48 {
        let middle = 0.5 * (low + high);
        if 2.0 * middle + alpha(middle) < beta { low = middle } else { high = middle }
    }
    Some(alpha(0.5 * (low + high)).tan() * (distance * distance - 1.0).sqrt())
}

/// Value at a place and the index of its nearest pixel; `None` outside the picture.
fn bilinear(picture: &ImageF32, [x, y]: [f64; 2]) -> Option<(Vec3, usize)> {
    let (w, h) = (picture.width, picture.height);
    if !((0.0..w as f64).contains(&x) && (0.0..h as f64).contains(&y)) {
        return None;
    }
    let nearest = y as usize * w + x as usize;
    let (x, y) = ((x - 0.5).clamp(0.0, (w - 1) as f64), (y - 0.5).clamp(0.0, (h - 1) as f64));
    let (x0, y0) = (x as usize, y as usize);
    let (s, t) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
    let at = |x: usize, y: usize| Vec3::from_slice(picture.pixel(x.min(w - 1), y.min(h - 1)));
    let top = at(x0, y0).lerp(at(x0 + 1, y0), s);
    Some((top.lerp(at(x0, y0 + 1).lerp(at(x0 + 1, y0 + 1), s), t), nearest))
}
