//! The protocol of an evaluation, as flags and as words.

mod outputs;

use motes_scene::SplitChoice;
use std::path::PathBuf;

use clap::Args;
use motes_math::metrics::SsimBorder;
use motes_raster::RasterParameters;
use serde::Serialize;

use crate::lpips::{Lpips, LpipsNet, LpipsRange};
use crate::score::{Gate, GateMetric, ScoreOptions};
use render::frames::{Background, parse_background};
use render::model::{AntialiasChoice, ViewExposure};

pub use outputs::EvaluationOutputs;

/// The protocol.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Protocol")]
pub struct EvaluationOptions {
    /// Views to score
    #[arg(long, value_enum, value_name = "SPLIT", default_value_t = SplitChoice::Test)]
    pub split: SplitChoice,

    /// Also score the training views, and report train PSNR minus test PSNR
    #[arg(long)]
    pub gap: bool,

    /// Color behind Gaussians and transparent photos: black, white, or r,g,b from 0 to 1
    #[arg(long, value_name = "COLOR", default_value = "black", value_parser = parse_background)]
    pub background: Background,

    /// Pixel footprint of the Gaussians
    #[arg(long, value_enum, value_name = "MODE", default_value_t = AntialiasChoice::Auto)]
    pub antialias: AntialiasChoice,

    /// Brightness of the renders of Gaussians
    #[arg(long, value_enum, value_name = "EXPOSURE", default_value_t)]
    pub view_exposure: ViewExposure,

    /// SSIM windows across the image border: zero-padded (INRIA) or left out (torchmetrics)
    #[arg(long, value_enum, value_name = "BORDER", default_value_t = SsimBorder::Same)]
    pub ssim_border: SsimBorder,

    /// Weights for LPIPS, as scripts/export-lpips.py writes them; without them LPIPS is null
    #[arg(long, value_name = "FILE.safetensors")]
    pub lpips_weights: Option<PathBuf>,

    /// Network of the weights
    #[arg(long, value_enum, value_name = "NET", default_value_t = LpipsNet::Alex)]
    pub lpips_net: LpipsNet,

    /// Range of the RGB values given to LPIPS
    #[arg(long, value_enum, value_name = "RANGE", default_value_t = LpipsRange::Symmetric)]
    pub lpips_range: LpipsRange,

    /// Gate such as psnr>=25 or lpips<=0.2: exit code 4 when it is not met; repeatable
    #[arg(long, value_name = "METRIC>=NUMBER")]
    #[serde(serialize_with = "as_texts")]
    pub require: Vec<Gate>,

    /// Time against accuracy of the rasterizer
    #[command(flatten)]
    #[serde(flatten)]
    pub raster: RasterParameters,
}

fn as_texts<S: serde::Serializer>(gates: &[Gate], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(gates.iter().map(Gate::to_string))
}

impl EvaluationOptions {
    /// Whether the training views are scored, too.
    pub fn wants_gap(&self) -> bool {
        self.gap || self.requires(GateMetric::Gap)
    }

    /// Whether a metric is bounded.
    pub fn requires(&self, metric: GateMetric) -> bool {
        self.require.iter().any(|gate| gate.metric == metric)
    }

    /// The splits to score, the one asked for first.
    pub fn splits(&self) -> Vec<SplitChoice> {
        let mut splits = vec![self.split];
        if self.wants_gap() {
            splits.extend([SplitChoice::Test, SplitChoice::Train]);
        }
        let mut unique = Vec::new();
        for split in splits {
            if !unique.contains(&split) {
                unique.push(split);
            }
        }
        unique
    }

    /// How one view is scored.
    pub fn score_options<'a>(&self, lpips: Option<&'a Lpips>) -> ScoreOptions<'a> {
        ScoreOptions { ssim_border: self.ssim_border, lpips }
    }

    /// Why there is no LPIPS; `None` when there is.
    pub fn lpips_reason(&self) -> Option<&'static str> {
        self.lpips_weights.is_none().then_some("no weights were given (--lpips-weights)")
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;

    #[derive(clap::Parser)]
    struct Program {
        #[command(flatten)]
        options: EvaluationOptions,
    }

    fn parse(arguments: &[&str]) -> EvaluationOptions {
        Program::parse_from(["p"].iter().chain(arguments)).options
    }

    #[test]
    fn a_bound_on_the_gap_scores_both_splits() {
        use SplitChoice::{All, Test, Train};
        assert_eq!(parse(&[]).splits(), [Test]);
        assert_eq!(parse(&["--gap"]).splits(), [Test, Train]);
        assert_eq!(parse(&["--require", "gap<=3"]).splits(), [Test, Train]);
        assert_eq!(parse(&["--split", "train", "--gap"]).splits(), [Train, Test]);
        assert_eq!(parse(&["--split", "all"]).splits(), [All]);
    }

    #[test]
    fn options_are_written_as_the_flags_take_them() {
        let options =
            parse(&["--require", "psnr>=25", "--require", "ssim>=.5", "--background=white"]);
        let json = serde_json::to_value(&options).unwrap();
        assert_eq!(json["require"], serde_json::json!(["psnr>=25", "ssim>=0.5"]));
        assert_eq!(json["background"], "1,1,1");
        assert_eq!(json["ssim_border"], "same");
    }
}
