//! Ratio relighting: the captured colors times a smooth ratio of light, for what a decomposition is not sure of.
//!
//! ```text
//! E_i(L)    radiance of a white matte Gaussian i under L, with shadows; normals smoothed where they are not sure
//! v_i       = 1 / (1 + (log (E_i(L') / E'_i(L')) / 0.35)⁴)          E': without the shadows of what the photos speak against
//! g_i       = log (E_i(L') + ε' Ē') - log (E_i(L) + ε Ē)           Ē: mean over the Gaussians, ε: light from all around
//! x         = argmin Σ a_i |x_i - g_i|² + Σ w_ij |x_i - x_j|²       a grows with the confidence c_i v_i
//! u_i       = log (U(L', n_i) + ε' Ē') - log (U(L, n_i) + ε Ē)     U: radiance of white matter with nothing around it
//! r_i       = m_i + R_i tanh((x_i - m_i) / R_i) - (1 - a⁸) l_i      m = u + median(x - u); R_i: the range that c_i v_i allows
//! l_i       = local light + smoothed residual
//! shown     = w model + (1 - w) captured exp(r)
//! w_i       = (1 - a⁸) v_i / (1 + (k / (1 - k) (1 - c_i) / c_i (1 - 0.7 metallic))⁴)    k: caution; a: likeness of the two lights
//! ```
//!
//! What was captured of a lamp is its light, not its color. Where it is switched off, matte matter of [`LAMP_BASE_COLOR`] under the new
//! light takes its place. Where the model is brighter, a low `w` gets lower (`believed`).
//!
//! The ratio of two lights is smooth where texture, wrong normals and wrong materials are not, and it is 1 under the scene's
//! own light: there the picture is the splat itself (Liu, Shan & Zhang 2001; the quotient image of Riklin-Raviv & Shashua 2001).

mod captured;
mod received;

use std::borrow::Cow;

use glam::Vec3;
use motes_math::falloff::quartic_falloff;
use motes_math::luminance::luminance;
use motes_math::median::median;
use motes_math::sh::{MAX_SH_DEGREE, SH_C0, sh_coefficients};
use motes_math::srgb;
use motes_scene::{Gaussians, LAMP_BASE_COLOR};
use motes_shading::environment::{Environment, irradiance};
use rayon::prelude::*;

use crate::captured_light::CapturedLight;
use crate::graph::Graph;
use crate::lamps::Lights;
use crate::log_layer;
use crate::scene::RelightScene;
use captured::{alike, captured_light};
use received::floor;

/// Jacobi steps; information travels one neighbor each.
const ROUNDS: u32 = 32;
/// Anchor of a value nobody is sure of, and of one that is sure; weights of neighbors are at most 1.
const ANCHOR: [f32; 2] = [0.5, 8.0];
/// Largest distance of the log ratio from that of open ground where nothing is sure, and where all is: 1 and 2 stops.
const RANGE: [f32; 2] = [0.7, 1.39];
/// Power of the likeness of two lights: 0.9 counts as 0.43, 0.5 as nothing.
const LIKENESS_POWER: i32 = 8;
/// Natural logarithm of the model over the ratio at which a model that has hardly any share loses half of it.
const SURPLUS: f32 = 0.35;
/// Linear value of a photo below which ratios are noise.
const LEAST_RADIANCE: f32 = 1e-4;
/// Doubt about a metal, over that about other matter: light on white matte matter says next to nothing of a mirror, and what was captured
/// of it is another light's picture.
const METAL: f32 = 0.3;

/// How far the light on a lamp that is off is that of each of its Gaussians alone.
const LAMP_ANCHOR: f32 = 0.1;

/// How a ratio is found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RatioOptions {
    /// 0 (the model everywhere) to 1 (the captured colors).
    pub(crate) caution: f32,
    /// Directions per Gaussian to the new light.
    pub(crate) samples: u32,
    /// The same to that of the photos, which all lights share.
    pub(crate) samples_of_captured: u32,
    pub(crate) seed: u64,
}

/// A scene's captured colors, and what they are multiplied with under a light.
#[derive(Debug)]
pub(crate) struct Ratio {
    /// Median of the log ratio.
    common: Vec3,
    /// Log ratio over the common one, of every Gaussian.
    log_ratio: Vec<Vec3>,
    /// Colors that stand for it.
    pub(crate) splats: Gaussians,
    /// Share of the model in what is shown, of every Gaussian.
    pub(crate) model_share: Vec<f32>,
    /// Gaussians of lamps that are off, ascending, and the linear colors that take the place of what was captured.
    lamps: Vec<(u32, Vec3)>,
}

impl Ratio {
    /// Of `scene` between its own light and `light`, with which lamps of the Gaussians `off` went out, each with one on its
    /// lamp; none where that light or the confidence is not known.
    pub(crate) fn new(
        scene: &RelightScene,
        light: &Lights<'_>,
        off: &[Option<u32>],
        likeness: f32,
        options: &RatioOptions,
    ) -> Option<Self> {
        let own = scene.own_environment.as_ref()?;
        let own = Lights { environment: own, lamps: scene.lamps.as_ref() };
        let is_black = |light: &Lights<'_>| light.environment.is_black() && light.lamps.is_none();
        if is_black(&own) || is_black(light) || scene.gaussians.is_empty() {
            return None;
        }
        let captured = captured_light(scene, &own, options.samples_of_captured, options.seed)?;
        let CapturedLight { graph, places, .. } = &*captured;
        let new = if light.is(&own) {
            Cow::Borrowed(&captured.lit)
        } else {
            Cow::Owned(received::lit(scene, light, places, options.samples, options.seed))
        };
        let floors = [&new, &captured.lit].map(|lit| floor(&lit.radiance));
        let raw = log_ratios([&new.radiance, &captured.lit.radiance], floors);
        let trust = captured.trust.where_agreed(&new.agreed);
        let anchor = |i: usize| mix(ANCHOR, trust.confidence[i].powi(2));
        let smooth = graph.smoothed(&raw, &anchor, &alike(places, &trust.area), ROUNDS);
        let different = 1.0 - likeness_share(likeness);
        let of_lamps = captured.of_lamps.as_deref().filter(|_| light.lamps.is_some());
        let open = unshadowed(light.environment, places, of_lamps);
        let open = log_ratios([&open, &captured.open], floors);
        let offset = medians(smooth.iter().zip(&open).map(|(v, open)| *v - *open));
        let common = medians(smooth.iter().copied());
        let limited = smooth.iter().zip(&open).enumerate().map(|(i, (v, open))| {
            let range = mix(RANGE, trust.confidence[i]);
            let middle = *open + offset;
            let limited = middle + (*v - middle).map(|v| range * (v / range).tanh());
            let is_off = off.get(i).is_some_and(Option::is_some);
            if is_off { Vec3::ZERO } else { limited - common - captured.log_own[i] * different }
        });
        let log_ratio: Vec<Vec3> = limited.collect();
        let splats = log_layer::drawn(&log_ratio, &scene.gaussians);
        let model_share = model_share(scene, graph, &trust.area, &new.agreed, options.caution)
            .into_iter()
            .map(|share| share * different)
            .collect();
        let lamps = if off.iter().any(Option::is_some) {
            let lit =
                graph.smoothed(&new.radiance, &|_| LAMP_ANCHOR, &|_, j| trust.area[j], ROUNDS);
            let unlit =
                |on_lamp: u32| LAMP_BASE_COLOR * lit[on_lamp as usize] / common.map(f32::exp);
            let off = (0u32..).zip(off).filter_map(|(i, on_lamp)| Some((i, unlit((*on_lamp)?))));
            off.filter(|(_, color)| color.is_finite()).collect()
        } else {
            Vec::new()
        };
        Some(Self { common, log_ratio, splats, model_share, lamps })
    }

    /// The captured colors, those of lamps that are off replaced.
    pub(crate) fn captured<'a>(&self, gaussians: &'a Gaussians) -> Cow<'a, Gaussians> {
        if self.lamps.is_empty() {
            return Cow::Borrowed(gaussians);
        }
        let mut unlit = gaussians.clone();
        let row = 3 * sh_coefficients(gaussians.sh_degree);
        for &(i, color) in &self.lamps {
            let sh = &mut unlit.sh[row * i as usize..][..row];
            sh.fill(0.0);
            let encoded = color.map(|v| (srgb::encode(v.max(0.0)) - 0.5) / SH_C0 as f32);
            sh[..3].copy_from_slice(&encoded.to_array());
        }
        Cow::Owned(unlit)
    }

    /// Linear color of a pixel of which `coverage` is scene, from what the captured colors, the ratio and the alpha show
    /// there, all over black.
    pub(crate) fn pixel(&self, captured: Vec3, drawn: Vec3, alpha: f32, coverage: f32) -> Vec3 {
        let captured = (captured / coverage.max(1.0 / 255.0)).map(|v| srgb::decode(v.max(0.0)));
        captured * (log_layer::read(drawn, alpha) + self.common).map(f32::exp)
    }

    /// What is left of the model's share where it is brighter than the captured colors times the ratio: the less of it
    /// there is, the less surplus is believed. Light that a torn surface catches, or a base color that a deep shadow was
    /// divided out of, is burnt; a surface that is sure may shine.
    pub(crate) fn believed(&self, share: f32, model: Vec3, shown: Vec3) -> f32 {
        let least = LEAST_RADIANCE * luminance(self.common.map(f32::exp));
        believed(share, luminance(model), luminance(shown), least)
    }

    /// Linear color of a Gaussian, from the basis of the direction of view.
    pub(crate) fn color(&self, scene: &RelightScene, i: usize, basis: &[f32; 25]) -> Vec3 {
        let k = sh_coefficients(scene.gaussians.sh_degree.min(MAX_SH_DEGREE));
        let row = &scene.gaussians.sh[3 * k * i..3 * k * (i + 1)];
        let mut color = Vec3::splat(0.5);
        for (y, v) in basis.iter().zip(row.chunks_exact(3)) {
            color += *y * Vec3::from_slice(v);
        }
        let ratio = (self.log_ratio[i] + self.common).map(f32::exp);
        match self.lamps.binary_search_by_key(&(i as u32), |(i, _)| *i) {
            Ok(lamp) => self.lamps[lamp].1 * ratio,
            Err(_) => color.map(|v| srgb::decode(v.max(0.0))) * ratio,
        }
    }
}

/// How far a light counts as the scene's own, from how much it is like it.
pub(crate) fn likeness_share(likeness: f32) -> f32 {
    likeness.powi(LIKENESS_POWER)
}

/// [`Ratio::believed`], of luminances; below `least` ratios are noise.
fn believed(share: f32, model: f32, shown: f32, least: f32) -> f32 {
    let floor = 0.1 * shown + least;
    // `max` first: it turns NaN into 0.
    let surplus = ((model + floor) / (shown + floor)).ln().max(0.0).clamp(0.0, 20.0);
    quartic_falloff(share, surplus * (1.0 - share).powi(2), SURPLUS)
}

fn mix([low, high]: [f32; 2], t: f32) -> f32 {
    low + (high - low) * t
}

/// Share of the model in what is shown under a light that is nothing like the scene's own, of every Gaussian.
fn model_share(
    scene: &RelightScene,
    graph: &Graph,
    area: &[f32],
    agreed: &[f32],
    caution: f32,
) -> Vec<f32> {
    let doubt = caution / (1.0 - caution).max(1e-6);
    let share = |c: f32, metallic: f32| {
        // Nothing is so sure that all caution would leave it.
        let odds = (1.0 - c).max(1e-3) / c.max(1e-3);
        let against = doubt * odds * mix([1.0, METAL], metallic.clamp(0.0, 1.0));
        // At confidence 0.68 and caution 0.5 the model has 95 %, at 0.32 5 %.
        quartic_falloff(1.0, against, 1.0)
    };
    // Beside a disputed shadow its rim shows.
    let agreed = graph.eroded(agreed);
    let known = |(i, c): (usize, &f32)| Vec3::new(*c, agreed.get(i).copied().unwrap_or(1.0), 0.0);
    let confidence = scene.confidence.iter().flatten();
    let known: Vec<Vec3> = confidence.enumerate().map(known).collect();
    // Single Gaussians are judged by few pixels.
    let known = graph.smoothed(&known, &|_| 1.0, &|_, j| area[j], ROUNDS / 8);
    known.iter().zip(&scene.materials.metallic).map(|(k, m)| share(k.x, *m) * k.y).collect()
}

/// Radiance of white matte Gaussians with nothing around them: of the environment from its harmonics, and what lamps add.
fn unshadowed(
    environment: &Environment,
    places: &[(Vec3, Vec3)],
    of_lamps: Option<&[Vec3]>,
) -> Vec<Vec3> {
    let harmonics = environment.harmonics();
    let of = |(i, (_, normal)): (usize, &(Vec3, Vec3))| {
        let radiance = irradiance(&harmonics, normal.as_dvec3()).as_vec3() / std::f32::consts::PI;
        // Harmonics of a sun ring: behind it they fall below 0.
        radiance.max(Vec3::ZERO) + of_lamps.map_or(Vec3::ZERO, |of_lamps| of_lamps[i])
    };
    places.par_iter().enumerate().with_min_len(1024).map(of).collect()
}

/// Log of new over own light, with light from all around on both sides.
fn log_ratios([new, own]: [&[Vec3]; 2], floors: [Vec3; 2]) -> Vec<Vec3> {
    let of = |(new, own): (&Vec3, &Vec3)| {
        let ratio = (*new + floors[0]) / (*own + floors[1]);
        if ratio.is_finite() { ratio.map(f32::ln) } else { Vec3::ZERO }
    };
    new.iter().zip(own).map(of).collect()
}

/// Median of each channel; 0 without values.
fn medians(values: impl Iterator<Item = Vec3> + Clone) -> Vec3 {
    let of = |c: usize| median(values.clone().map(|v| f64::from(v[c]))).unwrap_or(0.0) as f32;
    Vec3::from_array([0, 1, 2].map(of))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surplus_is_believed_as_far_as_the_model_is_sure_and_a_shadow_is_a_shadow() {
        let of = |share, model, shown| believed(share, model, shown, 1e-4);
        assert_eq!((of(0.4, 0.2, 0.2), of(0.4, 0.0, 0.2), of(1.0, 20.0, 0.2)), (0.4, 0.4, 1.0));
        assert_eq!([f32::INFINITY, f32::NAN].map(|model| of(1.0, model, 0.2)), [1.0; 2]);
        let left = |share: f32| of(share, 0.8, 0.2) / share;
        assert!(left(0.9) > 0.99 && left(0.05) < 0.15, "{} {}", left(0.9), left(0.05));
        assert!((1..20).all(|i| left(i as f32 * 0.05) >= left((i as f32 - 0.5) * 0.05)));
        // Nothing was captured here, and nothing is there to be divided by.
        let black = of(0.5, 0.2, 0.0);
        assert!((0.0..0.5).contains(&black), "{black}");
        // In the dark as in the light.
        let dark = believed(0.5, 4e-9, 1e-9, 1e-12);
        assert!((dark - believed(0.5, 4.0, 1.0, 1e-3)).abs() < 1e-6, "{dark}");
    }
}
