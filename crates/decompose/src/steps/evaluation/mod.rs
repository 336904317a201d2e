//! Views under the light that was found, against the photos.

mod confidence;
mod detail;
mod score;
mod sky;

use motes_math::srgb::decode;
use motes_scene::ImageF32;

use crate::appearance::PixelShading;
use crate::observation::SeenView;
use crate::report::Term;
use crate::state::{RenderedView, State};
use confidence::Confidence;
use score::score;

/// Renders every photo's view, those held out last, and says how far the result is to be trusted and what is sky.
pub fn run(state: &mut State<'_>) -> [Term; 2] {
    let (inputs, seen) = (state.inputs, &state.observed);
    let mut confidence = Confidence::new(state.gaussians().len());
    let held_out: Vec<SeenView<'_>> =
        inputs.held_out.iter().map(|p| SeenView::new(p, &seen.scene)).collect();
    let shown = seen.views.iter().chain(&held_out).zip(&state.shading);
    let mut views = Vec::with_capacity(state.shading.len());
    let mut on_surface = [0, 0];
    for (photo, (view, shading)) in shown.enumerate() {
        let picture = Picture::of(state, view, shading);
        let is_held_out = photo >= seen.views.len();
        let light = state.illumination.lights.get(view.photo.light);
        let score = score(inputs, light, view, &picture.radiance_linear, is_held_out);
        views.push(RenderedView { photo, psnr_db: score.psnr_db });
        on_surface = [on_surface[0] + score.on_surface, on_surface[1] + score.counted];
        if !is_held_out {
            confidence.see(state, view, &picture, shading);
        }
    }
    state.confidence = confidence.of_gaussians();
    state.views = views;
    let (sky, of_sky) = sky::run(state);
    state.sky = sky;
    let [on, of] = on_surface;
    [confidence::term(state, (of > 0).then(|| on as f64 / of as f64)), of_sky]
}

/// What the model shows in the place of a photo.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    /// Linear, photo units, `[h, w, 3]`; 0 where the surface is missed.
    pub radiance_linear: ImageF32,
    /// Base color as the Gaussians show it, `[h, w, 3]`.
    pub base_color_linear: ImageF32,
}

impl Picture {
    /// Renders base colors (degree 0, sRGB-encoded) and puts them under the shading of a view.
    fn of(state: &State<'_>, view: &SeenView<'_>, shading: &PixelShading) -> Self {
        let (model, photo) = (&state.base_colored.gaussians, view.photo);
        let render = &state.inputs.render;
        let drawn = motes_raster::render(model, &photo.camera, &photo.camera_from_world, render);
        let mut base = drawn.color;
        for (pixel, alpha) in base.data.chunks_exact_mut(3).zip(&drawn.alpha.data) {
            pixel.iter_mut().for_each(|v| *v = decode((*v / alpha.max(0.05)).min(1.0)));
        }
        Self { radiance_linear: shading.relit(&base), base_color_linear: base }
    }

    /// The same by the number of the photo: those trained on, then those held out. None before the step `shading`.
    pub(crate) fn of_photo(state: &State<'_>, photo: usize) -> Option<Self> {
        let (inputs, seen) = (state.inputs, &state.observed);
        let shading = state.shading.get(photo)?;
        if let Some(view) = seen.views.get(photo) {
            return Some(Self::of(state, view, shading));
        }
        let held_out = inputs.held_out.get(photo.checked_sub(seen.views.len())?)?;
        Some(Self::of(state, &SeenView::new(held_out, &seen.scene), shading))
    }
}
