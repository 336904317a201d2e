//! Dials of the fit, their defaults and the presets.

use clap::{Args, ValueEnum};
use motes_raster::RasterDials;
use motes_scene::Switch;
use serde::{Deserialize, Serialize};

use crate::auto::{BackgroundModel, ExposureModel, ModelChoice};
use crate::start::StartFrom;

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

/// Color behind the Gaussians while fitting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Background {
    /// Random per step when photos have alpha (what is transparent must stay so), else black.
    #[default]
    Auto,
    /// A new color every step.
    Random,
    /// Black.
    Black,
    /// White.
    White,
}

/// Which parameters a step of Adam changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AdamRule {
    /// All: momentum goes on where the step's views see nothing.
    #[default]
    Dense,
    /// Those with a gradient; the others keep their moments too (Taming 3DGS, Mallick et al. 2024).
    Visible,
}

/// Where Gaussians are added.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Densify {
    /// Those whose projected centers are pulled most are divided (Kerbl et al. 2023).
    #[default]
    Pull,
    /// Those that cover most of the error of several views are divided (after FastGS, 2025).
    Error,
    /// Faint ones move to where opaque ones are, the centers take random steps (3DGS as Markov chain
    /// Monte Carlo, Kheradmand et al. 2024).
    Relocate,
}

/// Parameters that a fit may leave alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FreezeGroup {
    /// Centers, scales and rotations, and the number of Gaussians.
    Geometry,
    /// Centers, and the number of Gaussians.
    Means,
    /// Log scales.
    Scales,
    /// Quaternions.
    Rotations,
    /// Opacity logits.
    Opacities,
    /// All spherical harmonics.
    Colors,
}

/// Dials of the fit. `None` means: from the preset, or chosen from the number of views.
#[derive(Clone, Debug, Args, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", default)]
pub struct FitOptions {
    /// Point on the measured speed-quality front [default: balanced; with a time budget a
    /// place between two]
    #[arg(long, value_enum)]
    pub preset: Option<Preset>,
    /// Optimizer steps, one view each [default: from the preset]
    #[arg(short = 'n', long, help_heading = "Schedule", value_name = "STEPS")]
    pub iterations: Option<u32>,
    /// Multiplies the preset's number of steps
    #[arg(long, help_heading = "Schedule", default_value_t = 1.0, value_name = "FACTOR")]
    pub steps_scale: f64,
    /// Upper bound of the number of Gaussians [default: from the preset]
    #[arg(long, visible_aliases = ["max-splats", "cap-max", "max-cap"], help_heading = "Model", value_name = "COUNT")]
    pub max_gaussians: Option<usize>,
    /// Degree of the spherical harmonics, 0 to 4 [default: what --model decides]
    #[arg(long, help_heading = "Model", value_parser = clap::value_parser!(u8).range(0..=4), value_name = "DEGREE")]
    pub sh_degree: Option<u8>,
    /// Resolutions as scale:share of the steps, coarse to fine, e.g. 0.25:0.3,0.5:0.3,1:0.4
    /// [default: from the preset]
    #[arg(long, help_heading = "Schedule", value_name = "LIST")]
    pub resolution_schedule: Option<String>,
    /// Steps between densifications [default: from the preset]
    #[arg(long, help_heading = "Densification", value_name = "STEPS")]
    pub refine_every: Option<u32>,
    /// Share of the steps after which the number of Gaussians is fixed
    #[arg(long, help_heading = "Densification", default_value_t = 0.7, value_name = "SHARE")]
    pub refine_until: f64,
    /// Gaussians fainter than this are removed
    #[arg(
        long,
        visible_alias = "min-opacity",
        help_heading = "Densification",
        default_value_t = 0.005,
        value_name = "OPACITY"
    )]
    pub prune_opacity: f32,
    /// Views per step: their mean gradient makes one update, with rates times the root of the number
    /// (Grendel, Zhao et al. 2024); a preset's number of steps is divided by it
    #[arg(long, help_heading = "Speed", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=64), value_name = "VIEWS")]
    pub batch_views: u32,
    /// Steps between updates of the color bands above 0 (Taming 3DGS)
    #[arg(long, help_heading = "Speed", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), value_name = "STEPS")]
    pub sh_every: u32,
    /// Which parameters a step changes
    #[arg(long, value_enum, default_value_t, help_heading = "Speed")]
    pub adam: AdamRule,
    /// Largest share of the views, once the number of Gaussians is fixed, whose gradient is left out
    /// because their loss is no worse than it usually is (SkipGS)
    #[arg(long, help_heading = "Speed", default_value_t = 0.0, value_name = "SHARE")]
    pub skip_backward: f64,
    /// Which Gaussians are added to
    #[arg(long, value_enum, default_value_t, help_heading = "Densification")]
    pub densify: Densify,
    /// Views that --densify error looks at in each round
    #[arg(long, help_heading = "Densification", default_value_t = 8, value_name = "VIEWS")]
    pub score_views: usize,
    /// Gaussians that carry nothing in any of so many views are removed at each densification; 0:
    /// none are
    #[arg(long, help_heading = "Densification", default_value_t = 0, value_name = "VIEWS")]
    pub prune_views: usize,
    /// Weight of 1 - SSIM against the absolute difference
    #[arg(long, visible_aliases = ["ssim-lambda"], help_heading = "Loss", default_value_t = 0.2, value_name = "WEIGHT")]
    pub ssim_weight: f32,
    /// Weight of the mean opacity, which removes what no view needs
    #[arg(long, visible_alias = "opacity-reg", help_heading = "Loss", value_name = "WEIGHT")]
    pub opacity_weight: Option<f32>,
    /// Weight of the mean scale relative to the camera extent
    #[arg(long, visible_alias = "scale-reg", help_heading = "Loss", value_name = "WEIGHT")]
    pub scale_weight: Option<f32>,
    /// Share of Gaussians left out at random at the last step, rising from 0 [default: 0.2 with
    /// up to 12 views, else 0] (DropGaussian)
    #[arg(long, help_heading = "Few views", value_name = "SHARE")]
    pub dropout: Option<f32>,
    /// Longest axis over the middle one is kept below this
    #[arg(
        long,
        visible_alias = "max-gauss-ratio",
        help_heading = "Few views",
        value_name = "RATIO"
    )]
    pub max_anisotropy: Option<f32>,
    /// Parameters to leave as they are, for example to refit colors under another light
    #[arg(long, value_enum, value_delimiter = ',', help_heading = "Start", value_name = "GROUPS")]
    pub freeze: Vec<FreezeGroup>,
    /// Components of the model: what held-out evidence supports, everything, or nothing optional; a
    /// component's own flag wins
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub model: ModelChoice,
    /// Per-photo gain, or gain and offset, of each channel; `on` is affine, `off` is none
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub exposure: ExposureModel,
    /// What lies behind all points: nothing, one learned color, or Gaussians on a far sphere
    /// [default: what --model decides]
    #[arg(long, value_enum, help_heading = "Model")]
    pub background_model: Option<BackgroundModel>,
    /// Follow the photos' exposure time, ISO speed and f-number, which held-out photos have too; auto:
    /// where the capture says that brightness follows them
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub exposure_metadata: Switch,
    /// 3D smoothing filter of Mip-Splatting: no Gaussian finer than the photos can show
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub filter_3d: Switch,
    /// Color behind the Gaussians
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub background: Background,
    /// Meaning of an alpha channel in the photos
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub alpha_mode: AlphaMode,
    /// Learning rate of the centers, times the camera extent; falls to 1 % at the end
    #[arg(
        long,
        visible_alias = "means-lr",
        help_heading = "Learning rates",
        default_value_t = 6.4e-4,
        value_name = "RATE"
    )]
    pub lr_means: f64,
    /// Learning rate of the log scales
    #[arg(
        long,
        visible_alias = "scales-lr",
        help_heading = "Learning rates",
        default_value_t = 2e-2,
        value_name = "RATE"
    )]
    pub lr_scales: f64,
    /// Learning rate of the quaternions
    #[arg(
        long,
        visible_alias = "quats-lr",
        help_heading = "Learning rates",
        default_value_t = 4e-3,
        value_name = "RATE"
    )]
    pub lr_rotations: f64,
    /// Learning rate of the opacity logits
    #[arg(
        long,
        visible_alias = "opacities-lr",
        help_heading = "Learning rates",
        default_value_t = 1e-1,
        value_name = "RATE"
    )]
    pub lr_opacities: f64,
    /// Learning rate of band 0 of the colors
    #[arg(
        long,
        visible_alias = "sh0-lr",
        help_heading = "Learning rates",
        default_value_t = 1e-2,
        value_name = "RATE"
    )]
    pub lr_sh0: f64,
    /// Learning rate of the higher bands
    #[arg(
        long,
        visible_alias = "shn-lr",
        help_heading = "Learning rates",
        default_value_t = 5e-4,
        value_name = "RATE"
    )]
    pub lr_sh_rest: f64,
    /// Share of the rates (other than that of the centers) left at the end; they fall once the number
    /// of Gaussians is fixed [default: from the preset; a short run cannot afford to slow down]
    #[arg(long, help_heading = "Learning rates", value_name = "SHARE")]
    pub lr_final: Option<f64>,
    /// Where the first Gaussians come from
    #[arg(long, value_enum, default_value_t, help_heading = "Start", value_name = "SOURCE")]
    pub start: StartFrom,
    /// Opacity of the first Gaussians
    #[arg(
        long,
        visible_alias = "init-opa",
        help_heading = "Start",
        default_value_t = 0.3,
        value_name = "OPACITY"
    )]
    pub init_opacity: f32,
    /// Spacing in pixels (at a long side of 512) of the start points matched between photos; 0: none
    /// [default: from the preset; without points in the capture, so that a few pixels are looked at
    /// per point that is wanted]
    #[arg(long, help_heading = "Start", value_name = "PIXELS")]
    pub dense_step: Option<usize>,
    /// Share of the largest number of Gaussians that the start points may take
    #[arg(long, help_heading = "Start", default_value_t = 0.7, value_name = "SHARE")]
    pub dense_share: f64,
    /// Factor on the distance to the neighbors that sets the first scales
    #[arg(long, help_heading = "Start", default_value_t = 1.0, value_name = "FACTOR")]
    pub init_scale: f32,
    /// Random Gaussians to start with when there are no points
    #[arg(
        long,
        visible_alias = "init-num-pts",
        help_heading = "Start",
        default_value_t = 20_000,
        value_name = "COUNT"
    )]
    pub init_random: usize,
    /// Time against accuracy of the rasterizer
    #[command(flatten)]
    #[serde(flatten)]
    pub raster: RasterDials,
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
