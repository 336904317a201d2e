//! How finely the page stores its Gaussians.

use clap::Args;
use serde::Serialize;

/// What is left out.
#[derive(Args, Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PackOptions {
    /// Bits of a coefficient above degree 0, 2 to 8: fewer make a smaller page
    #[arg(long, value_name = "BITS", default_value_t = 5,
        value_parser = clap::value_parser!(u8).range(2..=8))]
    pub html_sh_bits: u8,
}

impl Default for PackOptions {
    fn default() -> Self {
        Self { html_sh_bits: 5 }
    }
}
