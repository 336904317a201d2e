//! The exposure that a photographer would take.
//!
//! The pictures are metered as they will be seen: small, without light from surface to surface. Their mean over the logarithm becomes that
//! of the same pictures under the scene's own light, which a photographer has exposed; that keeps a white room white. Light that is
//! known in lux stays darker than daylight by a fifth of a stop for every stop that it is below EV 15, as dusk looks darker than
//! noon. Then the brightest percent of the pixels is kept from clipping, for at most one stop.

use motes_math::luminance::luminance_f64;
use motes_scene::{Pinhole, Pose};
use motes_shading::environment::Environment;

use crate::compose::Background;
use crate::options::{Quality, QualityOptions};
use crate::relighter::Relighter;
use crate::scene::RelightScene;

/// Longer side of the pictures that are metered, pixels.
const SIDE: usize = 96;
/// That many pictures, evenly over all, are enough.
const PICTURES: usize = 4;
/// Full daylight, EV at ISO 100.
const DAYLIGHT_EV: f64 = 15.0;
/// Stops darker per stop below daylight.
const ADAPTATION: f64 = 0.2;
/// And at most so many stops.
const DARKEST: f64 = 2.0;
/// Share of the pixels that may clip.
const CLIPPING: f64 = 0.01;
/// Highlights are worth so many stops.
const MAX_HIGHLIGHT_STOPS: f64 = 1.0;

/// What a meter sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reading {
    /// Mean luminance over the logarithm.
    mean: f64,
    /// Largest channel that all but 1 % of the pixels stay below.
    bright: f64,
}

/// Meters the pictures of `frames` under `light`, shown with as much caution as `shown` asks for; none where nothing is lit.
pub(crate) fn reading(
    scene: &RelightScene,
    light: &Environment,
    frames: &[(Pinhole, Pose)],
    shown: &QualityOptions,
    seed: u64,
) -> Option<Reading> {
    let preview = QualityOptions::of(Quality::Preview);
    let (light_samples, brdf_samples) = preview.samples();
    // Of the quality that is shown, the pictures keep what the scene has ready: the ratio to the light of the photos.
    let quality = QualityOptions {
        quality: shown.quality,
        light_samples: Some(light_samples),
        brdf_samples: Some(brdf_samples),
        shade_every: Some(preview.shade_every() as u32),
        denoise: Some(preview.denoise_strength()),
        bounces: Some(0),
        caution: if shown.shows_model_alone() { 0.0 } else { shown.caution },
        ..preview
    };
    let relighter = Relighter::new(scene, light, &quality, seed);
    let chosen = PICTURES.min(frames.len());
    let (mut luminances, mut largest) = (Vec::new(), Vec::new());
    for i in 0..chosen {
        let (camera, pose) = &frames[i * frames.len() / chosen];
        let shrink = (camera.width.max(camera.height) as f64 / SIDE as f64).max(1.0);
        let side = |n: usize| ((n as f64 / shrink).round() as usize).max(1);
        let camera = camera.resized(side(camera.width), side(camera.height));
        let picture = relighter.picture(&camera, pose, Background::Transparent, true);
        let Some(parts) = picture.components else { continue };
        for (color, alpha) in parts.color_linear.data.chunks_exact(3).zip(&parts.alpha.data) {
            if *alpha > 0.5 && color.iter().all(|v| v.is_finite()) {
                let color = glam::Vec3::from_slice(color);
                luminances.push(luminance_f64(color.as_dvec3()));
                largest.push(f64::from(color.max_element()));
            }
        }
    }
    largest.sort_by(f64::total_cmp);
    let bright = *largest.get(((1.0 - CLIPPING) * largest.len() as f64) as usize)?;
    let average = luminances.iter().sum::<f64>() / luminances.len() as f64;
    // Shadows without any light must not decide: a thousandth of the average is black.
    let black = 1e-3 * average;
    let logs = luminances.iter().map(|l| (l.max(0.0) + black).ln()).sum::<f64>();
    let mean = (logs / luminances.len() as f64).exp();
    (mean > 0.0 && mean.is_finite()).then_some(Reading { mean, bright })
}

/// Photo value of radiance 1 so that what reads `new` is exposed as what reads `own` was. `ev` is EV at ISO 100 of the new light
/// where it is known.
pub(crate) fn exposure(own: &Reading, new: &Reading, ev: Option<f64>) -> f64 {
    let stops = ev.map_or(0.0, darkening);
    let keyed = own.mean / new.mean * stops.exp2();
    let unclipped = 1.0 / new.bright;
    if keyed <= unclipped { keyed } else { unclipped.max(keyed * (-MAX_HIGHLIGHT_STOPS).exp2()) }
}

/// Stops, 0 or less, by which a picture under light of this EV is darker than in daylight.
pub(crate) fn darkening(ev: f64) -> f64 {
    -(ADAPTATION * (DAYLIGHT_EV - ev)).clamp(0.0, DARKEST)
}

/// EV at ISO 100 of an incident light meter (C = 250 lx s).
pub(crate) fn ev_of_illuminance(lux: f64) -> f64 {
    (lux * 100.0 / 250.0).log2()
}

/// EV at ISO 100 that a camera is set to when linear value 1 is `luminance` cd / m² (ISO 12232: 78 / (0.65 · 100) of the saturating exposure).
pub(crate) fn ev_of_white(luminance: f64) -> f64 {
    (luminance / 1.2).log2()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_keyed_to_the_photos_and_dusk_stays_darker() {
        let own = Reading { mean: 0.2, bright: 0.7 };
        let noon = exposure(&own, &Reading { mean: 400.0, bright: 1000.0 }, Some(15.2));
        assert!((noon - 0.2 / 400.0).abs() < 1e-12);
        let dusk = exposure(&own, &Reading { mean: 4.0, bright: 10.0 }, Some(10.0));
        assert!((dusk * 4.0 / 0.2 - 0.5).abs() < 1e-12, "one stop darker at EV 10");
        assert_eq!(darkening(-30.0), -2.0);
        // Without lux there is no dusk.
        assert!((exposure(&own, &Reading { mean: 4.0, bright: 10.0 }, None) - 0.05).abs() < 1e-12);
    }

    #[test]
    fn highlights_are_kept_but_not_at_any_price() {
        let own = Reading { mean: 0.2, bright: 0.7 };
        let sun = exposure(&own, &Reading { mean: 1.0, bright: 8.0 }, None);
        assert!((sun - 0.125).abs() < 1e-12, "two thirds of a stop for the highlights");
        let glint = exposure(&own, &Reading { mean: 1.0, bright: 1000.0 }, None);
        assert!((glint - 0.1).abs() < 1e-12, "one stop at most");
    }

    #[test]
    fn full_sun_is_ev_fifteen() {
        assert!((ev_of_illuminance(82_000.0) - 15.0).abs() < 0.01);
        // Sunny 16: f/16 at 1/100 s is EV 14.6; white in the sun is 0.9 / π of 100 klx.
        assert!((ev_of_white(100_000.0 * 0.9 / std::f64::consts::PI) - 14.55).abs() < 0.1);
    }
}
