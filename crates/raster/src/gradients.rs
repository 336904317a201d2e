//! Gradients of a loss by the stored parameters of the Gaussians.

use motes_scene::Gaussians;

/// One gradient per stored value of [`Gaussians`], same shapes; zero where a Gaussian is not seen.
#[derive(Clone, Debug, Default)]
pub struct GaussianGradients {
    /// `[N, 3]`, per world unit.
    pub means: Vec<[f32; 3]>,
    /// `[N, 4]`, by the stored (not normalised) quaternion.
    pub rotations: Vec<[f32; 4]>,
    /// `[N, 3]`
    pub log_scales: Vec<[f32; 3]>,
    /// `[N]`
    pub opacity_logits: Vec<f32>,
    /// `[N, K, 3]`
    pub sh: Vec<f32>,
    /// `[N]`: norm of the gradient by the projected centre in units of half the image size, the
    /// measure that densification thresholds refer to.
    pub center_norm: Vec<f32>,
    /// `[N]`: whether the Gaussian was on the image.
    pub seen: Vec<bool>,
}

impl GaussianGradients {
    /// Zeros in the shapes of `gaussians`; reuses memory.
    pub fn reset(&mut self, gaussians: &Gaussians) {
        let n = gaussians.len();
        self.means.clear();
        self.means.resize(n, [0.0; 3]);
        self.rotations.clear();
        self.rotations.resize(n, [0.0; 4]);
        self.log_scales.clear();
        self.log_scales.resize(n, [0.0; 3]);
        self.opacity_logits.clear();
        self.opacity_logits.resize(n, 0.0);
        self.sh.clear();
        self.sh.resize(gaussians.sh.len(), 0.0);
        self.center_norm.clear();
        self.center_norm.resize(n, 0.0);
        self.seen.clear();
        self.seen.resize(n, false);
    }
}
