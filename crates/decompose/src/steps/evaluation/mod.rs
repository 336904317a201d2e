//! Views under the light that was found, against the photos.

mod confidence;
mod detail;

use motes_math::srgb::{decode, encode_clipped};
use motes_scene::ImageF32;

use crate::appearance::PixelShading;
use crate::observation::SeenView;
use crate::report::Term;
use crate::state::{RenderedView, State};
use confidence::Confidence;

/// Renders every photo's view, those held out last, and says how far the result is to be trusted.
pub fn run(state: &mut State<'_>) -> Term {
    let (inputs, seen) = (state.inputs, &state.observed);
    let mut confidence = Confidence::new(state.gaussians().len());
    let held_out: Vec<SeenView<'_>> =
        inputs.held_out.iter().map(|p| SeenView::new(p, &seen.scene)).collect();
    let shown = seen.views.iter().chain(&held_out).zip(&state.shading);
    let mut views = Vec::with_capacity(state.shading.len());
    for (photo, (view, shading)) in shown.enumerate() {
        let picture = Picture::of(state, view, shading);
        views.push(RenderedView { photo, psnr_db: psnr(&picture.radiance_linear, view) });
        if photo < seen.views.len() {
            confidence.see(state, view, &picture, shading);
        }
    }
    state.confidence = confidence.of_gaussians();
    state.views = views;
    confidence::term(state)
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

fn psnr(radiance: &ImageF32, view: &SeenView<'_>) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    let pixels = radiance.data.chunks_exact(3).zip(view.photo.radiance_linear.data.chunks_exact(3));
    for ((ours, photo), hit) in pixels.zip(&view.hits) {
        if hit.is_hit() {
            for (a, b) in ours.iter().zip(photo) {
                sum += f64::from(encode_clipped(*a) - encode_clipped(*b)).powi(2);
                count += 1;
            }
        }
    }
    if count == 0 { f64::NAN } else { -10.0 * (sum / count as f64).max(1e-12).log10() }
}
