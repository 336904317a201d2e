//! How relit views become one scene.

use clap::{Args, ValueEnum};
use serde::Serialize;

/// How views become a splat.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LiftMethod {
    /// Robust mean over the views of the smoothed ratio of relit to captured color
    #[default]
    Bake,
    /// The same, then a fit of the colors to the views
    Refit,
}

/// How views are brought together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Agreement {
    /// Gains per view, weighted medians, and weights by agreement
    #[default]
    Robust,
    /// Mean
    Mean,
}

/// Parameters of lifting.
#[derive(Args, Clone, Copy, Debug, Serialize)]
#[command(next_help_heading = "Lifting relit views")]
pub struct LiftOptions {
    /// Method of lifting
    #[arg(long, value_enum, value_name = "METHOD", default_value_t)]
    pub lift: LiftMethod,

    /// How views that disagree are combined
    #[arg(
        long,
        value_enum,
        value_name = "HOW",
        default_value_t,
        help_heading = "Lifting relit views (expert)"
    )]
    pub agreement: Agreement,

    /// Radius of the smoothing of that ratio, as a fraction of the image width, 0 to 0.5
    #[arg(long, value_name = "SHARE", default_value_t = 0.03, value_parser = parse_share, help_heading = "Lifting relit views (expert)")]
    pub lift_radius: f32,

    /// Steps of the fit with --lift refit
    #[arg(long, value_name = "N", default_value_t = 15,
        value_parser = clap::value_parser!(u32).range(1..=1000), help_heading = "Lifting relit views (expert)")]
    pub refit_steps: u32,

    /// Degree of the spherical harmonics fitted with --lift refit, 0 to 3
    #[arg(long, value_name = "DEGREE", default_value_t = 1,
        value_parser = clap::value_parser!(u8).range(0..=3), help_heading = "Lifting relit views (expert)")]
    pub refit_degree: u8,
}

impl Default for LiftOptions {
    fn default() -> Self {
        Self {
            lift: LiftMethod::Bake,
            agreement: Agreement::Robust,
            lift_radius: 0.03,
            refit_steps: 15,
            refit_degree: 1,
        }
    }
}

fn parse_share(text: &str) -> Result<f32, String> {
    let share = text.parse().ok().filter(|s| (0.0..=0.5).contains(s));
    share.ok_or_else(|| "expected a number from 0 to 0.5".into())
}
