//! Gradients of a loss by the stored parameters of the Gaussians.

use motes_scene::Gaussians;
use rayon::prelude::*;

use crate::lanes::MAX_LANES;

/// One gradient per stored value of [`Gaussians`], same shapes; zero where a Gaussian is not seen.
#[derive(Clone, Debug, Default)]
pub struct GaussianGradients {
    /// `[N, 3]`, per world unit.
    pub means: Vec<[f32; 3]>,
    /// `[N, 4]`, by the stored (not normalized) quaternion.
    pub rotations: Vec<[f32; 4]>,
    /// `[N, 3]`
    pub log_scales: Vec<[f32; 3]>,
    /// `[N]`
    pub opacity_logits: Vec<f32>,
    /// `[N, K, 3]`
    pub sh: Vec<f32>,
    /// `[N]`: norm of the gradient by the projected center in units of half the image size, the
    /// measure that densification thresholds refer to.
    pub center_norm: Vec<f32>,
    /// `[N]`: whether the Gaussian was on the image.
    pub seen: Vec<bool>,
}

impl GaussianGradients {
    /// Zeros in the shapes of `gaussians`.
    pub fn reset(&mut self, gaussians: &Gaussians) {
        *self = Self::default();
        self.resize(gaussians);
    }

    /// Takes the shapes of `gaussians`; reuses memory. Values that were there may stay: the
    /// backward pass writes all of them.
    pub(crate) fn resize(&mut self, gaussians: &Gaussians) {
        let n = gaussians.len();
        self.means.resize(n, [0.0; 3]);
        self.rotations.resize(n, [0.0; 4]);
        self.log_scales.resize(n, [0.0; 3]);
        self.opacity_logits.resize(n, 0.0);
        self.sh.resize(gaussians.sh.len(), 0.0);
        self.center_norm.resize(n, 0.0);
        self.seen.resize(n, false);
    }

    /// Rows in chunks, to be written in parallel.
    pub(crate) fn par_chunks_mut(
        &mut self,
        chunk: usize,
    ) -> impl IndexedParallelIterator<Item = GradientRows<'_>> {
        let sh_row = self.sh.len() / self.means.len().max(1);
        self.means
            .par_chunks_mut(chunk)
            .zip(self.rotations.par_chunks_mut(chunk))
            .zip(self.log_scales.par_chunks_mut(chunk))
            .zip(self.opacity_logits.par_chunks_mut(chunk))
            .zip(self.sh.par_chunks_mut((sh_row * chunk).max(1)))
            .zip(self.center_norm.par_chunks_mut(chunk))
            .zip(self.seen.par_chunks_mut(chunk))
            .map(
                |(
                    (((((means, rotations), log_scales), opacity_logits), sh), center_norm),
                    seen,
                )| {
                    GradientRows {
                        means,
                        rotations,
                        log_scales,
                        opacity_logits,
                        sh,
                        center_norm,
                        seen,
                    }
                },
            )
    }
}

/// Some consecutive rows of [`GaussianGradients`].
pub(crate) struct GradientRows<'a> {
    means: &'a mut [[f32; 3]],
    rotations: &'a mut [[f32; 4]],
    log_scales: &'a mut [[f32; 3]],
    opacity_logits: &'a mut [f32],
    pub(crate) sh: &'a mut [f32],
    center_norm: &'a mut [f32],
    seen: &'a mut [bool],
}

impl GradientRows<'_> {
    pub(crate) fn len(&self) -> usize {
        self.means.len()
    }

    /// Zeros in row `k`, which is not seen.
    #[inline(always)]
    pub(crate) fn clear(&mut self, k: usize) {
        let sh_row = self.sh.len() / self.means.len();
        self.sh[k * sh_row..(k + 1) * sh_row].fill(0.0);
        self.set(&[k as u32], &[[0.0; MAX_LANES]; 12]);
        self.seen[k] = false;
    }

    /// Writes all but the coefficients of some rows, which are seen: mean, rotation, log scales,
    /// opacity logit, norm of the gradient by the center; one row per lane.
    #[inline(always)]
    pub(crate) fn set(&mut self, rows: &[u32], values: &[[f32; MAX_LANES]; 12]) {
        for (lane, &k) in rows.iter().enumerate() {
            let at = |column: usize| values[column][lane];
            let k = k as usize;
            self.means[k] = [at(0), at(1), at(2)];
            self.rotations[k] = [at(3), at(4), at(5), at(6)];
            self.log_scales[k] = [at(7), at(8), at(9)];
            self.opacity_logits[k] = at(10);
            self.center_norm[k] = at(11);
            self.seen[k] = true;
        }
    }
}
