//! Weights of the cost of a light, and its robust norm.

use std::sync::Arc;

use crate::illumination::seen_sky::SeenSky;

/// Weights and schedule.
#[derive(Clone, Debug)]
pub struct SolveOptions {
    /// `λ_smooth`.
    pub smooth: f32,
    /// `λ_white`.
    pub white: f32,
    /// `λ_scale`.
    pub scale: f32,
    /// `λ_color`.
    pub color: f32,
    /// `λ_above`, where nothing is said of it.
    pub above: f32,
    /// `λ_clear`, where nothing is said of it.
    pub clear_sky: f32,
    /// `λ_glossy`.
    pub glossy: f32,
    /// `anchor`: typical base color.
    pub typical_base_color: f32,
    /// `σ` of the likeness.
    pub sigma: f32,
    /// Steps.
    pub steps: u32,
    /// Rate of the first step, log units.
    pub rate: f32,
    /// What photos show of the sky, which cells keep to.
    pub(crate) sky: Arc<SeenSky>,
    /// Name and weight of priors without a field here.
    pub others: Vec<(&'static str, f32)>,
}

/// `sqrt(x² + σ²) - σ` and its derivative.
#[inline]
pub(super) fn rho(x: f32, sigma: f32) -> (f32, f32) {
    let root = (x * x + sigma * sigma).sqrt();
    (root - sigma, x / root)
}
