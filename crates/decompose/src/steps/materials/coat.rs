//! What a coat over paint shows, and no metal: the light's own color over another one that stays.
//!
//! A metal gives its color to all that it reflects. A coat reflects the light as it is, over paint whose color is its own (dichromatic
//! reflection, Shafer 1985). Neither normals nor roughness enter.

use glam::Vec3;

use crate::appearance::basis::Basis;
use crate::observation::Sample;
use crate::observation::samples::luminance;

/// What moves is of the light's color when it is this much nearer to it than to the color of what stays.
const NEARER: f32 = 0.5;
/// Least distance of logarithms of chromaticity between what moves and what stays: gray paint under a coat looks like silver.
const LEAST_DISTANCE: f32 = 0.3;
/// The dark and the bright part of what the photos show of a point, as a share of them.
const PART: usize = 3;

/// Whether `points` show paint under a coat. `roughness` indexes the lobes that the color of the reflected light is taken from.
pub(super) fn is_coated(
    samples: &[Sample],
    basis: &Basis,
    points: &[usize],
    roughness: usize,
) -> bool {
    let [mut stays, mut bright, mut light] = [Vec3::ZERO; 3];
    for &p in points {
        let mut seen: Vec<Vec3> = samples[p].observations.iter().map(|o| o.radiance).collect();
        seen.sort_by(|a, b| luminance(*a).total_cmp(&luminance(*b)));
        let part = seen.len().div_ceil(PART);
        let mean = |of: &[Vec3]| of.iter().sum::<Vec3>() / of.len().max(1) as f32;
        stays += mean(&seen[..part]);
        bright += mean(&seen[seen.len() - part..]);
        let lobes = (0..seen.len()).map(|k| basis.at(p, k, roughness).metal_slope);
        light += lobes.sum::<Vec3>() / seen.len().max(1) as f32;
    }
    let [stays, moves, light] = [stays, bright - stays, light].map(log_chromaticity);
    let from_paint = moves.distance(stays);
    from_paint >= LEAST_DISTANCE && moves.distance(light) < NEARER * from_paint
}

/// Logarithm of the channels over the luminance; a channel of nothing counts as a hundredth of it.
fn log_chromaticity(color: Vec3) -> Vec3 {
    let floor = 0.01 * luminance(color).max(1e-12);
    (color.max(Vec3::splat(floor)) / luminance(color).max(1e-12)).map(f32::ln)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::appearance::basis::Terms;
    use crate::observation::Observation;

    const LIGHT: Vec3 = Vec3::new(1.2, 1.0, 0.8);
    const TEAL: Vec3 = Vec3::new(0.02, 0.08, 0.15);
    const GOLD: Vec3 = Vec3::new(0.9, 0.6, 0.15);

    /// Of twenty points, each in nine photos, that show `radiance` under reflections of strength 0 to 1.
    fn coated(radiance: impl Fn(f32) -> Vec3) -> bool {
        let observe = |p: u32, k: u32| Observation {
            photo: k,
            light: 0,
            to_viewer: Vec3::Z,
            radiance: radiance(0.5 + 0.5 * (0.3 * p as f32 + 0.7 * k as f32).sin()),
            weight: 1.0,
        };
        let sample = |p: u32| Sample::facing_z((0..9).map(|k| observe(p, k)).collect());
        let samples: Vec<Sample> = (0..20).map(sample).collect();
        let terms = Terms { metal_slope: LIGHT, ..Terms::default() };
        let first = (0..=20).map(|p| 9 * p).collect();
        let basis = Basis { roughness: vec![0.3], terms: vec![terms; 180], first };
        is_coated(&samples, &basis, &(0..20).collect::<Vec<_>>(), 0)
    }

    #[test]
    fn paint_under_a_coat_is_told_by_its_color_at_any_exposure() {
        for exposure in [1e-6, 1.0, 1e6] {
            assert!(coated(|r| (TEAL * LIGHT + 0.3 * r * LIGHT) * exposure));
            assert!(!coated(|r| GOLD * LIGHT * (0.2 + r) * exposure));
        }
    }

    #[test]
    fn silver_gold_in_a_colored_place_and_what_does_not_move_are_none() {
        assert!(!coated(|r| 0.9 * LIGHT * (0.2 + r)));
        // Its dark side reflects a blue sky.
        assert!(!coated(|r| GOLD * (Vec3::new(0.2, 0.3, 0.5) + r * LIGHT)));
        assert!(!coated(|_| TEAL * LIGHT));
        assert!(!coated(|_| Vec3::ZERO));
        assert!(!coated(|_| Vec3::splat(f32::NAN)));
        // Gray paint looks like silver: the other signs have to do.
        assert!(!coated(|r| 0.2 * LIGHT + 0.3 * r * LIGHT));
    }
}
