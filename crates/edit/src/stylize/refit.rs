//! Colors fitted to the edited pictures.

use std::sync::Arc;

use motes_scene::{Gaussians, ImageF32, SparsePoints, Switch};
use train_splat::{
    AlphaMode, BackgroundModel, ExposureModel, FitError, FitOptions, FreezeGroup, Trainer,
    TrainingImage,
};

use super::{StyleOptions, StyleView};

/// Rates of the colors: some hundred steps have to cover what a first fit has thousands for.
const LR_SH0: f64 = 5e-2;
const LR_SH_REST: f64 = 2.5e-3;

/// Fits the colors of the chosen Gaussians; their places, shapes and opacities stay.
pub(super) fn refit(
    gaussians: &mut Gaussians,
    chosen: &[bool],
    views: &[StyleView],
    targets: &[ImageF32],
    options: &StyleOptions,
    round: u32,
) -> Result<(), FitError> {
    let images: Vec<TrainingImage> = views
        .iter()
        .zip(targets)
        .map(|(view, target)| TrainingImage {
            name: view.name.clone(),
            camera: view.camera,
            camera_from_world: view.camera_from_world,
            image: Arc::new(target.to_u8()),
            mask: None,
            exposure_gain: 1.0,
        })
        .collect();
    // What cannot be drawn cannot be fitted, and the fit would drop it and shift the rows.
    let invalid = gaussians.invalid_rows();
    let rows: Vec<u32> = crate::changes::delete::other_rows(&invalid, gaussians.len());
    let mut start = Gaussians { extra: Vec::new(), ..gaussians.clone() };
    start.gather(&rows);
    let fit = FitOptions {
        iterations: Some(options.steps),
        max_gaussians: Some(start.len().max(1)),
        sh_degree: Some(gaussians.sh_degree),
        resolution_schedule: Some("1:1".into()),
        freeze: vec![FreezeGroup::Geometry, FreezeGroup::Opacities],
        exposure: ExposureModel::None,
        exposure_metadata: Switch::Off,
        background_model: Some(BackgroundModel::None),
        filter_3d: Switch::Off,
        alpha_mode: AlphaMode::Ignore,
        dropout: Some(0.0),
        opacity_weight: Some(0.0),
        scale_weight: Some(0.0),
        dense_step: Some(0),
        lr_sh0: LR_SH0,
        lr_sh_rest: LR_SH_REST,
        ..FitOptions::default()
    };
    let seed = options.seed.wrapping_add(u64::from(round));
    let mut trainer = Trainer::new(&images, &SparsePoints::default(), Some(start), &fit, seed)?;
    while !trainer.is_done() {
        trainer.step();
    }
    let fitted = &trainer.state.gaussians;
    let stride = 3 * gaussians.sh_coefficients();
    for (k, row) in rows.iter().map(|r| *r as usize).enumerate() {
        if chosen[row] {
            gaussians.sh[row * stride..(row + 1) * stride].copy_from_slice(fitted.sh_of(k));
        }
    }
    Ok(())
}
