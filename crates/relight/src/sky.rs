//! A captured sky gives way to a new light.
//!
//! Gaussians that stand for the sky are light itself, not matter under it. With `w_i` what Gaussian `i` contributes to a pixel of alpha `α`
//! and `s_i` its share of sky, a picture under a light of which a share `d` is not the scene's own is made of
//!
//! ```text
//! land    = Σ w_i (1 - d s_i) c_i            its color, over black
//! covered = covered by all Σ w_i (1 - d s_i) / α
//! ```
//!
//! What lies behind everything shows in the rest: the new light, or the background that is asked for. Opacities stay, so that nothing
//! that the sky hides comes to light.

use motes_math::sh::{SH_C0, sh_coefficients};
use motes_scene::Gaussians;

use crate::scene::RelightScene;

/// Two lights that are written and read again differ by less.
const LEAST_DIFFERENCE: f32 = 1e-3;

/// The Gaussians of a scene with what is not sky of their colors.
pub(crate) struct Land {
    /// Share of every Gaussian.
    pub(crate) share: Vec<f32>,
    /// Base colors.
    pub(crate) base_color_splats: Gaussians,
    /// Colors as they were captured.
    pub(crate) captured: Gaussians,
}

impl Land {
    /// Under a light of which a share of `different` is not the scene's own; none where the scene has no sky, or it stays.
    pub(crate) fn of(scene: &RelightScene, different: f32) -> Option<Self> {
        let sky = scene.sky.as_deref().filter(|_| different > LEAST_DIFFERENCE)?;
        let share: Vec<f32> = sky.iter().map(|s| 1.0 - different * s).collect();
        let [base_color_splats, captured] =
            [&scene.base_color_splats, &scene.gaussians].map(|all| darkened(all, &share));
        Some(Self { share, base_color_splats, captured })
    }
}

/// Gaussians whose colors are multiplied with a factor each.
fn darkened(gaussians: &Gaussians, factors: &[f32]) -> Gaussians {
    let row = 3 * sh_coefficients(gaussians.sh_degree);
    // Colors are `1/2 + SH_C0 sh_0 + ...`.
    let half = 0.5 / SH_C0 as f32;
    let mut sh = gaussians.sh.clone();
    for (sh, &factor) in sh.chunks_exact_mut(row).zip(factors) {
        sh.iter_mut().for_each(|v| *v *= factor);
        sh[..3].iter_mut().for_each(|v| *v += (factor - 1.0) * half);
    }
    Gaussians {
        means: gaussians.means.clone(),
        rotations: gaussians.rotations.clone(),
        log_scales: gaussians.log_scales.clone(),
        opacity_logits: gaussians.opacity_logits.clone(),
        sh_degree: gaussians.sh_degree,
        sh,
        // Nothing is drawn from the columns, which are many.
        extra: Vec::new(),
    }
}

/// The coverage of pixels that is left of that of all Gaussians, from the alpha of the land and that of all.
pub(crate) fn covered(coverage: Vec<f32>, land: &[f32], all: &[f32]) -> Vec<f32> {
    let left = |(c, (land, all)): (f32, (&f32, &f32))| {
        c * (land / all.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0)
    };
    coverage.into_iter().zip(land.iter().zip(all)).map(left).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coverage_falls_with_the_share_of_the_alpha_that_goes() {
        let left = covered(vec![1.0, 1.0, 0.5, 0.0], &[0.9, 0.2, 0.4, 0.0], &[0.9, 0.8, 0.4, 0.0]);
        assert_eq!(left, [1.0, 0.25, 0.5, 0.0]);
    }

    #[test]
    fn colors_are_multiplied_in_every_direction() {
        let dc = 0.2f32;
        let sh = [dc, dc, dc, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0].repeat(2);
        let two = Gaussians { means: vec![[0.0; 3]; 2], sh, ..Gaussians::empty(1) };
        let dark = darkened(&two, &[1.0, 0.25]);
        assert_eq!(dark.sh[..12], two.sh[..12]);
        let color = |sh: &[f32], k: usize| 0.5 + SH_C0 as f32 * sh[12 + k];
        assert!((color(&dark.sh, 0) - 0.25 * color(&two.sh, 0)).abs() < 1e-6);
        assert!((dark.sh[15] - 0.25 * two.sh[15]).abs() < 1e-7);
    }
}
