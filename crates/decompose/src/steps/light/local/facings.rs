//! What faces one way, and the mean of the local light over it.

use glam::Vec3;

use crate::illumination::{LocalLight, NORMAL_REACH};

/// Anchors that a point takes from, and how much of each.
pub(super) type Weights = Vec<(usize, f32)>;

/// `κ`: more than the few pairs around a corner.
const MEAN: f32 = 0.3;

/// Anchors by the way that they face, and the share of the points that take from each.
pub(super) struct Facings {
    /// Per anchor.
    facing: Vec<usize>,
    /// Per anchor.
    share: Vec<f32>,
    /// Per facing.
    shares: Vec<f32>,
}

impl Facings {
    /// Of the anchors of `light`; `weights` is what every point takes from them.
    pub(super) fn new(light: &LocalLight, weights: &[Weights]) -> Self {
        let anchors = light.anchors();
        let mut share = vec![0.0; anchors.len()];
        let of_one = 1.0 / weights.len().max(1) as f32;
        weights.iter().flatten().for_each(|(j, w)| share[*j] += w * of_one);
        let facing = facings(&anchors.iter().map(|a| a.normal).collect::<Vec<_>>());
        let mut shares = vec![0.0; facing.iter().max().map_or(0, |last| last + 1)];
        facing.iter().zip(&share).for_each(|(f, share)| shares[*f] += share);
        Self { facing, share, shares }
    }

    /// Adds the slope of half of `κ Σ_f s_f |mean of l over f|²`, with `s_f` the share of the points that face that way.
    pub(super) fn hold(&self, l: &[Vec3], slope: &mut [Vec3]) {
        let mut sums = vec![Vec3::ZERO; self.shares.len()];
        for ((l, share), f) in l.iter().zip(&self.share).zip(&self.facing) {
            sums[*f] += *l * *share;
        }
        for ((slope, share), f) in slope.iter_mut().zip(&self.share).zip(&self.facing) {
            *slope += sums[*f] * (MEAN * *share / self.shares[*f].max(f32::MIN_POSITIVE));
        }
    }
}

/// The facing of every normal: the nearest of normals that lie apart.
fn facings(normals: &[Vec3]) -> Vec<usize> {
    let (mut of, mut nearest) = (vec![0; normals.len()], vec![f32::INFINITY; normals.len()]);
    let (mut next, mut count) = (0, 0);
    while let Some(seed) = normals.get(next).copied() {
        for ((of, nearest), normal) in of.iter_mut().zip(&mut nearest).zip(normals) {
            let distance = normal.distance(seed);
            if distance < *nearest {
                (*of, *nearest) = (count, distance);
            }
        }
        count += 1;
        let far = nearest.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(&a.0)));
        match far {
            Some((k, distance)) if *distance > NORMAL_REACH => next = k,
            _ => break,
        }
    }
    of
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::illumination::LightAnchor;

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

    /// `κ / 2 Σ_f s_f |mean of l over f|²`, one loop per sum.
    fn cost(facings: &Facings, l: &[Vec3]) -> f64 {
        let of = |f: usize| {
            let (mut sum, mut share) = (Vec3::ZERO, 0.0);
            for (j, l) in l.iter().enumerate().filter(|(j, _)| facings.facing[*j] == f) {
                sum += *l * facings.share[j];
                share += facings.share[j];
            }
            0.5 * MEAN * share * (sum / share).length_squared()
        };
        f64::from((0..facings.shares.len()).map(of).sum::<f32>())
    }

    #[test]
    fn the_slope_is_that_of_the_cost() {
        let facings = corner();
        assert_eq!(facings.facing, [0, 0, 0, 1, 1, 1]);
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
