//! What the ratios to all lights have in common: the light of the photos on every Gaussian, found once by [`crate::ratio`].

use glam::Vec3;

use crate::graph::Graph;

/// The light of the photos on every Gaussian of a scene.
#[derive(Debug)]
pub(crate) struct CapturedLight {
    /// Directions per Gaussian, and the key of the random numbers.
    pub(crate) sampled: (u32, u64),
    /// Who lies beside whom.
    pub(crate) graph: Graph,
    /// What is known of every Gaussian.
    pub(crate) trust: Trust,
    /// Where light falls, with its normal.
    pub(crate) places: Vec<(Vec3, Vec3)>,
    /// As received.
    pub(crate) lit: Lit,
    /// Of lamps with nothing between, where there are any.
    pub(crate) of_lamps: Option<Vec<Vec3>>,
    /// With nothing around.
    pub(crate) open: Vec<Vec3>,
    /// Logarithm of what is smooth in the captured colors and goes with this light.
    pub(crate) log_own: Vec<Vec3>,
}

/// Light on every Gaussian.
#[derive(Clone, Debug)]
pub(crate) struct Lit {
    /// Radiance of white Lambert matter, direct light with shadows. A disputed shadow has half its strength.
    pub(crate) radiance: Vec<Vec3>,
    /// How far it is the same with and without disputed shadows, 0 to 1; empty without any.
    pub(crate) agreed: Vec<f32>,
}

/// What is known of every Gaussian.
#[derive(Clone, Debug)]
pub(crate) struct Trust {
    /// Of its material and its place, 0 to 1.
    pub(crate) confidence: Vec<f32>,
    /// How much its neighbors listen to it: its opacity.
    pub(crate) area: Vec<f32>,
}

impl Trust {
    /// A value is known as far as no disputed shadow is part of it.
    pub(crate) fn where_agreed(&self, agreed: &[f32]) -> Self {
        let mut all = self.clone();
        for (confidence, agreed) in all.confidence.iter_mut().zip(agreed) {
            *confidence *= agreed;
        }
        all
    }
}
