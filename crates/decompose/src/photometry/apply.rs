//! Photos and Gaussians as a camera without exposure and tone curve of its own would show them.

use motes_math::srgb;
use motes_math::tone_curve::ToneCurve;
use motes_scene::Gaussians;
use rayon::prelude::*;

use super::Photometry;
use crate::observation::Photo;

/// Linear value from which on a photo at the exposure of the model is clipped.
const CLIPPED: f32 = 0.99;

impl Photometry {
    /// Brings training photos, in the order in which they were calibrated, to linear radiance at the exposure of the model.
    pub fn develop(&self, photos: &mut [Photo]) {
        for (photo, log_gains) in photos.iter_mut().zip(&self.log_gains) {
            develop(photo, self.tone_curve, *log_gains);
        }
    }

    /// The same for photos whose exposure is not known: they keep it.
    pub fn develop_held_out(&self, photos: &mut [Photo]) {
        photos.iter_mut().for_each(|photo| develop(photo, self.tone_curve, [0.0; 3]));
    }

    /// The Gaussians in sRGB-encoded values of linear light.
    pub fn develop_gaussians(&self, gaussians: &mut Gaussians) {
        if !self.tone_curve.is_identity() {
            *gaussians = gaussians.with_colors_mapped(|_, _, v| self.tone_curve.invert(v));
        }
    }
}

fn develop(photo: &mut Photo, curve: ToneCurve, log_gains: [f64; 3]) {
    if curve.is_identity() && log_gains == [0.0; 3] {
        return;
    }
    let factor = log_gains.map(|g| (-g).exp() as f32);
    photo.gain = log_gains.map(|g| g.exp() as f32);
    photo.clipped.resize(photo.usable.len(), false);
    photo.radiance_linear.map(|c, v| {
        let v = if curve.is_identity() { v } else { srgb::decode(curve.invert(srgb::encode(v))) };
        v * factor[c]
    });
    let radiance = &photo.radiance_linear;
    let marks = photo.usable.par_iter_mut().zip(photo.clipped.par_iter_mut());
    marks.enumerate().with_min_len(4096).for_each(|(i, (usable, clipped))| {
        if radiance.at(i).to_array().into_iter().any(|v| v > CLIPPED) {
            // At the exposure of the model, which all that is told by clipping goes by.
            *clipped |= *usable;
            *usable = false;
        }
    });
    photo.radiance_linear.map(|_, v| if v > CLIPPED { v.min(1.0) } else { v });
}
