//! What faces one way, and the mean of the local light over it.

use glam::Vec3;

use super::farthest::farthest;
use crate::illumination::{LightAnchor, LocalLight, NORMAL_REACH};

/// Anchors that a point takes from, and how much of each.
pub(super) type Weights = Vec<(usize, f32)>;

/// `κ`: more than the few pairs around a corner.
const MEAN: f32 = 0.1;
/// Shares of a mean below this do not count.
const LEAST: f32 = 1e-6;

/// The factor where these are the weights.
pub(super) fn value(factors: &[Vec3], weights: &[(usize, f32)]) -> Vec3 {
    weights.iter().map(|(j, w)| factors[*j] * *w).sum()
}

/// Ways to face, and what the points that face each way take from every anchor.
pub(super) struct Facings {
    /// Per way: anchors with their shares of its mean, of sum 1,
    means: Vec<Weights>,
    /// and the share of the points that face that way.
    shares: Vec<f32>,
}

impl Facings {
    /// Of the anchors of `light`; `weights` is what every point takes from them.
    pub(super) fn new(light: &LocalLight, weights: &[Weights]) -> Self {
        let anchors = light.anchors();
        let mut share = vec![0.0; anchors.len()];
        let of_one = 1.0 / weights.len().max(1) as f32;
        weights.iter().flatten().for_each(|(j, w)| share[*j] += w * of_one);
        let squared = |a: &LightAnchor, b: &LightAnchor| a.normal.distance_squared(b.normal);
        let ways = farthest(anchors, squared, NORMAL_REACH, anchors.len());
        let mut means: Vec<Weights> = vec![Vec::new(); ways.len()];
        for (j, (anchor, share)) in anchors.iter().zip(&share).enumerate() {
            let off = |way: &usize| anchor.normal.distance(anchors[*way].normal) / NORMAL_REACH;
            let near = |way: &usize| (-0.5 * off(way).powi(2)).exp();
            let all: f32 = ways.iter().map(near).sum();
            for (mean, way) in means.iter_mut().zip(&ways) {
                mean.push((j, share * near(way) / all));
            }
        }
        let shares: Vec<f32> = means.iter().map(|m| m.iter().map(|(_, s)| s).sum()).collect();
        for (mean, share) in means.iter_mut().zip(&shares) {
            mean.iter_mut().for_each(|(_, s)| *s /= share.max(f32::MIN_POSITIVE));
            mean.retain(|(_, s)| *s > LEAST);
        }
        Self { means, shares }
    }

    /// Adds the slope of half of `κ Σ_d s_d |mean of l over d|²`, with `s_d` the share of the points that face that way.
    pub(super) fn hold(&self, l: &[Vec3], slope: &mut [Vec3]) {
        for (mean, share) in self.means.iter().zip(&self.shares) {
            let held = value(l, mean) * (MEAN * share);
            mean.iter().for_each(|(j, s)| slope[*j] += held * *s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six anchors of a floor and a wall, and what four points take from them.
    fn corner() -> Facings {
        let anchor = |k: usize| {
            let normal = if k < 3 { Vec3::Z } else { Vec3::Y };
            LightAnchor { position: Vec3::X * k as f32, normal, log_factor: Vec3::ZERO }
        };
        let light = LocalLight::new((0..6).map(anchor).collect(), 1.0).unwrap();
        let weights = [
            vec![(0, 0.7), (1, 0.3)],
            vec![(1, 0.5), (2, 0.5)],
            vec![(3, 0.9), (2, 0.1)],
            vec![(5, 1.0)],
        ];
        Facings::new(&light, &weights)
    }

    /// `κ / 2 Σ_d s_d |mean of l over d|²`, one loop per sum.
    fn cost(facings: &Facings, l: &[Vec3]) -> f64 {
        let mut cost = 0.0;
        for (mean, share) in facings.means.iter().zip(&facings.shares) {
            let mut held = Vec3::ZERO;
            for (j, s) in mean {
                held += l[*j] * *s;
            }
            cost += 0.5 * MEAN * share * held.length_squared();
        }
        f64::from(cost)
    }

    #[test]
    fn the_slope_is_that_of_the_cost() {
        let facings = corner();
        let sum = |of: &Weights| of.iter().map(|(_, s)| s).sum::<f32>();
        assert!(
            facings.means.len() == 2 && facings.means.iter().all(|m| (sum(m) - 1.0).abs() < 1e-5)
        );
        assert!((facings.shares[0] - 0.525).abs() < 0.01, "{:?}", facings.shares);
        let l: Vec<Vec3> = (0..6).map(|k| Vec3::new(0.3, -0.2, 0.1) * (k as f32 - 1.5)).collect();
        let mut slope = vec![Vec3::ZERO; 6];
        facings.hold(&l, &mut slope);
        for j in 0..6 {
            for c in 0..3 {
                let step = 0.05;
                let moved = |by: f32| {
                    let mut moved = l.clone();
                    moved[j][c] += by;
                    cost(&facings, &moved)
                };
                let difference = (moved(step) - moved(-step)) / f64::from(2.0 * step);
                let off = (difference - f64::from(slope[j][c])).abs();
                assert!(off < 1e-4, "{j} {c}: {difference} {}", slope[j][c]);
            }
        }
        assert!(slope[4] == Vec3::ZERO && slope[3].length() > 1e-3, "no point takes from anchor 4");
    }
}
