//! The pictures that relighting makes of the scene under its own light.

use half::f16;
use motes_scene::{Gaussians, ImageF32};
use motes_shading::brdf::Lobes;
use rayon::prelude::*;
use relight::{
    Background, Exposure, LightSource, Place, Quality, QualityOptions, RelightScene, Relighter,
    ResidualShare,
};

use super::fit::ResidualView;
use crate::error::DecomposeError;
use crate::observation::local_factors::LocalFactors;
use crate::observation::{Photo, SeenView};
use crate::progress::Tick;
use crate::state::State;

/// Coverage from which a pixel shows the model more than what is behind.
const COVERED: f32 = 0.5;

/// A photo with what the model shows in its place.
pub(super) struct Picture<'a> {
    photo: &'a Photo,
    /// 0 where the model covers too little of a pixel to show itself.
    color_linear: Vec<f16>,
}

impl Picture<'_> {
    pub(super) fn view(&self) -> ResidualView<'_> {
        ResidualView {
            camera: self.photo.camera,
            camera_from_world: self.photo.camera_from_world,
            photo_linear: &self.photo.radiance_linear,
            usable: &self.photo.usable,
            model_linear: &self.color_linear,
        }
    }
}

/// Pictures for the training photos under light 0, whose map is `light`.
pub(super) fn pictures<'a>(
    state: &State<'a>,
    gaussians: &Gaussians,
    light: ImageF32,
    quality: Quality,
    tick: &mut Tick<'_>,
) -> Result<Vec<Picture<'a>>, DecomposeError> {
    let inputs = state.inputs;
    let failed = |error: &dyn std::error::Error| DecomposeError::Relight(error.to_string());
    let lobes = if state.is_specular() { inputs.model.lobes } else { Lobes::Lambert };
    let (surface, up) = (state.shining_surface(), state.up_in_world);
    let mut scene = RelightScene::new(gaussians.clone(), surface, lobes, state.has_indirect(), up)
        .map_err(|e| failed(&e))?;
    scene.antialias = inputs.render.antialias;
    let light = LightSource::Map { image: light, axes: state.map_axes() };
    let light = light
        .light(0.0, Exposure::Factor(1.0), &Place::with_up(up), &|| None)
        .map_err(|e| failed(&e))?;
    let quality = QualityOptions { residual: ResidualShare::OFF, ..QualityOptions::of(quality) };
    let relighter = Relighter::new(&scene, &light.environment, &quality, inputs.seed);
    let views: Vec<&SeenView<'a>> =
        state.observed.views.iter().filter(|view| view.photo.light == 0).collect();
    let factors = state.observed.local_factors();
    let count = views.len().max(1) as f32;
    let mut pictures = Vec::with_capacity(views.len());
    for (k, view) in views.into_iter().enumerate() {
        let photo = view.photo;
        tick(k as f32 / count)?;
        let (camera, pose) = (&photo.camera, &photo.camera_from_world);
        let picture = relighter.picture(camera, pose, Background::Transparent, true);
        let Some(mut components) = picture.components else { continue };
        if let Some(factors) = &factors {
            light_locally(&mut components.color_linear, factors, view);
        }
        let pixels = components.color_linear.data.chunks_exact(3).zip(&components.alpha.data);
        let shown = pixels.flat_map(|(color, alpha)| {
            let covers = *alpha >= COVERED;
            let of = |c: usize| if covers { color[c].min(f16::MAX.to_f32()) } else { 0.0 };
            [0, 1, 2].map(|c| f16::from_f32(of(c)))
        });
        pictures.push(Picture { photo, color_linear: shown.collect() });
    }
    Ok(pictures)
}

/// Puts the local light on a picture under the light at infinity.
fn light_locally(color_linear: &mut ImageF32, factors: &LocalFactors<'_>, view: &SeenView<'_>) {
    let pixels = color_linear.data.par_chunks_exact_mut(3).with_min_len(1024);
    pixels.enumerate().for_each(|(i, pixel)| {
        let factor = factors.at(view, i).to_array();
        pixel.iter_mut().zip(factor).for_each(|(v, factor)| *v *= factor);
    });
}
