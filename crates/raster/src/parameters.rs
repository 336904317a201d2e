//! Parameters of the rasterizer: what each trades, its default and its flag.

use clap::{Args, ValueEnum};
use fearless_simd::Level;
use serde::{Deserialize, Serialize};

use crate::options::{ALPHA_MIN, TRANSMITTANCE_MIN};

/// Vector instructions of the tile kernels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SimdLevel {
    /// The widest of this machine
    #[default]
    Best,
    /// 16 lanes, x86
    Avx512,
    /// 8 lanes, x86
    Avx2,
    /// 4 lanes, x86, no fused multiply-add
    #[value(name = "sse4.2")]
    #[serde(rename = "sse4.2")]
    Sse42,
    /// What every machine of this architecture has: SSE2 on x86-64, NEON on aarch64
    Baseline,
}

impl SimdLevel {
    /// The instructions to dispatch to; `None` where this machine lacks them.
    pub fn level(self) -> Option<Level> {
        let best = best_level();
        match self {
            Self::Best => Some(best),
            Self::Baseline => Some(Level::baseline()),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => best.as_avx512().map(Level::Avx512),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => best.as_avx2().map(Level::Avx2),
            #[cfg(target_arch = "x86_64")]
            Self::Sse42 => best.as_sse4_2().map(Level::Sse4_2),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx512 | Self::Avx2 | Self::Sse42 => None,
        }
    }
}

/// The widest instruction set of this machine.
fn best_level() -> Level {
    static LEVEL: std::sync::OnceLock<Level> = std::sync::OnceLock::new();
    *LEVEL.get_or_init(Level::new)
}

/// Reads a level and refuses one that this machine lacks.
fn parse_simd(text: &str) -> Result<SimdLevel, String> {
    let level = SimdLevel::from_str(text, true)?;
    match level.level() {
        Some(_) => Ok(level),
        None => Err("this machine has no such instructions; take best".into()),
    }
}

/// In which order Gaussians are composited.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sorting {
    /// By depth of the centers, one order for the image
    #[default]
    Global,
    /// By depth on the ray through the tile's center
    Tile,
    /// By depth on each pixel's ray, within a window; slow, rendering only (Radl et al. 2024)
    Pixel,
}

/// Precision of sums of gradients over tiles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Accumulation {
    /// 32 bit
    #[default]
    F32,
    /// 64 bit
    F64,
}

/// Reads a side of tiles.
fn parse_tile_size(text: &str) -> Result<u8, String> {
    match text {
        "8" => Ok(8),
        "16" => Ok(16),
        "32" => Ok(32),
        _ => Err("tiles are 8, 16 or 32 pixels wide".into()),
    }
}

/// Reads a number between two bounds.
fn parse_between(text: &str, low: f32, high: f32) -> Result<f32, String> {
    let value: f32 = text.parse().map_err(|_| "expected a number".to_owned())?;
    match (low..=high).contains(&value) {
        true => Ok(value),
        false => Err(format!("expected a number from {low} to {high}")),
    }
}

/// How the rasterizer trades time against accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", default)]
#[command(next_help_heading = "Rasterizer (expert)")]
pub struct RasterParameters {
    /// Side of a tile: 8, 16 or 32 pixels; smaller tiles sort more entries and blend fewer pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 16, value_parser = parse_tile_size)]
    pub tile_size: u8,
    /// Contributions with a smaller alpha are skipped, 0.001 to 0.5 [default: 1/255]
    #[arg(
        long,
        value_name = "ALPHA",
        default_value_t = ALPHA_MIN,
        hide_default_value = true,
        value_parser = |text: &str| parse_between(text, 0.001, 0.5)
    )]
    pub alpha_min: f32,
    /// Compositing of a pixel stops once its transmittance is below this, 0 to 0.5
    #[arg(
        long,
        value_name = "TRANSMITTANCE",
        default_value_t = TRANSMITTANCE_MIN,
        value_parser = |text: &str| parse_between(text, 0.0, 0.5)
    )]
    pub transmittance_min: f32,
    /// Cut Gaussians off at this many standard deviations, 0.5 to 100 [default: only where alpha
    /// falls below --alpha-min]
    #[arg(long, value_name = "SIGMAS", value_parser = |text: &str| parse_between(text, 0.5, 100.0))]
    pub extent_sigmas: Option<f32>,
    /// Degree of the polynomial that approximates the exponential, 2 to 5
    #[arg(
        long,
        value_name = "DEGREE",
        default_value_t = 5,
        value_parser = clap::value_parser!(u8).range(2..=5)
    )]
    pub exp_degree: u8,
    /// Sorting for compositing; "pixel" is for rendering only
    #[arg(long, value_enum, value_name = "ORDER", default_value_t)]
    pub sort: Sorting,
    /// Precision of gradient sums over tiles
    #[arg(long, value_enum, value_name = "TYPE", default_value_t)]
    pub accumulate: Accumulation,
    /// Vector instructions: best, avx512, avx2, sse4.2, baseline
    #[arg(long, value_name = "LEVEL", default_value = "best", value_parser = parse_simd)]
    pub simd: SimdLevel,
}

impl Default for RasterParameters {
    fn default() -> Self {
        Self {
            tile_size: 16,
            alpha_min: ALPHA_MIN,
            transmittance_min: TRANSMITTANCE_MIN,
            extent_sigmas: None,
            exp_degree: 5,
            sort: Sorting::Global,
            accumulate: Accumulation::F32,
            simd: SimdLevel::Best,
        }
    }
}

impl RasterParameters {
    /// The instructions to dispatch to: the wish, or the best there is.
    pub(crate) fn level(&self) -> Level {
        self.simd.level().unwrap_or_else(best_level)
    }
}
