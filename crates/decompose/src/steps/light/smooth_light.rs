//! A light without detail, which lights of finer cells are held against.

use glam::Vec3;

use super::pairs::Pair;
use super::problem::{DIM, base_colors};
use super::solve::LitPoints;
use crate::illumination::CellLight;

/// The light in cells of level 0.
pub(super) struct SmoothLight {
    pub lights: Vec<CellLight>,
    /// Samples per capture.
    pub rows: Vec<Vec<u32>>,
    pub lit: Vec<LitPoints>,
    /// Of any color.
    pub pairs: Vec<Pair>,
    /// Of every solution, before and after.
    pub costs: Vec<(f64, f64)>,
}

impl SmoothLight {
    /// Mean difference of the logarithms of base colors that these lights leave between its pairs.
    pub(super) fn unlikeness(&self, lit: &[LitPoints], lights: &[CellLight]) -> f64 {
        let log = |b: Vec3| b.max(Vec3::splat(DIM)).map(f32::ln);
        let of =
            |(lit, light): (&LitPoints, &CellLight)| base_colors(lit, light).into_iter().map(log);
        let log_base: Vec<Vec3> = lit.iter().zip(lights).flat_map(of).collect();
        let (mut sum, mut total) = (0.0, 0.0);
        for Pair { a, b, weight } in &self.pairs {
            let off = (log_base[*a as usize] - log_base[*b as usize]).abs().element_sum();
            sum += f64::from(weight * off);
            total += f64::from(*weight);
        }
        sum / total.max(f64::MIN_POSITIVE)
    }
}
