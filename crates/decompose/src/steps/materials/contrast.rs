//! Roughness of a metal by how much its radiance varies.

use glam::Vec3;
use motes_math::median::quantile;

use crate::appearance::basis::Basis;
use crate::observation::Sample;
use crate::observation::samples::luminance;

/// Radiances above this quantile count as this: the sun's picture is small, bright, and first to be missed.
const HIGH: f32 = 0.9;

/// The roughness under which a metal's radiance varies from view to view as much as it does in the photos.
///
/// A fit that compares pixel by pixel prefers a blurred picture to one that is sharp and elsewhere, so it takes every error of
/// the normals for roughness (regression dilution, Fuller 1987). How much the radiance of a point varies does not depend on where
/// the picture is. Between the values of roughness, by the logarithm; the largest where it varies less than under any, 1 (no bound) where
/// it varies more.
pub(super) fn contrast_roughness(
    basis: &Basis,
    samples: &[Sample],
    of_sample: &[u32],
    part: usize,
    color: Vec3,
) -> f32 {
    let members = || (0..samples.len()).filter(|&p| of_sample[p] as usize == part);
    let mut all: Vec<f32> = members()
        .flat_map(|p| samples[p].observations.iter().map(|o| luminance(o.radiance)))
        .collect();
    let Some(cut) = quantile(&mut all, HIGH) else { return 1.0 };
    let spread = |values: &mut dyn Iterator<Item = f32>| {
        let (n, sum, squares) = values
            .map(|v| f64::from(v.min(cut)))
            .fold((0.0f64, 0.0, 0.0), |(n, s, q), v| (n + 1.0, s + v, q + v * v));
        (squares - sum * sum / n.max(1.0)).max(0.0)
    };
    let seen: f64 = members()
        .map(|p| spread(&mut samples[p].observations.iter().map(|o| luminance(o.radiance))))
        .sum();
    let spreads: Vec<f64> = (0..basis.roughness.len())
        .map(|r| {
            let of = |p: usize| {
                let mut values = (0..samples[p].observations.len()).map(|k| {
                    let terms = basis.at(p, k, r);
                    luminance(terms.metal_slope * color + terms.metal_offset)
                });
                spread(&mut values)
            };
            members().map(of).sum()
        })
        .collect();
    let Some(k) = spreads.iter().position(|s| *s < seen) else {
        return basis.roughness[spreads.len() - 1];
    };
    // More than any roughness explains: the light found is too soft, and contrast tells nothing.
    if k == 0 {
        return 1.0;
    }
    let [a, b] = [spreads[k - 1], spreads[k]].map(|s| s.max(1e-30).ln());
    let t = ((a - seen.max(1e-30).ln()) / (a - b).max(1e-12)).clamp(0.0, 1.0) as f32;
    basis.roughness[k - 1] + (basis.roughness[k] - basis.roughness[k - 1]) * t
}

#[cfg(test)]
mod tests {
    use super::super::profile::{fit, linear};
    use super::*;
    use crate::appearance::Kind;
    use crate::appearance::basis::Terms;
    use crate::observation::Observation;

    /// What a mirror shows `k` views on, blurred by a roughness.
    fn mirrored(at: f32, roughness: f32) -> f32 {
        let blur = |wave: f32| (-(wave * roughness).powi(2)).exp();
        1.0 + 0.5 * blur(1.5) * (0.9 * at).sin() + 0.4 * blur(4.0) * (2.3 * at).cos()
    }

    #[test]
    fn wrong_normals_are_not_taken_for_roughness() {
        let roughness = vec![0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8];
        let views = 10;
        let (mut samples, mut terms, mut first) = (Vec::new(), Vec::new(), vec![0]);
        for p in 0..60 {
            let place = p as f32 * 1.7;
            // The normal is off: what is mirrored is 1.2 views aside, now here, now there.
            let aside = if p % 2 == 0 { 1.2 } else { -1.2 };
            let observations = (0..views)
                .map(|k| Observation {
                    photo: k,
                    light: 0,
                    to_viewer: Vec3::Z,
                    radiance: Vec3::splat(0.7 * mirrored(place + k as f32 + aside, 0.3)),
                    weight: 1.0,
                })
                .collect();
            samples.push(Sample::facing_z(observations));
            for k in 0..views {
                terms.extend(roughness.iter().map(|&r| Terms {
                    diffuse: Vec3::ONE,
                    specular: Vec3::ZERO,
                    metal_slope: Vec3::splat(mirrored(place + k as f32, r)),
                    metal_offset: Vec3::ZERO,
                }));
            }
            first.push(first[p] + views as usize);
        }
        let basis = Basis { roughness: roughness.clone(), terms, first };
        let cost = |r: usize| -> f32 {
            let of = |p: usize| {
                let rows: Vec<(Vec3, Vec3)> =
                    (0..views as usize).map(|k| linear(basis.at(p, k, r), Kind::Metal)).collect();
                fit(&samples[p].observations, &rows).0
            };
            (0..samples.len()).map(of).sum()
        };
        let fitted = (0..roughness.len()).min_by(|&a, &b| cost(a).total_cmp(&cost(b))).unwrap();
        let found =
            contrast_roughness(&basis, &samples, &vec![0; samples.len()], 0, Vec3::splat(0.7));
        println!("fitted {}, by contrast {found}, true 0.3", roughness[fitted]);
        assert!(roughness[fitted] >= 0.4, "{}", roughness[fitted]);
        assert!((found - 0.3).abs() < 0.05, "{found}");
        // Without any view, and with views that do not vary.
        assert_eq!(
            contrast_roughness(&basis, &samples, &vec![1; samples.len()], 0, Vec3::ONE),
            1.0
        );
        for sample in &mut samples {
            sample.observations.iter_mut().for_each(|o| o.radiance = Vec3::ONE);
        }
        let even = contrast_roughness(&basis, &samples, &vec![0; samples.len()], 0, Vec3::ONE);
        assert_eq!(even, 0.8);
        // A light that is harder than the one that was found.
        for sample in &mut samples {
            let values = sample.observations.iter_mut().enumerate();
            values.for_each(|(k, o)| o.radiance = Vec3::splat(if k % 2 == 0 { 9.0 } else { 0.0 }));
        }
        let hard = contrast_roughness(&basis, &samples, &vec![0; samples.len()], 0, Vec3::ONE);
        assert_eq!(hard, 1.0);
    }
}
