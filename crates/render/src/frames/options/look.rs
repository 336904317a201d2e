//! How a frame looks.

use clap::{Args, ValueEnum};
use motes_raster::RasterParameters;
use serde::Serialize;

use crate::options::{AntialiasChoice, ViewExposure};

/// How the world is seen.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Image")]
pub struct FrameLook {
    /// Camera projection
    #[arg(long, value_enum, value_name = "PROJECTION", default_value_t = Projection::Pinhole)]
    pub projection: Projection,

    /// Color behind the Gaussians: black, white, or r,g,b from 0 to 1 (sRGB-encoded)
    #[arg(long, value_name = "COLOR", default_value = "black", value_parser = parse_background)]
    pub background: Background,

    /// Highest degree of spherical harmonics to use
    #[arg(long, value_name = "DEGREE", value_parser = clap::value_parser!(u8).range(0..=4))]
    pub sh_degree_limit: Option<u8>,

    /// Pixel filter of the Gaussians
    #[arg(long, value_enum, value_name = "MODE", default_value_t = AntialiasChoice::Auto)]
    pub antialias: AntialiasChoice,

    /// Exposure of images of the capture's views
    #[arg(long, value_enum, value_name = "EXPOSURE", default_value_t)]
    pub view_exposure: ViewExposure,

    /// Time against accuracy of the rasterizer
    #[command(flatten)]
    #[serde(flatten)]
    pub raster: RasterParameters,
}

/// How the world is projected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Projection {
    /// The cameras' own pinhole projection
    Pinhole,
    /// Full panoramas around the camera centers, aspect ratio 2:1
    Equirect,
}

/// A color behind everything, sRGB-encoded, values from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Background(pub [f32; 3]);

impl Serialize for Background {
    /// As the flag takes it, so that a dumped configuration can be read again.
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let [r, g, b] = self.0;
        serializer.collect_str(&format_args!("{r},{g},{b}"))
    }
}

/// Reads `black`, `white`, or `r,g,b` with values from 0 to 1, sRGB-encoded.
///
/// # Errors
/// A sentence for the user.
pub fn parse_background(text: &str) -> Result<Background, String> {
    match text {
        "black" => return Ok(Background([0.0; 3])),
        "white" => return Ok(Background([1.0; 3])),
        _ => {}
    }
    let parts: Vec<f32> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    match *parts.as_slice() {
        [r, g, b] if [r, g, b].iter().all(|v| (0.0..=1.0).contains(v)) => Ok(Background([r, g, b])),
        _ => Err("expected black, white, or three numbers r,g,b from 0 to 1".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backgrounds_are_read() {
        assert_eq!(parse_background("white"), Ok(Background([1.0; 3])));
        assert_eq!(parse_background("0.1, 0.2,1"), Ok(Background([0.1, 0.2, 1.0])));
        for text in ["", "gray", "1,2,3", "0.1,0.2", "NaN,0,0"] {
            assert!(parse_background(text).is_err(), "{text}");
        }
    }
}
