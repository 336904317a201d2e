//! The parameters of relighting, as flags.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, ValueEnum};
use glam::DVec3;
use motes_scene::{Convention, Switch};
use motes_shading::environment::MapAxes;
use serde::{Deserialize, Serialize};

use crate::residual_share::ResidualShare;
use crate::sun::SunOption;

/// Which light falls on the scene; none of these: the scene's own.
#[derive(Args, Clone, Debug, Default, Serialize)]
#[command(next_help_heading = "Light")]
pub struct LightOptions {
    /// Lat-long environment map (.exr, .hdr), linear [default: the capture illumination]
    #[arg(long, value_name = "FILE", conflicts_with = "sun")]
    pub environment: Option<PathBuf>,

    /// Axes of the map [default: openexr]
    #[arg(long, value_enum, value_name = "CONVENTION", requires = "environment")]
    pub env_convention: Option<Convention>,

    /// Where the zenith of the light is: scene (the up of the scene), map (the up axis of the
    /// convention, no axis moves), an axis of the world (z, -y, ...) or a vector X,Y,Z
    #[arg(long, value_name = "UP", default_value = "scene", allow_hyphen_values = true)]
    pub env_up: EnvUp,

    /// Heading: turn the light about its up by this many degrees, counter-clockwise seen from above
    #[arg(long, visible_alias = "env-heading", value_name = "DEG", default_value_t = 0.0,
        allow_negative_numbers = true, value_parser = parse_degrees)]
    pub env_rotate: f64,

    /// Factor on the light: a number; auto: metered in the pictures; ground: a white sheet on the
    /// ground as bright as under the capture illumination [default: 1 for maps, auto for the sun]
    #[arg(long, value_name = "FACTOR")]
    pub env_exposure: Option<Exposure>,

    /// Stops on top of the exposure: 1 is twice as bright, -1 half
    #[arg(long, visible_alias = "ev", value_name = "STOPS", default_value_t = 0.0,
        allow_negative_numbers = true, value_parser = parse_stops)]
    pub exposure_compensation: f64,

    /// The sun: sunrise, morning, noon, afternoon, golden-hour, sunset, overcast, studio;
    /// azimuth=DEG,elevation=DEG; or latitude=DEG,longitude=DEG,date=YYYY-MM-DD,time=HH:MM+HH:MM
    #[arg(long, value_name = "HOUR|KEY=VALUE,...")]
    pub sun: Option<SunOption>,

    /// The sky around the sun, too; hours with a name and dates have it
    #[arg(long, requires = "sun")]
    pub sky: bool,
}

/// Where the zenith of a light is in the world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum EnvUp {
    /// The up of the scene.
    #[default]
    Scene,
    /// The up axis of the map's convention; z for a sky.
    Map,
    /// A unit vector.
    Direction(DVec3),
}

impl EnvUp {
    /// The axes of a map over a scene with `up_in_world`.
    pub fn axes(self, convention: Convention, up_in_world: DVec3) -> MapAxes {
        match self {
            Self::Scene => MapAxes::upright(convention, up_in_world),
            Self::Map => MapAxes::of_world(convention),
            Self::Direction(zenith_in_world) => MapAxes { convention, zenith_in_world },
        }
    }

    /// The zenith of a sky over a scene with `up_in_world`.
    pub fn zenith(self, up_in_world: DVec3) -> DVec3 {
        match self {
            Self::Scene => up_in_world,
            Self::Map => DVec3::Z,
            Self::Direction(zenith) => zenith,
        }
    }
}

impl FromStr for EnvUp {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (sign, axis) = match text.strip_prefix('-') {
            Some(rest) => (-1.0, rest),
            None => (1.0, text.strip_prefix('+').unwrap_or(text)),
        };
        Ok(match axis {
            "scene" if axis == text => Self::Scene,
            "map" if axis == text => Self::Map,
            "x" => Self::Direction(DVec3::X * sign),
            "y" => Self::Direction(DVec3::Y * sign),
            "z" => Self::Direction(DVec3::Z * sign),
            _ => {
                let numbers: Option<Vec<f64>> =
                    text.split(',').map(|part| part.trim().parse().ok()).collect();
                let up = match numbers.as_deref() {
                    Some(&[x, y, z]) => DVec3::new(x, y, z).try_normalize(),
                    _ => None,
                };
                let up = up.filter(|up| up.is_finite());
                Self::Direction(up.ok_or("expected scene, map, an axis (z, -y) or X,Y,Z, not 0")?)
            }
        })
    }
}

impl Serialize for EnvUp {
    /// As the flag takes it.
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Scene => serializer.serialize_str("scene"),
            Self::Map => serializer.serialize_str("map"),
            Self::Direction(up) => {
                serializer.collect_str(&format_args!("{},{},{}", up.x, up.y, up.z))
            }
        }
    }
}

/// Factor on the light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Exposure {
    /// Metered in the pictures; where there are none, as `Ground`.
    Auto,
    /// A white sheet on the ground is as bright as under the capture illumination.
    Ground,
    /// Linear photo value of radiance 1.
    #[serde(untagged)]
    Factor(f32),
}

impl FromStr for Exposure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        if text == "ground" {
            return Ok(Self::Ground);
        }
        let factor = text.parse().ok().filter(|f: &f32| *f > 0.0 && f.is_finite());
        factor.map(Self::Factor).ok_or_else(|| "expected a number above 0, auto or ground".into())
    }
}

fn parse_stops(text: &str) -> Result<f64, String> {
    let stops = text.parse().ok().filter(|s: &f64| s.abs() <= 30.0);
    stops.ok_or_else(|| "expected a number of stops from -30 to 30".into())
}

fn parse_degrees(text: &str) -> Result<f64, String> {
    let degrees = text.parse().ok().filter(|d: &f64| d.is_finite());
    degrees.ok_or_else(|| "expected a number of degrees".into())
}

/// Time against noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quality {
    /// Every third pixel in both directions, denoised and interpolated
    Preview,
    /// Every pixel, denoised
    #[default]
    Standard,
    /// Every pixel with many samples, without denoising
    Reference,
}

/// How linear light becomes a picture for people.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ViewTransform {
    /// Clipped at 1, then as the photos show light: sRGB-encoded, with the tone curve of the camera where the decomposition
    /// found one
    #[default]
    Standard,
    /// Clipped at 1, sRGB-encoded
    Srgb,
    /// A film-like curve after AgX: highlights roll off to white instead of clipping
    Agx,
}

/// Confidence counts as it is: docs/benchmarks/relight.md has the curve.
const DEFAULT_CAUTION: f32 = 0.25;

/// How light is computed. Parameters that are not given follow the quality.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Quality")]
pub struct QualityOptions {
    /// Trade-off between time and noise; sets the parameters of sampling
    #[arg(long, value_enum, value_name = "QUALITY", default_value_t)]
    pub quality: Quality,

    /// Light samples per pixel, 1 to 65536
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536), help_heading = "Sampling (expert)")]
    pub light_samples: Option<u32>,

    /// BRDF samples per pixel, 0 to 65536
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=65_536), help_heading = "Sampling (expert)")]
    pub brdf_samples: Option<u32>,

    /// Bounces of indirect light, 0 to 8 [default: 2 where the scene has indirect light, else 0]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=8), help_heading = "Sampling (expert)")]
    pub bounces: Option<u32>,

    /// Vertices closer than this many median edge lengths share their indirect light, 0 (no
    /// sharing) to 16 [default: 3 for preview, else 0]
    #[arg(long, value_name = "EDGES", value_parser = parse_spacing, help_heading = "Sampling (expert)")]
    pub light_spacing: Option<f32>,

    /// Strength of the denoiser of direct and indirect light, 0 (off) to 10
    #[arg(long, value_name = "STRENGTH", value_parser = parse_strength, help_heading = "Sampling (expert)")]
    pub denoise: Option<f32>,

    /// How much of the appearance residual to apply under a new light, 0 to 1, or off; it fades
    /// with the difference from the capture illumination
    #[arg(long, value_name = "SHARE", default_value = "0.5")]
    pub residual: ResidualShare,

    /// What is shown where the decomposition is not sure: 0 its model everywhere, 1 the captured
    /// colors times a smooth ratio of light
    #[arg(long, value_name = "SHARE", default_value_t = DEFAULT_CAUTION, value_parser = parse_caution)]
    pub caution: f32,

    /// Whether lamps that shine in the photos shine; auto: under the capture illumination
    #[arg(long, value_enum, default_value_t = Switch::Auto, value_name = "SWITCH")]
    pub lamps: Switch,

    /// Shade every Nth pixel in both directions and interpolate, 1 to 8
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=8), help_heading = "Sampling (expert)")]
    pub shade_every: Option<u32>,
}

impl Default for QualityOptions {
    fn default() -> Self {
        Self {
            quality: Quality::default(),
            light_samples: None,
            brdf_samples: None,
            bounces: None,
            light_spacing: None,
            denoise: None,
            residual: ResidualShare::default(),
            caution: DEFAULT_CAUTION,
            lamps: Switch::Auto,
            shade_every: None,
        }
    }
}

fn parse_caution(text: &str) -> Result<f32, String> {
    let caution = text.parse().ok().filter(|c| (0.0..=1.0).contains(c));
    caution.ok_or_else(|| "expected a number from 0 to 1".into())
}

fn parse_strength(text: &str) -> Result<f32, String> {
    let strength = text.parse().ok().filter(|s| (0.0..=10.0).contains(s));
    strength.ok_or_else(|| "expected a number from 0 to 10".into())
}

fn parse_spacing(text: &str) -> Result<f32, String> {
    let spacing = text.parse().ok().filter(|s| (0.0..=16.0).contains(s));
    spacing.ok_or_else(|| "expected a number from 0 to 16".into())
}

impl QualityOptions {
    /// The parameters of a quality.
    pub fn of(quality: Quality) -> Self {
        Self { quality, ..Self::default() }
    }

    /// Directions from the light and from the lobes.
    pub fn samples(&self) -> (u32, u32) {
        let (light, brdf) = match self.quality {
            Quality::Preview => (8, 4),
            Quality::Standard => (16, 8),
            Quality::Reference => (512, 128),
        };
        (self.light_samples.unwrap_or(light), self.brdf_samples.unwrap_or(brdf))
    }

    /// Whether nothing of the photos but the decomposition is shown.
    pub(crate) fn shows_model_alone(&self) -> bool {
        self.residual == ResidualShare::OFF || !(self.caution > 0.0)
    }

    /// Strength of the filter.
    pub fn denoise_strength(&self) -> f32 {
        self.denoise.unwrap_or(match self.quality {
            Quality::Preview | Quality::Standard => 4.0,
            Quality::Reference => 0.0,
        })
    }

    /// One in this many pixels, per direction.
    pub fn shade_every(&self) -> usize {
        let n = if self.quality == Quality::Preview { 3 } else { 1 };
        self.shade_every.unwrap_or(n) as usize
    }

    /// Surfaces that indirect light comes over.
    pub fn bounces(&self, scene_has_indirect: bool) -> u32 {
        self.bounces.unwrap_or(if scene_has_indirect { 2 } else { 0 })
    }

    /// Side of the cells that share indirect light, median edges of the surface.
    pub fn light_spacing(&self) -> f32 {
        let spacing = if self.quality == Quality::Preview { 3.0 } else { 0.0 };
        self.light_spacing.unwrap_or(spacing)
    }

    /// Directions per vertex of the surface, for indirect light.
    pub fn cache_samples(&self) -> u32 {
        match self.quality {
            Quality::Preview => 8,
            Quality::Standard => 16,
            Quality::Reference => 128,
        }
    }
}

/// How colors are baked.
#[derive(Args, Clone, Copy, Debug, Serialize)]
#[command(next_help_heading = "Baking")]
pub struct BakeOptions {
    /// Degree of the spherical harmonics of baked colors, 0 (diffuse only) to 3
    #[arg(long, value_name = "DEGREE", default_value_t = 3,
        value_parser = clap::value_parser!(u8).range(0..=3))]
    pub sh_degree: u8,

    /// Viewing directions per Gaussian, 4 to 256
    #[arg(long, value_name = "N", default_value_t = 32,
        value_parser = clap::value_parser!(u32).range(4..=256))]
    pub bake_directions: u32,
}

impl Default for BakeOptions {
    fn default() -> Self {
        Self { sh_degree: 3, bake_directions: 32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_zenith_is_a_word_an_axis_or_a_vector() {
        assert_eq!("scene".parse(), Ok(EnvUp::Scene));
        assert_eq!("map".parse(), Ok(EnvUp::Map));
        assert_eq!("-y".parse(), Ok(EnvUp::Direction(DVec3::NEG_Y)));
        assert_eq!("+z".parse(), Ok(EnvUp::Direction(DVec3::Z)));
        assert_eq!("0, -2, 0".parse(), Ok(EnvUp::Direction(DVec3::NEG_Y)));
        for bad in ["", "up", "-scene", "0,0,0", "1,2", "1,NaN,2", "inf,0,0"] {
            assert!(bad.parse::<EnvUp>().is_err(), "{bad}");
        }
    }

    #[test]
    fn exposures_are_positive_numbers_or_auto() {
        assert_eq!("auto".parse(), Ok(Exposure::Auto));
        assert_eq!("ground".parse(), Ok(Exposure::Ground));
        assert_eq!("0.928".parse(), Ok(Exposure::Factor(0.928)));
        for bad in ["0", "-1", "NaN", "inf", "bright"] {
            assert!(bad.parse::<Exposure>().is_err(), "{bad}");
        }
    }
}
