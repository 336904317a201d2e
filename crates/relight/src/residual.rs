//! The residual of a scene's Gaussians: per Gaussian and direction of view the logarithm of the photos over the model.

use glam::Vec3;
use motes_scene::{Gaussians, Residual};

/// The columns of a scene, and Gaussians whose colors stand for them.
#[derive(Debug)]
pub(crate) struct SceneResidual {
    pub(crate) residual: Residual,
    /// Colors stand for it.
    pub(crate) splats: Gaussians,
}

impl SceneResidual {
    pub(crate) fn of(gaussians: &Gaussians) -> Result<Option<Self>, String> {
        let residual = Residual::of(gaussians)?;
        Ok(residual.map(|residual| Self { splats: residual.drawn(gaussians), residual }))
    }

    /// Factor on the color of a Gaussian, from the basis of the direction of view.
    pub(crate) fn factor(&self, i: usize, basis: &[f32], share: f32) -> Vec3 {
        self.log_ratio(i, basis).map(|v| (share * v).exp())
    }

    /// Its logarithm; over all directions with the constant alone as basis.
    pub(crate) fn log_ratio(&self, i: usize, basis: &[f32]) -> Vec3 {
        let values = self.residual.log_ratio_sh.len() / self.splats.len().max(1);
        let row = &self.residual.log_ratio_sh[i * values..(i + 1) * values];
        let mut log_ratio = Vec3::ZERO;
        for (y, v) in basis.iter().zip(row.chunks_exact(3)) {
            log_ratio += *y * Vec3::from_slice(v);
        }
        log_ratio.map(|v| Residual::log_ratio(0.5 + v * Residual::drawn_share(), 1.0))
    }
}
