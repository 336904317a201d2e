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
