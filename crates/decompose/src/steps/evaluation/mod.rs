//! Views under the light that was found, against the photos.

mod confidence;

use motes_math::srgb::{decode, encode_clipped};
use motes_raster::RenderOptions;
use motes_scene::{Gaussians, ImageF32};

use crate::appearance::PixelShading;
use crate::observation::SeenView;
use crate::report::Term;
use crate::state::{RenderedView, State};

/// Renders every photo's view, those held out last, and says how far the result is to be trusted.
pub fn run(state: &mut State<'_>) -> Term {
    let (inputs, seen) = (state.inputs, &state.observed);
    let held_out: Vec<SeenView<'_>> =
        inputs.held_out.iter().map(|p| SeenView::new(p, &seen.scene)).collect();
    let views = seen.views.iter().chain(&held_out);
    let gaussians = &state.base_colored.gaussians;
    state.views = rendered(gaussians, &inputs.render, views, &state.shading);
    state.confidence = confidence::confidences(state);
    confidence::term(state)
}

/// Renders base colors (degree 0, sRGB-encoded) and puts them under the shading of every view.
fn rendered<'a>(
    model: &Gaussians,
    render: &RenderOptions,
    views: impl Iterator<Item = &'a SeenView<'a>>,
    shadings: &[PixelShading],
) -> Vec<RenderedView> {
    views
        .zip(shadings)
        .enumerate()
        .map(|(photo, (view, shading))| {
            let r = motes_raster::render(
                model,
                &view.photo.camera,
                &view.photo.camera_from_world,
                render,
            );
            let mut base = r.color;
            for (pixel, alpha) in base.data.chunks_exact_mut(3).zip(&r.alpha.data) {
                pixel.iter_mut().for_each(|v| *v = decode((*v / alpha.max(0.05)).min(1.0)));
            }
            let radiance = shading.relit(&base);
            let psnr_db = psnr(&radiance, view);
            RenderedView { photo, radiance_linear: radiance, base_color_linear: base, psnr_db }
        })
        .collect()
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
