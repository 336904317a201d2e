//! What the model left unexplained under the scene's own light, carried to another.
//!
//! A decomposed scene may hold a [`motes_scene::Residual`]: per Gaussian and direction of view the logarithm `ρ` of the photos over
//! the model. Light is transported linearly, so what the photos say of the own light `L`, they say of every multiple of it, and
//! the less of another light `L'` the less it resembles `L`. A picture is
//!
//! ```text
//! shown = M(L') exp(a ρ),   a = s + (1 - s) r²
//! ```
//!
//! `r` is the correlation of the two lights over directions (harmonics of degree 4, luminance; negative counts as 0) and `s` the
//! part that does not depend on light: errors of materials, of shapes, of ambient visibility. Under the own light `a` is 1.

use std::str::FromStr;

use glam::{DVec3, Vec3};
use motes_math::luminance::luminance_f64;
use motes_scene::Residual;
use motes_shading::environment::{Environment, Harmonics};
use rayon::prelude::*;
use serde::{Serialize, Serializer};

use crate::deferred::Lit;
use crate::g_buffer::{GBuffer, Sight};
use crate::scene::RelightScene;

/// Share of the mean light in the correlation: two lights without direction are alike.
const MEAN: f64 = 0.05;

/// How far what the model left unexplained is carried to a light that has nothing of the own one, 0 to 1; or off: not even under
/// the own light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResidualShare(Option<f32>);

impl Default for ResidualShare {
    fn default() -> Self {
        Self(Some(0.5))
    }
}

impl ResidualShare {
    /// No residual under any light.
    pub const OFF: Self = Self(None);

    /// The share under a light that is known to be another, 0 when off.
    pub fn under_another_light(self) -> f32 {
        self.0.unwrap_or(0.0)
    }

    /// The share under a light whose harmonics correlate by `r` with the own light's.
    fn under(self, r: f32) -> f32 {
        self.0.map_or(0.0, |share| share + (1.0 - share) * r * r)
    }
}

impl FromStr for ResidualShare {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "off" {
            return Ok(Self::OFF);
        }
        let share = text.parse().ok().filter(|s| (0.0..=1.0).contains(s));
        share.map(|s| Self(Some(s))).ok_or_else(|| "expected a number from 0 to 1, or off".into())
    }
}

impl Serialize for ResidualShare {
    /// As the flag takes it.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Some(share) => serializer.serialize_f32(share),
            None => serializer.serialize_str("off"),
        }
    }
}

/// Correlation of two lights over directions, 0 to 1.
pub(crate) fn alike(a: &Harmonics, b: &Harmonics) -> f32 {
    let luminance = |e: &DVec3| luminance_f64(*e);
    let product = |a: &Harmonics, b: &Harmonics| -> f64 {
        let bands = a.iter().zip(b).enumerate();
        bands
            .map(|(k, (a, b))| luminance(a) * luminance(b) * if k == 0 { MEAN * MEAN } else { 1.0 })
            .sum()
    };
    let r = product(a, b) / (product(a, a) * product(b, b)).sqrt();
    // `max` first: it turns the NaN of a black light into 0.
    r.max(0.0).clamp(0.0, 1.0) as f32
}

/// How alike a light is to the scene's own, 0 to 1; none where that is not known.
pub(crate) fn likeness(scene: &RelightScene, light: &Environment) -> Option<f32> {
    scene.own_light.as_ref().map(|own| alike(own, &light.harmonics()))
}

/// How much of a scene's residual counts under a light that is so much like its own, 0 to 1; 0 where the scene has none. A scene
/// whose own light is not known is taken to be under another.
pub(crate) fn share_under(
    scene: &RelightScene,
    likeness: Option<f32>,
    share: ResidualShare,
) -> f32 {
    match (&scene.residual, likeness) {
        (None, _) => 0.0,
        (Some(_), Some(likeness)) if share != ResidualShare::OFF => share.under(likeness),
        (Some(_), _) => share.under_another_light(),
    }
}

/// Puts the share of the residual on the light of a view's pixels, but for lamps that are `off`: what it says there is about their light.
pub(crate) fn apply_residual(
    buffer: &GBuffer,
    share: f32,
    off: impl Fn(&Sight) -> bool + Sync,
    lit: &mut [Lit],
) {
    let Some(drawn) = &buffer.residual else { return };
    lit.par_iter_mut().enumerate().with_min_len(1024).for_each(|(i, lit)| {
        if buffer.sight[i].as_ref().is_some_and(&off) {
            return;
        }
        let alpha = drawn.alpha.data[i];
        let factor = Vec3::from_slice(&drawn.color.data[3 * i..3 * i + 3])
            .map(|v| (share * Residual::log_ratio(v, alpha)).exp());
        lit.parts = lit.parts.scaled(factor);
    });
}

#[cfg(test)]
mod tests {
    use motes_scene::ImageF32;
    use motes_shading::environment::{EnvironmentMap, MapOptions};

    use super::*;

    fn light(radiance: impl Fn(usize, usize) -> f32) -> Harmonics {
        let mut image = ImageF32::filled(32, 16, 3, 0.0);
        for y in 0..16 {
            for x in 0..32 {
                image.pixel_mut(x, y).fill(radiance(x, y));
            }
        }
        let map = EnvironmentMap::new(&image, &MapOptions::default()).unwrap();
        Environment::new(Some(map), None).harmonics()
    }

    #[test]
    fn lights_are_alike_whatever_their_exposure_and_unlike_from_other_sides() {
        let lamp = |at: usize| {
            let within = move |x: usize, y: usize| (at..at + 4).contains(&x) && y / 4 == 1;
            light(move |x, y| if within(x, y) { 9.0 } else { 0.1 })
        };
        let (left, even, black) = (lamp(4), light(|_, _| 0.3), light(|_, _| 0.0));
        assert!(alike(&left, &left) > 0.999_99);
        assert!(alike(&left, &left.map(|e| 40.0 * e)) > 0.999_99);
        // 11, 45 and 180 degrees apart.
        let [near, aside, across] = [5, 8, 20].map(|at| alike(&left, &lamp(at)));
        assert!(
            near > 0.8 && near < 0.99 && aside < 0.4 && across < 0.3,
            "{near} {aside} {across}"
        );
        assert!(alike(&even, &light(|_, _| 2.0)) > 0.999_99, "neither has a direction");
        assert!(alike(&even, &left) < 0.2, "{}", alike(&even, &left));
        assert_eq!(alike(&black, &left), 0.0);
        assert_eq!(alike(&black, &black), 0.0);
    }

    #[test]
    fn shares_are_read_and_written_alike() {
        let share: ResidualShare = "0.25".parse().unwrap();
        assert_eq!((share.under_another_light(), share.under(1.0)), (0.25, 1.0));
        assert_eq!("off".parse(), Ok(ResidualShare::OFF));
        assert_eq!(
            (ResidualShare::OFF.under(1.0), ResidualShare::OFF.under_another_light()),
            (0.0, 0.0)
        );
        for bad in ["", "-0.1", "1.1", "NaN", "on"] {
            assert!(bad.parse::<ResidualShare>().is_err(), "{bad}");
        }
    }
}
