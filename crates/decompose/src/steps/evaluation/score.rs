//! How far the model's pictures are from the photos.
//!
//! A picture is compared over the pixels of full weight that the Gaussians cover as they were given. The mesh has no say in which these
//! are, or one that leaves out what it explains badly would score better. Where it is missed, the model shows its light.
//!
//! Exposures that the photometry found are those of training photos. A held-out photo has its own, which nothing but the photo tells, so
//! its picture is fitted to it by one gain `g` per channel before they are compared:
//!
//! ```text
//! g = argmin Σ (g model - photo)² = Σ model photo / Σ model²        linear, over what the model does not show beyond white
//! ```

use motes_math::srgb::encode_clipped;
use motes_raster::render;
use motes_scene::ImageF32;
use motes_shading::environment::Environment;

use crate::observation::{Photo, Radiance, SeenView};
use crate::state::Inputs;

/// Alpha of the Gaussians from which a pixel is covered.
const COVERED: f32 = 0.5;

/// What a view's picture is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Score {
    /// PSNR against the photo, sRGB-encoded, dB; NaN where no pixel counts.
    pub psnr_db: f64,
    /// Pixels that count, ...
    pub counted: usize,
    /// ... and those of them that show the surface.
    pub on_surface: usize,
}

/// Scores a view's picture `radiance_linear` against its photo. `light` is what a missed surface leaves open.
pub(super) fn score(
    inputs: &Inputs<'_>,
    light: Option<&Environment>,
    view: &SeenView<'_>,
    radiance_linear: &ImageF32,
    is_held_out: bool,
) -> Score {
    let shown = with_light_behind(view, light, radiance_linear);
    let photo = &view.photo.radiance_linear;
    let counted = counted(inputs, view.photo);
    let has_own_gain = is_held_out && inputs.photos.iter().any(|p| p.gain != [1.0; 3]);
    let gain = if has_own_gain { gain(&shown, photo, &counted) } else { [1.0; 3] };
    let mut sum = 0.0;
    for &i in &counted {
        let photo = photo.at(i);
        for (c, gain) in gain.into_iter().enumerate() {
            let (ours, photo) = (shown.data[3 * i + c] * gain, photo[c]);
            sum += f64::from(encode_clipped(ours) - encode_clipped(photo)).powi(2);
        }
    }
    let psnr_db = match counted.len() {
        0 => f64::NAN,
        count => -10.0 * (sum / (3 * count) as f64).max(1e-12).log10(),
    };
    let on_surface = counted.iter().filter(|&&i| view.hits[i].is_hit()).count();
    Score { psnr_db, counted: counted.len(), on_surface }
}

/// Pixels that count, row by row.
fn counted(inputs: &Inputs<'_>, photo: &Photo) -> Vec<usize> {
    let alpha =
        render(inputs.gaussians, &photo.camera, &photo.camera_from_world, &inputs.render).alpha;
    let pixels = alpha.data.iter().zip(&photo.usable);
    let counts =
        |(i, (alpha, usable)): (usize, (&f32, &bool))| (*alpha >= COVERED && *usable).then_some(i);
    pixels.enumerate().filter_map(counts).collect()
}

/// The picture with the light from infinity where the surface is missed.
fn with_light_behind(
    view: &SeenView<'_>,
    light: Option<&Environment>,
    radiance_linear: &ImageF32,
) -> ImageF32 {
    let mut shown = radiance_linear.clone();
    let Some(light) = light else { return shown };
    let width = view.photo.camera.width;
    let pixels = shown.data.chunks_exact_mut(3).zip(&view.hits).enumerate();
    for (i, (pixel, _)) in pixels.filter(|(_, (_, hit))| !hit.is_hit()) {
        let ray = view.rays.direction((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        pixel.copy_from_slice(&light.radiance_pdf(ray).0.to_array());
    }
    shown
}

/// The gain of a photo over the model, per channel; 1 of a model that shows nothing.
fn gain(shown: &ImageF32, photo: &Radiance, counted: &[usize]) -> [f32; 3] {
    let of = |c: usize| {
        let (mut products, mut squares) = (0.0, 0.0);
        for &i in counted {
            let (ours, photo) = (shown.data[3 * i + c], f64::from(photo.at(i)[c]));
            // A highlight may be a thousand times as bright as white and would decide alone.
            if ours <= 1.0 {
                products += f64::from(ours) * photo;
                squares += f64::from(ours).powi(2);
            }
        }
        if squares > 0.0 { (products / squares) as f32 } else { 1.0 }
    };
    [0, 1, 2].map(of)
}

#[cfg(test)]
mod tests;
