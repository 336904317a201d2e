//! Shadows on a plain splat, by ratio: a fallback where light is not known.
//!
//! The shadow of an object is read off the plane that it stands on: the shown luminance near it, smoothed over a tenth of its
//! footprint, against that of a ring around it,
//!
//! ```text
//! S(x) = clamp(mean of L near x / mean of L in the ring, 0.2, 1.05), fading to 1 at the ring
//! ```
//!
//! When the object leaves, the plane is multiplied by `1 / S`; where it arrives, by `S` at the place that
//! corresponds (after ComGS, 2025: ratios, clamped, faded with distance). It moves with the object and does not turn with it, because
//! light does not. What is inserted has no shadow to read: it gets the contact shadow of a ball under an even sky, whose form
//! factor at distance `d` is `S = 1 - h R² / d³`, `h` the height of its center and `R` its radius.
//!
//! Texture coarser than the smoothing passes for shadow, and shadows of others are moved along: decompose the scene where that shows.

use glam::DVec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use motes_math::luminance::luminance;
use motes_scene::Gaussians;

use super::color::{scale_shown, shown_linear};
use super::ground::{Ground, find_ground, rows_on};
use super::measure::Extent;
use crate::EditState;

/// Least and largest ratio.
const RATIOS: (f64, f64) = (0.2, 1.05);
/// The shadow ends this many radii of the footprint from the base, and fades from `FADE_FROM` on.
const REACH: f64 = 4.0;
const FADE_FROM: f64 = 2.5;
/// Radius of the smoothing over the radius of the footprint.
const SMOOTHING: f64 = 0.2;

/// The shadow of one object on the ground.
#[derive(Clone, Debug)]
pub struct RatioShadow {
    ground: Ground,
    base: DVec3,
    radius: f64,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    /// Points on the ground with their luminance, and the luminance of the ring.
    Read { points: Vec<[f32; 3]>, luminance: Vec<f64>, ring: f64 },
    /// Of a ball at a height.
    Ball { height: f64, radius: f64 },
}

impl RatioShadow {
    /// Reads the shadow of the Gaussians of `rows` (ascending) off the ground; `None` when there is no ground near them.
    pub fn read(state: &EditState, rows: &[u32]) -> Option<Self> {
        let (ground, base, radius) = place(state, rows)?;
        let mut object = rows.iter().copied().peekable();
        let (mut points, mut values) = (Vec::new(), Vec::new());
        let (mut ring, mut count) = (0.0, 0.0);
        for row in rows_on(&state.gaussians, &ground) {
            while object.next_if(|r| *r < row).is_some() {}
            if object.peek() == Some(&row) {
                continue;
            }
            let distance = level(point(&state.gaussians, row) - base, ground.up).length();
            if !(distance <= REACH * radius) {
                continue;
            }
            let value = f64::from(luminance(shown_linear(state.gaussians.sh_of(row as usize))));
            points.push(state.gaussians.means[row as usize]);
            values.push(value);
            if distance >= FADE_FROM * radius {
                ring += value;
                count += 1.0;
            }
        }
        // A few Gaussians say nothing about the light around the object.
        if count < 20.0 || !(ring > 0.0) {
            return None;
        }
        let kind = Kind::Read { points, luminance: values, ring: ring / count };
        Some(Self { ground, base, radius, kind })
    }

    /// The contact shadow of Gaussians that were not here.
    pub fn of_ball(state: &EditState, rows: &[u32]) -> Option<Self> {
        let (ground, base, radius) = place(state, rows)?;
        let extent = Extent::of(&state.gaussians, rows, state.up_in_world)?;
        let ball = 0.5 * extent.height().min(2.0 * radius);
        let height = (0.5 * (extent.bottom + extent.top) - ground.height).max(ball);
        Some(Self { ground, base, radius, kind: Kind::Ball { height, radius: ball } })
    }

    /// Multiplies the ground by the shadow moved by `shift`, or by its inverse; rows of `but` (ascending) are
    /// left out. Returns how many Gaussians changed.
    pub fn apply(
        &self,
        gaussians: &mut Gaussians,
        shift: DVec3,
        takes_away: bool,
        but: &[u32],
    ) -> usize {
        let shift = level(shift, self.ground.up);
        let stride = 3 * gaussians.sh_coefficients();
        let mut object = but.iter().copied().peekable();
        let tree = match &self.kind {
            Kind::Read { points, .. } => ImmutableKdTree::<f32, 3>::new_from_slice(points).ok(),
            Kind::Ball { .. } => None,
        };
        let mut changed = 0;
        for row in rows_on(gaussians, &self.ground) {
            while object.next_if(|r| *r < row).is_some() {}
            if object.peek() == Some(&row) {
                continue;
            }
            let at = point(gaussians, row) - shift;
            let ratio = self.ratio(at, tree.as_ref());
            if ratio == 1.0 {
                continue;
            }
            let factor = if takes_away { 1.0 / ratio } else { ratio } as f32;
            let first = row as usize * stride;
            scale_shown(&mut gaussians.sh[first..first + stride], [factor; 3]);
            changed += 1;
        }
        changed
    }

    /// Share of the light that is left at a point of the ground.
    fn ratio(&self, at: DVec3, tree: Option<&ImmutableKdTree<f32, 3>>) -> f64 {
        let distance = level(at - self.base, self.ground.up).length();
        if !(distance < REACH * self.radius) {
            return 1.0;
        }
        let bare = match (&self.kind, tree) {
            (Kind::Ball { height, radius }, _) => {
                let d = distance.hypot(*height);
                1.0 - height * radius * radius / (d * d * d)
            }
            (Kind::Read { luminance, ring, .. }, Some(tree)) => {
                let reach = (SMOOTHING * self.radius).powi(2) as f32;
                let near = at.as_vec3().to_array();
                let found = tree.query(&near).within::<SquaredEuclidean<f32>>(reach).execute();
                if found.is_empty() {
                    return 1.0;
                }
                let sum: f64 = found.iter().map(|n| luminance[n.item as usize]).sum();
                sum / found.len() as f64 / ring
            }
            (Kind::Read { .. }, None) => 1.0,
        };
        let bare = bare.clamp(RATIOS.0, RATIOS.1);
        let t = ((distance / self.radius - FADE_FROM) / (REACH - FADE_FROM)).clamp(0.0, 1.0);
        let fade = t * t * (3.0 - 2.0 * t);
        bare + (1.0 - bare) * fade
    }
}

/// The ground, the base of the Gaussians on it, and the radius of their footprint.
fn place(state: &EditState, rows: &[u32]) -> Option<(Ground, DVec3, f64)> {
    let ground = find_ground(&state.gaussians, state.up_in_world)?;
    let extent = Extent::of(&state.gaussians, rows, state.up_in_world)?;
    let base = extent.centroid + ground.up * (ground.height - extent.centroid.dot(ground.up));
    let radius = 0.5 * extent.footprint();
    (radius > 0.0 && radius.is_finite()).then_some((ground, base, radius))
}

fn point(gaussians: &Gaussians, row: u32) -> DVec3 {
    DVec3::from_array(gaussians.means[row as usize].map(f64::from))
}

/// What of a vector lies in the ground.
fn level(v: DVec3, up: DVec3) -> DVec3 {
    v - up * v.dot(up)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::changes::color::show_linear;

    /// A gray floor with a dark disc around the origin, and a ball of Gaussians on it.
    fn scene() -> (EditState, Vec<u32>) {
        let n = 80;
        let mut gaussians = motes_testkit::random_gaussians(3, n * n + 200, 0);
        for i in 0..n * n {
            let (x, y) = ((i % n) as f32 / 10.0 - 4.0, (i / n) as f32 / 10.0 - 4.0);
            gaussians.means[i] = [x, y, 0.0];
            gaussians.rotations[i] = [1.0, 0.0, 0.0, 0.0];
            gaussians.log_scales[i] = [-2.8, -2.8, -6.0];
            gaussians.opacity_logits[i] = 3.0;
            let gray = if x.hypot(y) < 0.6 { 0.2 } else { 0.4 };
            show_linear(&mut gaussians.sh[3 * i..3 * i + 3], [gray; 3]);
        }
        for i in n * n..n * n + 200 {
            let d = DVec3::from_array(gaussians.means[i].map(f64::from)).normalize_or(DVec3::Z);
            gaussians.means[i] = (d * 0.5 + DVec3::Z * 0.5).as_vec3().to_array();
            gaussians.log_scales[i] = [-3.0; 3];
            gaussians.opacity_logits[i] = 3.0;
        }
        let ball = (n as u32 * n as u32..n as u32 * n as u32 + 200).collect();
        (EditState::new("t", gaussians, None, None, DVec3::Z), ball)
    }

    fn gray_at(state: &EditState, x: f32, y: f32) -> f32 {
        let near = |m: &[f32; 3]| (m[0] - x).hypot(m[1] - y) + m[2].abs();
        let means = &state.gaussians.means[..6400];
        let row = (0..6400).min_by(|a, b| near(&means[*a]).total_cmp(&near(&means[*b]))).unwrap();
        shown_linear(state.gaussians.sh_of(row))[0]
    }

    #[test]
    fn a_shadow_moves_with_its_object() {
        let (mut state, ball) = scene();
        let shadow = RatioShadow::read(&state, &ball).unwrap();
        let shift = DVec3::new(2.0, 1.0, 0.7);
        assert!(shadow.apply(&mut state.gaussians, DVec3::ZERO, true, &ball) > 50);
        assert!(shadow.apply(&mut state.gaussians, shift, false, &ball) > 50);
        let (old, new) = (gray_at(&state, 0.0, 0.0), gray_at(&state, 2.0, 1.0));
        assert!((old - 0.4).abs() < 0.04, "the old shadow is gone: {old}");
        assert!((new - 0.2).abs() < 0.04, "the new one is there: {new}");
        assert!((gray_at(&state, -3.0, -3.0) - 0.4).abs() < 1e-4);
    }

    #[test]
    fn what_is_inserted_gets_a_contact_shadow() {
        let (mut state, ball) = scene();
        let shadow = RatioShadow::of_ball(&state, &ball).unwrap();
        let before = gray_at(&state, 0.9, 0.0);
        shadow.apply(&mut state.gaussians, DVec3::ZERO, false, &ball);
        let (near, far) = (gray_at(&state, 0.9, 0.0), gray_at(&state, 1.6, 0.0));
        assert!(near < 0.9 * before && far > near, "{before} {near} {far}");
    }
}
