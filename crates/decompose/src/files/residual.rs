//! What the model leaves unexplained of the photos, measured against the pictures that `relight` makes of it.

use crate::{Photo, ResidualOptions, ResidualView, fit_residual};
use glam::Vec3;
use motes_formats::decomposition::TermDocument;
use motes_math::srgb;
use motes_raster::{Antialias, RenderOptions, render};
use motes_scene::{Gaussians, ImageF32, Residual, Surface};
use motes_shading::brdf::Lobes;
use motes_shading::environment::Convention;
use motes_stage::StageError;
use relight::{
    Background, Exposure, LightSource, Quality, QualityOptions, RelightScene, Relighter,
    ResidualShare,
};

use super::report::numbers;

/// Coverage from which a pixel shows the model more than what is behind.
const COVERED: f32 = 0.5;

/// The scene as it was found.
pub(super) struct Found<'a> {
    /// With the columns of their materials.
    pub gaussians: &'a Gaussians,
    pub surface: &'a Surface,
    pub lobes: Lobes,
    pub indirect: bool,
    pub up_in_world: Vec3,
    pub antialias: Antialias,
    /// The light of `photos`, photo units.
    pub light: ImageF32,
    pub convention: Convention,
    /// Training photos under that light.
    pub photos: Vec<&'a Photo>,
}

/// What is left unexplained, and what it is worth.
pub(super) struct Unexplained {
    pub residual: Residual,
    pub term: TermDocument,
}

impl Found<'_> {
    /// Shades every photo's view as `relight` does and fits the residual. `observer` gets the share that is done.
    ///
    /// # Errors
    /// What the observer says, or a scene that cannot be lit.
    pub(super) fn unexplained(
        &self,
        options: &ResidualOptions,
        mut observer: impl FnMut(f32) -> Result<(), StageError>,
    ) -> anyhow::Result<Unexplained> {
        let (surface, gaussians) = (self.surface.clone(), self.gaussians.clone());
        let up = self.up_in_world;
        let mut scene = RelightScene::new(gaussians, surface, self.lobes, self.indirect, up)?;
        scene.antialias = self.antialias;
        let light = LightSource::Map { image: self.light.clone(), convention: self.convention };
        let light = light.light(0.0, Exposure::Factor(1.0), up, &|| None)?;
        let mut quality = QualityOptions::of(Quality::Standard);
        quality.residual = ResidualShare::OFF;
        let relighter = Relighter::new(&scene, &light.environment, &quality, options.seed);
        let count = self.photos.len().max(1) as f32;
        let mut pictures = Vec::with_capacity(self.photos.len());
        for (k, photo) in self.photos.iter().enumerate() {
            observer(0.5 * k as f32 / count)?;
            let (camera, pose) = (&photo.camera, &photo.camera_from_world);
            let picture = relighter.picture(camera, pose, Background::Transparent, true);
            let Some(components) = picture.components else { continue };
            let mut weight = photo.weight.clone();
            for (weight, alpha) in weight.data.iter_mut().zip(&components.alpha.data) {
                if !(*alpha >= COVERED) {
                    *weight = 0.0;
                }
            }
            pictures.push((components.color_linear, weight));
        }
        let views: Vec<ResidualView<'_>> = self
            .photos
            .iter()
            .zip(&pictures)
            .map(|(photo, (model, weight))| ResidualView {
                camera: photo.camera,
                camera_from_world: photo.camera_from_world,
                photo_linear: &photo.radiance_linear,
                weight,
                model_linear: model,
            })
            .collect();
        let antialias = self.antialias;
        let render_options = RenderOptions { antialias, ..RenderOptions::default() };
        let residual = fit_residual(self.gaussians, &views, &render_options, options, |done| {
            observer(0.5 + 0.5 * done)
        })?;
        let term = self.term(&residual, &views, &render_options);
        Ok(Unexplained { residual, term })
    }

    fn term(
        &self,
        residual: &Residual,
        views: &[ResidualView<'_>],
        options: &RenderOptions,
    ) -> TermDocument {
        let drawn = residual.drawn(self.gaussians);
        let (mut without, mut with, mut count) = (0.0, 0.0, 0.0);
        for view in views {
            let ratios = render(&drawn, &view.camera, &view.camera_from_world, options);
            for (k, model) in view.model_linear.data.iter().enumerate() {
                if !(view.weight.data[k / 3] > 0.0) {
                    continue;
                }
                let log_ratio = Residual::log_ratio(ratios.color.data[k], ratios.alpha.data[k / 3]);
                let seen = srgb::encode_clipped(view.photo_linear.data[k]);
                without += f64::from(srgb::encode_clipped(*model) - seen).powi(2);
                with += f64::from(srgb::encode_clipped(*model * log_ratio.exp()) - seen).powi(2);
                count += 1.0;
            }
        }
        let db = |sum: f64| (count > 0.0).then(|| -10.0 * (sum / count).max(1e-12).log10());
        let (without, with) = (db(without), db(with));
        let text = |db: Option<f64>| db.map_or("none".into(), |db| format!("{db:.2}"));
        TermDocument {
            name: "residual".into(),
            kept: true,
            evidence: format!(
                "a factor of degree {} on the model's pictures brings training views from {} to {} dB",
                residual.degree,
                text(without),
                text(with)
            ),
            numbers: numbers([
                ("psnr_db_without", without),
                ("psnr_db", with),
                ("degree", Some(f64::from(residual.degree))),
            ]),
        }
    }
}
