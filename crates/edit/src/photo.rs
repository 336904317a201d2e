//! An edit seen in a photo: differential rendering (Debevec 1998, "Rendering Synthetic Objects into Real Scenes").
//!
//! Where the Gaussians that an edit placed, took away or changed the material of cover a share `a` of a pixel, it shows the edited
//! scene; the rest is the photo, brighter or darker as what stays became:
//!
//! ```text
//! photo after = a edited + (1 - a) photo (rest after / rest before)        linear
//! ```
//!
//! A photo has the tone curve of its camera, which the Gaussians of a decomposed scene are without: it is taken off first and put on
//! the result.

use motes_math::sh::SH_C0;
use motes_math::srgb;
use motes_raster::{Antialias, RenderOptions, render};
use motes_scene::{Gaussians, ImageU8, Pinhole, Pose};

use crate::{EditState, Origin, SCENE};

/// Added to both sides of a ratio, linear: what is black in both stays as it is.
const DARK: f32 = 2e-3;
/// Least and largest ratio.
const RATIOS: (f32, f32) = (0.02, 8.0);

/// A photo's camera and how Gaussians are drawn.
#[derive(Clone, Copy, Debug)]
pub struct PhotoView<'a> {
    /// Of the size of the photo.
    pub camera: &'a Pinhole,
    /// Its pose.
    pub camera_from_world: &'a Pose,
    /// Footprint of the Gaussians.
    pub antialias: Antialias,
}

/// The photo (sRGB, 3 or 4 channels, of the camera's size) with the edit in it. `before` are the Gaussians before the first
/// operation, `after` the state when light has followed.
///
/// # Panics
/// When the photo has another size than its camera.
pub fn photo_after(
    photo: &ImageU8,
    before: &Gaussians,
    after: &EditState,
    view: PhotoView<'_>,
) -> ImageU8 {
    let (width, height) = (view.camera.width, view.camera.height);
    assert_eq!((photo.width, photo.height), (width, height), "a photo of its camera");
    let is_other = others(after);
    let mut stays = vec![false; before.len()];
    for (origin, _) in after.origins.iter().zip(&is_other).filter(|(_, other)| !**other) {
        stays[origin.row as usize] = true;
    }
    let is_gone: Vec<bool> = stays.iter().map(|stays| !stays).collect();
    let edited = view.draw(&after.gaussians);
    let [covered, uncovered] =
        [view.coverage(&after.gaussians, &is_other), view.coverage(before, &is_gone)];
    let rest_after = view.draw(&without(&after.gaussians, &is_other));
    let rest_before = view.draw(&without(before, &is_gone));
    let curve = after.tone_curve();
    let mut out = ImageU8::filled(width, height, 3, 0);
    for i in 0..width * height {
        let share = 1.0 - (1.0 - covered[i]) * (1.0 - uncovered[i]);
        let pixel = &photo.data[photo.channels * i..];
        let after: [u8; 3] = std::array::from_fn(|c| {
            let of = |image: &[f32]| srgb::decode(image[3 * i + c].clamp(0.0, 1.0));
            let ratio = (of(&rest_after) + DARK) / (of(&rest_before) + DARK);
            let own = srgb::decode(curve.invert(f32::from(pixel[c]) / 255.0));
            let rest = own * ratio.clamp(RATIOS.0, RATIOS.1);
            let mixed = share * of(&edited) + (1.0 - share) * rest;
            (curve.apply(srgb::encode(mixed.clamp(0.0, 1.0))) * 255.0).round() as u8
        });
        out.pixel_mut(i % width, i / width).copy_from_slice(&after);
    }
    out
}

/// Which present Gaussians are not what stood there before: placed, made, moved, or of another material.
fn others(state: &EditState) -> Vec<bool> {
    let is_other = |(i, origin): (usize, &Origin)| {
        origin.source != SCENE
            || origin.row == Origin::NEW_ROW
            || !state.motions[origin.motion as usize].is_identity()
            || state.material_changed[i]
    };
    state.origins.iter().enumerate().map(is_other).collect()
}

fn without(gaussians: &Gaussians, is_left_out: &[bool]) -> Gaussians {
    let rows: Vec<u32> =
        (0..gaussians.len() as u32).filter(|r| !is_left_out[*r as usize]).collect();
    let mut rest = gaussians.clone();
    rest.gather(&rows);
    rest
}

impl PhotoView<'_> {
    fn draw(&self, gaussians: &Gaussians) -> Vec<f32> {
        let options = RenderOptions { antialias: self.antialias, ..RenderOptions::default() };
        render(gaussians, self.camera, self.camera_from_world, &options).color.data
    }

    /// Share of each pixel that some Gaussians make up.
    fn coverage(&self, gaussians: &Gaussians, counts: &[bool]) -> Vec<f32> {
        if !counts.contains(&true) {
            return vec![0.0; self.camera.width * self.camera.height];
        }
        let shade = |counts: &bool| {
            if *counts { [0.5 / SH_C0 as f32; 3] } else { [-0.5 / SH_C0 as f32; 3] }
        };
        let sh = counts.iter().flat_map(shade).collect();
        let drawn = self.draw(&Gaussians { sh_degree: 0, sh, ..gaussians.clone() });
        drawn.chunks_exact(3).map(|p| p[0].clamp(0.0, 1.0)).collect()
    }
}

#[cfg(test)]
mod tests;
