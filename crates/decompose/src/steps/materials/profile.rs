//! How well each kind of material explains a point, its base color being free.

use glam::Vec3;
use rayon::prelude::*;

use crate::appearance::Kind;
use crate::appearance::basis::{Basis, Terms};
use crate::observation::samples::luminance;
use crate::observation::{Observation, Sample};

/// A kind with an index of roughness ([`Kind::Matte`] has only index 0).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Label {
    /// The kind.
    pub kind: Kind,
    /// Index into [`Basis::roughness`].
    pub roughness: usize,
}

/// All labels for `n` values of roughness: matte first, then dielectrics, then metals.
pub(super) fn labels(n: usize) -> Vec<Label> {
    let matte = Label { kind: Kind::Matte, roughness: n - 1 };
    let of = |kind| (0..n).map(move |roughness| Label { kind, roughness });
    std::iter::once(matte).chain(of(Kind::Dielectric)).chain(of(Kind::Metal)).collect()
}

/// `(slope, offset)` of radiance by base color.
#[inline]
pub(super) fn linear(terms: &Terms, kind: Kind) -> (Vec3, Vec3) {
    match kind {
        Kind::Matte => (terms.diffuse, Vec3::ZERO),
        Kind::Dielectric => (terms.diffuse, terms.specular),
        Kind::Metal => (terms.metal_slope, terms.metal_offset),
    }
}

/// Relative error of a radiance that is taken for noise and model error together.
const NOISE: f32 = 0.08;
/// Residuals beyond this many times the noise hardly count more (Geman & McClure 1987).
const OUTLIER: f32 = 3.0;

/// `[P, labels]`: robust cost of every sample under every label, per observation-equivalent, and the best base
/// color under it.
#[derive(Clone, Debug)]
pub(super) struct Profile {
    /// The labels.
    pub labels: Vec<Label>,
    /// What each costs a part.
    pub prices: Vec<f32>,
    /// Costs, row-major.
    pub costs: Vec<f32>,
    /// Base colors, row-major.
    pub base_color_linear: Vec<Vec3>,
}

impl Profile {
    /// Evaluates all labels; `price` is what a label costs a part, infinite where it is not allowed.
    pub(super) fn new(samples: &[Sample], basis: &Basis, price: &dyn Fn(&Label) -> f32) -> Self {
        let labels = labels(basis.roughness.len());
        let rows: Vec<Vec<(f32, Vec3)>> = samples
            .par_iter()
            .enumerate()
            .map(|(p, sample)| {
                labels
                    .iter()
                    .map(|label| {
                        let rows: Vec<(Vec3, Vec3)> = (0..sample.observations.len())
                            .map(|k| linear(basis.at(p, k, label.roughness), label.kind))
                            .collect();
                        fit(&sample.observations, &rows)
                    })
                    .collect()
            })
            .collect();
        Self {
            costs: rows.iter().flatten().map(|r| r.0).collect(),
            base_color_linear: rows.iter().flatten().map(|r| r.1).collect(),
            prices: labels.iter().map(price).collect(),
            labels,
        }
    }

    /// Mean squared error that the best label of every sample leaves, over that of [`NOISE`]; outliers count less.
    pub(super) fn misfit(&self, samples: &[Sample]) -> f32 {
        let weight: f32 = samples.iter().flat_map(|s| &s.observations).map(|o| o.weight).sum();
        let best: f32 = (0..samples.len()).map(|p| self.least_cost(p)).sum();
        // The cost is half the square.
        if weight > 0.0 { 2.0 * best / weight } else { 0.0 }
    }

    /// The same of one sample.
    pub(super) fn misfit_of(&self, p: usize, sample: &Sample) -> f32 {
        let weight: f32 = sample.observations.iter().map(|o| o.weight).sum();
        if weight > 0.0 { 2.0 * self.least_cost(p) / weight } else { 0.0 }
    }

    fn least_cost(&self, p: usize) -> f32 {
        self.costs_of(p).iter().copied().fold(f32::INFINITY, f32::min)
    }

    /// Takes labels away.
    pub(super) fn forbid(&mut self, is_forbidden: impl Fn(&Label) -> bool) {
        for (label, price) in self.labels.iter().zip(&mut self.prices) {
            if is_forbidden(label) {
                *price = f32::INFINITY;
            }
        }
    }

    /// Costs of a sample.
    pub(super) fn costs_of(&self, p: usize) -> &[f32] {
        &self.costs[p * self.labels.len()..(p + 1) * self.labels.len()]
    }
}

/// Base color in [0, 1] that brings `b slope + offset` nearest to the observations, by reweighted least
/// squares; with the robust cost that is left.
pub(super) fn fit(observations: &[Observation], rows: &[(Vec3, Vec3)]) -> (f32, Vec3) {
    let (cost, base) = fit_channels(observations, rows);
    (cost.element_sum() / 3.0, base)
}

/// The same, with the cost of every channel.
pub(super) fn fit_channels(observations: &[Observation], rows: &[(Vec3, Vec3)]) -> (Vec3, Vec3) {
    // Errors count relative to the brightness of the point, as eyes and sRGB have it.
    let mean: f32 = observations.iter().map(|o| luminance(o.radiance)).sum::<f32>()
        / observations.len().max(1) as f32;
    let inverse_sigma = 1.0 / (NOISE * (mean + 0.02));
    let scale = OUTLIER * OUTLIER;
    let mut trust: Vec<f32> = observations.iter().map(|o| o.weight).collect();
    let mut base = Vec3::splat(0.5);
    let mut cost = Vec3::ZERO;
    for _ in 0..3 {
        let (mut a, mut b) = (Vec3::splat(1e-9), Vec3::ZERO);
        for ((o, (slope, offset)), t) in observations.iter().zip(rows).zip(&trust) {
            a += *slope * *slope * *t;
            b += *slope * (o.radiance - *offset) * *t;
        }
        base = (b / a).clamp(Vec3::ZERO, Vec3::ONE);
        cost = Vec3::ZERO;
        for ((o, (slope, offset)), t) in observations.iter().zip(rows).zip(&mut trust) {
            let residual = (*slope * base + *offset - o.radiance) * inverse_sigma;
            let square = residual.length_squared() / 3.0;
            let robust = scale / (scale + square);
            cost += residual * residual * (0.5 * o.weight * robust);
            *t = o.weight * robust * robust;
        }
    }
    (cost, base)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sample that is seen eight times, and what its material shows each time, off by a share.
    fn profile(off: f32) -> f32 {
        let observations = (0..8)
            .map(|k| Observation {
                photo: k,
                light: 0,
                to_viewer: Vec3::Z,
                radiance: Vec3::splat(0.5 * if k % 2 == 0 { 1.0 + off } else { 1.0 - off }),
                weight: 0.5,
            })
            .collect();
        let sample = Sample::facing_z(observations);
        let terms = Terms { diffuse: Vec3::ONE, metal_slope: Vec3::ONE, ..Terms::default() };
        let basis = Basis { roughness: vec![0.5], terms: vec![terms; 8], first: vec![0, 8] };
        let samples = [sample];
        Profile::new(&samples, &basis, &|_| 0.0).misfit(&samples)
    }

    #[test]
    fn misfit_is_the_squared_error_over_that_of_noise() {
        assert!(profile(0.0) < 1e-6);
        // The noise counts on a little more than the mean, and outliers count less.
        let at_noise = profile(NOISE);
        assert!((0.75..1.0).contains(&at_noise), "{at_noise}");
        assert!(profile(2.0 * NOISE) > 2.0 * at_noise);
        let none = Profile::new(
            &[],
            &Basis { roughness: vec![0.5], terms: vec![], first: vec![0] },
            &|_| 0.0,
        );
        assert_eq!(none.misfit(&[]), 0.0);
    }

    #[test]
    fn what_is_forbidden_has_no_price() {
        let basis = Basis { roughness: vec![0.5], terms: vec![], first: vec![0] };
        let mut profile = Profile::new(&[], &basis, &|_| 1.0);
        profile.forbid(|label| label.kind == Kind::Metal);
        assert_eq!(profile.prices, [1.0, 1.0, f32::INFINITY]);
    }
}
