//! A whole sky from the part of it that photos show.
//!
//! Clear skies of Hosek & Wilkie 2012 with the sun anywhere, and the overcast sky of the CIE, each with a factor per channel (exposure and
//! white balance of the camera), are compared with what is seen. What is expected of the rest is the mean of all of them, weighed by
//! how well they explain what is seen: a strip above the horizon does not tell them apart, and should not choose one.

use glam::{BVec3, DVec3, Vec3};
use motes_shading::environment::{OvercastSky, SkyRadiance, SunSky};
use rayon::prelude::*;

/// Steps of the sun's azimuth.
const AZIMUTHS: usize = 24;
/// Elevations of the sun, degrees, and turbidities.
const ELEVATIONS: [f64; 8] = [4.0, 10.0, 18.0, 28.0, 38.0, 48.0, 60.0, 75.0];
const TURBIDITIES: [f64; 4] = [2.0, 3.0, 5.0, 8.0];
/// Mean difference from what is seen, natural logarithm, beyond the least one at which a sky counts `1 / e`.
const WORSE: f32 = 0.02;
/// Least weight of a sky that is used.
const LEAST: f32 = 1e-2;

/// A kind of sky; directions have y up.
enum Kind {
    Clear(SkyRadiance),
    Overcast,
}

impl Kind {
    fn log(&self, d: DVec3) -> Vec3 {
        match self {
            Self::Clear(sky) => sky.at(d).max(Vec3::splat(1e-6)).map(f32::ln),
            Self::Overcast => Vec3::splat((OvercastSky::over_horizon(d.y) as f32).ln()),
        }
    }
}

/// One direction of the sky, as photos show it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// Unit, y up, above the horizon.
    pub direction: DVec3,
    /// Natural logarithm, photo units.
    pub log_radiance: Vec3,
    /// Channels in which the sky may be brighter.
    pub is_clipped: BVec3,
}

/// 1 in channels that are not clipped, 0 in the others.
pub(super) fn open(is_clipped: BVec3) -> Vec3 {
    Vec3::select(is_clipped, Vec3::ZERO, Vec3::ONE)
}

/// Skies that explain what is seen: each with its weight and the logarithm of its factor.
pub(super) struct SkyDome {
    skies: Vec<(f32, Vec3, Kind)>,
}

impl SkyDome {
    /// Fits what is seen.
    pub(super) fn fit(seen: &[Seen]) -> Self {
        let clear = (0..AZIMUTHS).flat_map(|k| {
            let azimuth_deg = 360.0 * k as f64 / AZIMUTHS as f64;
            ELEVATIONS.into_iter().flat_map(move |elevation_deg| {
                TURBIDITIES.into_iter().filter_map(move |turbidity| {
                    let sky = SunSky { azimuth_deg, elevation_deg, turbidity, ..SunSky::default() };
                    Some(Kind::Clear(sky.radiance().ok()?))
                })
            })
        });
        let all: Vec<Kind> = clear.chain([Kind::Overcast]).collect();
        let mut skies: Vec<(f32, Vec3, Kind)> = all
            .into_par_iter()
            .map(|kind| {
                let (factor, cost) = compare(&kind, seen);
                (cost, factor, kind)
            })
            .collect();
        let least = skies.iter().map(|(cost, ..)| *cost).fold(f32::INFINITY, f32::min);
        skies.iter_mut().for_each(|(cost, ..)| *cost = ((least - *cost) / WORSE).exp());
        skies.retain(|(weight, ..)| *weight > LEAST);
        Self { skies }
    }

    /// Logarithm of the radiance in a direction above the horizon; none where nothing was seen.
    pub(super) fn log_radiance(&self, d: DVec3) -> Option<Vec3> {
        let add = |(sum, total): (Vec3, f32), (weight, factor, kind): &(f32, Vec3, Kind)| {
            (sum + (kind.log(d) + *factor) * *weight, total + weight)
        };
        let (sum, total) = self.skies.iter().fold((Vec3::ZERO, 0.0), add);
        (total > 0.0).then(|| sum / total)
    }
}

/// Logarithm of the factor that takes a sky to what is seen, and the mean difference then: one of what is clipped counts where the sky
/// is darker. A channel that is clipped all over has the factor of the others, unless more is seen.
fn compare(kind: &Kind, seen: &[Seen]) -> (Vec3, f32) {
    let of = |texel: &Seen| (texel.log_radiance - kind.log(texel.direction), texel.is_clipped);
    let off: Vec<(Vec3, BVec3)> = seen.iter().map(of).collect();
    let (mut sum, mut all, mut count) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
    for (off, is_clipped) in &off {
        let open = open(*is_clipped);
        (sum, all, count) = (sum + open * *off, all + *off, count + open);
    }
    let n = seen.len().max(1) as f32;
    let (mean, least) = (sum / count.max(Vec3::ONE), all / n);
    let is_open = count.cmpgt(Vec3::ZERO);
    let channels = is_open.bitmask().count_ones();
    let of_others = Vec3::select(is_open, mean, Vec3::ZERO).element_sum() / channels as f32;
    let of_clipped = if channels > 0 { least.max(Vec3::splat(of_others)) } else { least };
    let factor = Vec3::select(is_open, mean, of_clipped);
    let cost = |(off, is_clipped): &(Vec3, BVec3)| {
        let more = *off - factor;
        Vec3::select(*is_clipped, more.max(Vec3::ZERO), more.abs()).element_sum() / 3.0
    };
    (factor, off.iter().map(cost).sum::<f32>() / n)
}

#[cfg(test)]
mod tests {
    use motes_shading::environment::direction_from_uv;

    use super::*;

    /// Directions of a strip above the horizon, a third of the way round, with what a sky shows there.
    fn strip(of: impl Fn(DVec3) -> Vec3) -> Vec<Seen> {
        let places = (0..20).flat_map(|i| (0..8).map(move |j| (i, j)));
        let directions = places
            .map(|(i, j)| direction_from_uv(0.3 + f64::from(i) / 60.0, 0.49 - f64::from(j) / 64.0));
        let seen = |d| Seen { direction: d, log_radiance: of(d), is_clipped: BVec3::FALSE };
        directions.map(seen).collect()
    }

    fn off(seen: &[Seen], d: DVec3, truth: Vec3) -> f32 {
        let found = SkyDome::fit(seen).log_radiance(d).unwrap();
        (found - truth).abs().max_element()
    }

    #[test]
    fn the_zenith_of_a_clear_sky_follows_from_a_strip_above_the_horizon() {
        // The sun and the haze are none of those tried, and the camera is warm.
        let sky =
            SunSky { azimuth_deg: 52.0, elevation_deg: 33.0, turbidity: 3.6, ..SunSky::default() };
        let sky = sky.radiance().unwrap();
        let shown = |d: DVec3| (sky.at(d) * Vec3::new(0.13, 0.1, 0.08)).map(f32::ln);
        let error = off(&strip(shown), DVec3::Y, shown(DVec3::Y));
        let horizon = shown(direction_from_uv(0.4, 0.48)) - shown(DVec3::Y);
        println!("zenith {error:.2} off; the horizon is {horizon:.2} brighter");
        assert!(error < 0.4 && horizon.max_element() > 1.0, "{error} {horizon}");
    }

    #[test]
    fn a_channel_that_is_clipped_tells_no_color() {
        let sky = SunSky { elevation_deg: 33.0, ..SunSky::default() };
        let sky = sky.radiance().unwrap();
        let shown = |d: DVec3| (sky.at(d) * 0.1).map(f32::ln);
        let mut seen = strip(shown);
        let most = seen.iter().map(|texel| texel.log_radiance.z).fold(f32::INFINITY, f32::min);
        for texel in &mut seen {
            texel.log_radiance.z = most;
            texel.is_clipped = BVec3::new(false, false, true);
        }
        let error = off(&seen, DVec3::Y, shown(DVec3::Y));
        println!("zenith {error:.2} off");
        assert!(error < 0.4, "{error}");
    }

    #[test]
    fn the_zenith_of_an_overcast_sky_is_brighter_than_what_is_seen() {
        let shown = |d: DVec3| Vec3::splat((0.2 * (1.0 + 2.0 * d.y as f32)).ln());
        let error = off(&strip(shown), DVec3::Y, shown(DVec3::Y));
        println!("zenith {error:.2} off");
        assert!(error < 0.4, "{error}");
    }

    #[test]
    fn nothing_seen_tells_nothing_much() {
        let found = SkyDome::fit(&[]).log_radiance(DVec3::Y);
        assert!(found.is_some_and(|log| log.is_finite()), "{found:?}");
    }
}
