//! Parameters of the fit, their defaults and the presets.

mod choices;

use clap::{Args, ValueEnum};
use motes_raster::RasterParameters;
use motes_scene::Switch;
use serde::{Deserialize, Serialize};

use crate::auto::options::{BackgroundModel, ExposureModel, ModelChoice};
use crate::loss::WeightedTerm;
use crate::start::options::StartFrom;
pub use choices::{AdamRule, Background, Densify, FreezeGroup};

/// A point on the measured front of time against quality.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Seconds: a first look, and continuous integration.
    Draft,
    /// Minutes: the default.
    #[default]
    Balanced,
    /// As good as it gets.
    High,
}

/// Parameters of the fit. `None` means: from the preset, or chosen from the number of views.
#[derive(Clone, Debug, Args, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", default)]
pub struct FitOptions {
    /// Point on the measured speed-quality front [default: balanced; with a time budget a
    /// place between two]
    #[arg(long, value_enum)]
    pub preset: Option<Preset>,
    /// Optimizer steps, one view each [default: from the preset]
    #[arg(
        short = 'n',
        long,
        aliases = ["max-steps", "total-train-iters", "max-num-iterations"],
        help_heading = "Schedule",
        value_name = "STEPS"
    )]
    pub iterations: Option<u32>,
    /// Factor on the preset's number of steps
    #[arg(
        long,
        alias = "steps-scaler",
        help_heading = "Schedule",
        default_value_t = 1.0,
        value_name = "FACTOR"
    )]
    pub steps_scale: f64,
    /// Maximum number of Gaussians [default: from the preset]
    #[arg(long, visible_aliases = ["max-splats", "cap-max", "max-cap", "max-gs-num"], help_heading = "Model", value_name = "COUNT")]
    pub max_gaussians: Option<usize>,
    /// Degree of the spherical harmonics, 0 to 4 [default: what --model decides]
    #[arg(long, help_heading = "Model", value_parser = clap::value_parser!(u8).range(0..=4), value_name = "DEGREE")]
    pub sh_degree: Option<u8>,
    /// Resolutions as scale:share of the steps, coarse to fine, e.g. 0.25:0.3,0.5:0.3,1:0.4
    /// [default: from the preset]
    #[arg(long, help_heading = "Schedule", value_name = "LIST")]
    pub resolution_schedule: Option<String>,
    /// Steps between densifications [default: from the preset]
    #[arg(long, help_heading = "Densification (expert)", value_name = "STEPS")]
    pub refine_every: Option<u32>,
    /// Fraction of the steps after which the number of Gaussians is fixed
    #[arg(
        long,
        help_heading = "Densification (expert)",
        default_value_t = 0.7,
        value_name = "SHARE"
    )]
    pub refine_until: f64,
    /// Gaussians with a smaller opacity are removed
    #[arg(
        long,
        visible_alias = "min-opacity",
        help_heading = "Densification (expert)",
        default_value_t = 0.005,
        value_name = "OPACITY"
    )]
    pub prune_opacity: f32,
    /// Views per step. Their mean gradient makes one update, learning rates grow with the square
    /// root of the number (Grendel, Zhao et al. 2024), and a preset's number of steps is divided by
    /// it
    #[arg(long, help_heading = "Optimizer (expert)", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=64), value_name = "VIEWS")]
    pub batch_views: u32,
    /// Steps between updates of the spherical harmonics above degree 0 (Taming 3DGS)
    #[arg(long, help_heading = "Optimizer (expert)", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), value_name = "STEPS")]
    pub sh_every: u32,
    /// Parameters that a step updates
    #[arg(long, value_enum, default_value_t, help_heading = "Optimizer (expert)")]
    pub adam: AdamRule,
    /// Largest fraction of the views that skip the backward pass because their loss is at most its
    /// running average (SkipGS); applies once the number of Gaussians is fixed
    #[arg(long, help_heading = "Optimizer (expert)", default_value_t = 0.0, value_name = "SHARE")]
    pub skip_backward: f64,
    /// Method of densification
    #[arg(
        long,
        alias = "strategy",
        value_enum,
        default_value_t,
        help_heading = "Densification (expert)"
    )]
    pub densify: Densify,
    /// Views that --densify error evaluates per round
    #[arg(
        long,
        help_heading = "Densification (expert)",
        default_value_t = 8,
        value_name = "VIEWS"
    )]
    pub score_views: usize,
    /// At each densification, remove Gaussians that contribute to none of this many views; 0
    /// disables it
    #[arg(
        long,
        help_heading = "Densification (expert)",
        default_value_t = 0,
        value_name = "VIEWS"
    )]
    pub prune_views: usize,
    /// Weight of 1 - SSIM; the absolute difference has the rest
    #[arg(long, visible_aliases = ["ssim-lambda"], help_heading = "Loss (expert)", default_value_t = 0.2, value_name = "WEIGHT")]
    pub ssim_weight: f32,
    /// Terms of the image loss beside the default; the help lists them.
    #[arg(long = "loss-term", help = WeightedTerm::help(), help_heading = "Loss (expert)", value_name = "NAME=WEIGHT")]
    #[serde(rename = "loss-term", skip_serializing_if = "Vec::is_empty")]
    pub loss_terms: Vec<WeightedTerm>,
    /// Weight of the mean opacity, which removes what no view needs
    #[arg(
        long,
        visible_alias = "opacity-reg",
        help_heading = "Loss (expert)",
        value_name = "WEIGHT"
    )]
    pub opacity_weight: Option<f32>,
    /// Weight of the mean scale relative to the camera extent
    #[arg(
        long,
        visible_alias = "scale-reg",
        help_heading = "Loss (expert)",
        value_name = "WEIGHT"
    )]
    pub scale_weight: Option<f32>,
    /// Fraction of Gaussians dropped at random, rising linearly from 0 to this at the last step
    /// (DropGaussian) [default: 0.2 with up to 12 views, else 0]
    #[arg(long, help_heading = "Regularization (expert)", value_name = "SHARE")]
    pub dropout: Option<f32>,
    /// Largest ratio of the longest axis to the middle one
    #[arg(
        long,
        visible_alias = "max-gauss-ratio",
        help_heading = "Regularization (expert)",
        value_name = "RATIO"
    )]
    pub max_anisotropy: Option<f32>,
    /// Parameters to keep fixed, for example to refit colors under another light
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        help_heading = "Initialization",
        value_name = "GROUPS"
    )]
    pub freeze: Vec<FreezeGroup>,
    /// Optional components of the model: those that held-out views support, all of them, or none;
    /// the flag of a component takes precedence
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub model: ModelChoice,
    /// Per-photo gain, or gain and offset, of each channel; `on` is affine, `off` is none
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub exposure: ExposureModel,
    /// Model of everything beyond the points: nothing, one learned color, or Gaussians on a far
    /// sphere [default: what --model decides]
    #[arg(long, value_enum, help_heading = "Model")]
    pub background_model: Option<BackgroundModel>,
    /// Use exposure time, ISO speed and f-number of the photos, which held-out photos have too;
    /// auto: where the capture says that brightness follows them
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub exposure_metadata: Switch,
    /// 3D smoothing filter of Mip-Splatting: no Gaussian is finer than the photos resolve
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub filter_3d: Switch,
    /// Color behind the Gaussians
    #[arg(long, alias = "background-color", value_enum, default_value_t, help_heading = "Model")]
    pub background: Background,
    /// Meaning of an alpha channel in the photos
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub alpha_mode: AlphaMode,
    /// Learning rate of the centers, relative to the camera extent; decays to 1 % at the end
    #[arg(
        long,
        visible_alias = "means-lr",
        help_heading = "Learning rates (expert)",
        default_value_t = 6.4e-4,
        value_name = "RATE"
    )]
    pub lr_means: f64,
    /// Learning rate of the log scales
    #[arg(
        long,
        visible_alias = "scales-lr",
        help_heading = "Learning rates (expert)",
        default_value_t = 2e-2,
        value_name = "RATE"
    )]
    pub lr_scales: f64,
    /// Learning rate of the quaternions
    #[arg(
        long,
        visible_alias = "quats-lr",
        help_heading = "Learning rates (expert)",
        default_value_t = 4e-3,
        value_name = "RATE"
    )]
    pub lr_rotations: f64,
    /// Learning rate of the opacity logits
    #[arg(
        long,
        visible_alias = "opacities-lr",
        help_heading = "Learning rates (expert)",
        default_value_t = 1e-1,
        value_name = "RATE"
    )]
    pub lr_opacities: f64,
    /// Learning rate of the spherical harmonics of degree 0
    #[arg(
        long,
        visible_alias = "sh0-lr",
        help_heading = "Learning rates (expert)",
        default_value_t = 1e-2,
        value_name = "RATE"
    )]
    pub lr_sh0: f64,
    /// Learning rate of the higher degrees
    #[arg(
        long,
        visible_alias = "shn-lr",
        help_heading = "Learning rates (expert)",
        default_value_t = 5e-4,
        value_name = "RATE"
    )]
    pub lr_sh_rest: f64,
    /// Final learning rates relative to the initial ones, other than that of the centers; they decay
    /// once the number of Gaussians is fixed [default: from the preset]
    #[arg(long, help_heading = "Learning rates (expert)", value_name = "SHARE")]
    pub lr_final: Option<f64>,
    /// Source of the initial Gaussians
    #[arg(
        long,
        value_enum,
        default_value_t,
        alias = "init-type",
        help_heading = "Initialization",
        value_name = "SOURCE"
    )]
    pub start: StartFrom,
    /// Opacity of the initial Gaussians
    #[arg(
        long,
        visible_alias = "init-opa",
        help_heading = "Initialization (expert)",
        default_value_t = 0.3,
        value_name = "OPACITY"
    )]
    pub init_opacity: f32,
    /// Spacing in pixels (at a long side of 512) of the points matched between photos; 0: none
    /// [default: 0; a few pixels per wanted point where the capture has fewer than 400 per photo]
    #[arg(long, help_heading = "Initialization (expert)", value_name = "PIXELS")]
    pub dense_step: Option<usize>,
    /// Largest fraction of --max-gaussians that the initial points take
    #[arg(
        long,
        help_heading = "Initialization (expert)",
        default_value_t = 0.7,
        value_name = "SHARE"
    )]
    pub dense_share: f64,
    /// Initial scale relative to the distance of the nearest neighbors
    #[arg(
        long,
        help_heading = "Initialization (expert)",
        default_value_t = 1.0,
        value_name = "FACTOR"
    )]
    pub init_scale: f32,
    /// Random Gaussians to start from when there are no points
    #[arg(
        long,
        visible_alias = "init-num-pts",
        help_heading = "Initialization (expert)",
        default_value_t = 20_000,
        value_name = "COUNT"
    )]
    pub init_random: usize,
    /// Time against accuracy of the rasterizer
    #[command(flatten)]
    #[serde(flatten)]
    pub raster: RasterParameters,
}

impl FitOptions {
    /// Whether a group is left alone, by its own name or as part of the geometry.
    pub(crate) fn is_frozen(&self, group: FreezeGroup) -> bool {
        use FreezeGroup::{Geometry, Means, Rotations, Scales};
        let by_geometry =
            matches!(group, Means | Scales | Rotations) && self.freeze.contains(&Geometry);
        by_geometry || self.freeze.contains(&group)
    }
}

impl Default for FitOptions {
    /// The defaults of the flags: they are written once, in the attributes above.
    fn default() -> Self {
        #[derive(clap::Parser)]
        struct Flags {
            #[command(flatten)]
            options: FitOptions,
        }
        let Flags { options } = clap::Parser::parse_from(["defaults"]);
        options
    }
}

/// What the alpha channel of a photo means.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    clap::ValueEnum,
    serde::Serialize,
    serde::Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum AlphaMode {
    /// Pixels with alpha below one half are ignored.
    Mask,
    /// The photo shows an object without background: the fit learns to be transparent there.
    #[default]
    Transparent,
    /// Alpha is dropped.
    Ignore,
}
