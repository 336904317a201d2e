//! How much of what photos show through each Gaussian is sky.
//!
//! Gaussians that stand for the sky are fog in front of it, and no depth tells them from what is there. Their shares are such that they
//! blend to the masks of the photos, as colors do to pictures.

use glam::Vec3;
use half::f16;
use motes_scene::Switch;
use rayon::prelude::*;

use crate::appearance::half_pixels::HalfPixels;
use crate::observation::SeenView;
use crate::observation::sky::{FoundSky, Shown, find_sky};
use crate::report::{Term, numbers};
use crate::state::State;
use crate::steps::base_color::{ColorTarget, fit_colors};

/// Pixels of a photo per pixel that shares are fitted to, along each side.
const REDUCED: usize = 2;
/// Passes over the photos.
const PASSES: u32 = 10;
/// Shares up to this count as none: colors are never black.
const LEAST: f32 = 0.02;

/// Looks for the sky; the share of every Gaussian, empty where there is none.
pub(super) fn run(state: &State<'_>) -> (Vec<f32>, Term) {
    let wanted = state.inputs.model.sky;
    let found = match wanted {
        Switch::Off => FoundSky::default(),
        _ => find_sky(&state.observed.views, state.up_in_world),
    };
    let is_kept = found.is_kept(wanted);
    let sky = if is_kept { lifted(state, &found) } else { Vec::new() };
    (sky, term(&found, is_kept, wanted))
}

fn lifted(state: &State<'_>, found: &FoundSky) -> Vec<f32> {
    let gaussians = state.gaussians();
    let views = state.observed.views.iter().zip(&found.masks);
    let targets: Vec<ColorTarget> = views.map(|(view, mask)| target(view, mask)).collect();
    let start = vec![Vec3::ZERO; gaussians.len()];
    let fitted = fit_colors(gaussians, &targets, &start, PASSES, &state.inputs.render);
    fitted.colors.iter().map(|color| if color.x > LEAST { color.x } else { 0.0 }).collect()
}

/// The mask as a small picture: white is sky.
fn target(view: &SeenView<'_>, mask: &[Shown]) -> ColorTarget {
    let camera = &view.photo.camera;
    let [width, height] = [camera.width, camera.height].map(|n| n.div_ceil(REDUCED));
    let pixel = |i: usize| {
        let (x, y) = (i % width * REDUCED, i / width * REDUCED);
        let (mut sky, mut known, mut all) = (0.0f32, 0.0f32, 0.0f32);
        for row in y..(y + REDUCED).min(camera.height) {
            let row = &mask[row * camera.width..][..camera.width];
            for shown in &row[x..(x + REDUCED).min(camera.width)] {
                sky += f32::from(u8::from(*shown == Shown::Sky));
                known += f32::from(u8::from(*shown != Shown::Unknown));
                all += 1.0;
            }
        }
        (sky / known.max(1.0), known / all)
    };
    let pixels: Vec<(f32, f32)> = (0..width * height).into_par_iter().map(pixel).collect();
    ColorTarget {
        camera: camera.resized(width, height),
        camera_from_world: view.photo.camera_from_world,
        color: HalfPixels::new(pixels.iter().map(|(sky, _)| Vec3::splat(*sky))),
        weight: pixels.iter().map(|(_, known)| f16::from_f32(*known)).collect(),
    }
}

fn term(found: &FoundSky, is_kept: bool, wanted: Switch) -> Term {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let evidence = if wanted == Switch::Off {
        "turned off: --sky auto looks for it".into()
    } else if is_kept {
        format!(
            "{} of the photos is sky: one smooth color per direction explains {} of what is bright and even above the horizon; relight shows the new light there",
            percent(found.area),
            percent(found.explained)
        )
    } else if found.explained == 0.0 {
        "no photo shows anything bright and even above the horizon without a surface".into()
    } else {
        format!(
            "a sky has one color per direction ({} of what is bright and even above the horizon), no surface ({}), ends at the horizon ({} of what is below has its color) and is in three photos ({})",
            percent(found.explained),
            percent(found.surface),
            percent(found.below),
            found.photos
        )
    };
    Term {
        name: "sky".into(),
        kept: is_kept,
        evidence,
        numbers: numbers([
            ("area_share", Some(found.area)),
            ("photos", Some(found.photos as f64)),
            ("explained_share", Some(found.explained)),
            ("surface_share", Some(found.surface)),
            ("below_horizon_share", Some(found.below)),
        ]),
    }
}
