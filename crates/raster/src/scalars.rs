//! Pictures of numbers that Gaussians carry: coverage of a selection, of an object, of a label.

use motes_math::sh::SH_C0;
use motes_scene::{Gaussians, ImageF32, Pinhole, Pose};

use crate::options::RenderOptions;
use crate::render::render;

/// Renders up to three numbers per Gaussian, 0 or more: `Σ v_i alpha_i T_i` per pixel, `[h, w, 3]`, 0 for
/// planes that were not given. With `v = 1` for those that belong, it is the coverage of a selection.
///
/// # Panics
/// When there are more than three planes, or one has not one value per Gaussian.
pub fn render_scalars(
    gaussians: &Gaussians,
    planes: &[&[f32]],
    camera: &Pinhole,
    camera_from_world: &Pose,
    options: &RenderOptions,
) -> ImageF32 {
    assert!(planes.len() <= 3, "{} planes", planes.len());
    let scale = (1.0 / SH_C0) as f32;
    let mut sh = vec![-0.5 * scale; 3 * gaussians.len()];
    for (channel, values) in planes.iter().enumerate() {
        assert_eq!(values.len(), gaussians.len(), "one value per Gaussian");
        for (sh, v) in sh.iter_mut().skip(channel).step_by(3).zip(*values) {
            *sh = (v - 0.5) * scale;
        }
    }
    let carrier = Gaussians {
        means: gaussians.means.clone(),
        rotations: gaussians.rotations.clone(),
        log_scales: gaussians.log_scales.clone(),
        opacity_logits: gaussians.opacity_logits.clone(),
        sh_degree: 0,
        sh,
        extra: Vec::new(),
    };
    let options = RenderOptions { background: [0.0; 3], aovs: false, ..options.clone() };
    render(&carrier, camera, camera_from_world, &options).color
}
