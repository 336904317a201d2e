//! Size and quality of a shadow plane.

use clap::Args;
use serde::Serialize;

/// How fine the shadow is.
#[derive(Args, Clone, Copy, Debug, PartialEq, Serialize)]
#[command(next_help_heading = "Shadow plane")]
pub struct ShadowOptions {
    /// Longer side of the shadow texture in pixels, 16 to 4096
    #[arg(long, value_name = "PX", default_value_t = 512,
        value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub shadow_size: u32,

    /// Light samples per pixel, 4 to 4096
    #[arg(long, value_name = "N", default_value_t = 256,
        value_parser = clap::value_parser!(u32).range(4..=4096))]
    pub shadow_samples: u32,

    /// Width of the ground around the objects, relative to their height; a low light needs more
    #[arg(long, value_name = "FACTOR", default_value_t = 1.5, value_parser = parse_margin)]
    pub shadow_margin: f32,
}

fn parse_margin(text: &str) -> Result<f32, String> {
    let margin: f32 = text.parse().map_err(|_| "expected a number".to_owned())?;
    if (0.0..=100.0).contains(&margin) { Ok(margin) } else { Err("expected 0 to 100".into()) }
}

impl Default for ShadowOptions {
    fn default() -> Self {
        Self { shadow_size: 512, shadow_samples: 256, shadow_margin: 1.5 }
    }
}
