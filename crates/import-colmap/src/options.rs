//! What the user can choose.

use std::path::PathBuf;

use motes_scene::Switch;
use serde::{Deserialize, Serialize};

/// How photos, masks, points and the split are made.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(default)]
pub struct ImportOptions {
    /// Downscale photos whose long side exceeds this many pixels (Lanczos-3, in one pass with the
    /// undistortion) [default: keep the size]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=65535))]
    pub max_resolution: Option<u32>,

    /// Downscale every photo by this factor, instead of to a long side
    #[arg(long, value_name = "FACTOR", alias = "data-factor", conflicts_with = "max_resolution", value_parser = parse_factor)]
    pub downscale_factor: Option<f64>,

    /// Hold out every N-th photo by sorted name, starting with the first (index % N == 0)
    #[arg(long, aliases = ["eval-split-every", "eval-interval", "llffhold"], value_name = "N", value_parser = clap::value_parser!(u32).range(2..), conflicts_with_all = ["test_list", "train_list"])]
    pub test_every: Option<u32>,

    /// Photos to hold out: a text file with one name per line
    #[arg(long, value_name = "FILE")]
    pub test_list: Option<PathBuf>,

    /// Photos to train on: a text file with one name per line; photos in neither list are left out
    #[arg(long, value_name = "FILE")]
    pub train_list: Option<PathBuf>,

    /// Keep only points that at least two training photos see, so that held-out photos do not leak
    /// into the fit
    #[arg(long)]
    pub points_from_train: bool,

    /// Folder of masks (black is ignored): NAME.png, NAME.jpg.png or NAME.mask.png for NAME.jpg
    #[arg(long, value_name = "DIR")]
    pub masks: Option<PathBuf>,

    /// Masks are white where pixels are ignored
    #[arg(long)]
    pub invert_masks: bool,

    /// What the lens takes from the corners of the photos: auto divides photos by it where points that several photos show tell it; on
    /// also where they tell it badly
    #[arg(long, value_enum, default_value_t = Switch::Auto, value_name = "SWITCH")]
    pub vignetting: Switch,

    /// Keep the whole field of view of distorted photos and mask out pixels without content
    /// [default: crop to the largest rectangle without such pixels]
    #[arg(long)]
    pub keep_border: bool,
}

impl ImportOptions {
    /// How large photos become.
    pub(crate) fn photo_size(&self) -> PhotoSize {
        match (self.max_resolution, self.downscale_factor) {
            (Some(pixels), _) => PhotoSize::LongSide(pixels),
            (None, Some(factor)) => PhotoSize::Divided(factor),
            (None, None) => PhotoSize::Kept,
        }
    }
}

/// The size of the photos of a capture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PhotoSize {
    /// That of the source.
    Kept,
    /// At most so many pixels on the long side.
    LongSide(u32),
    /// That of the source over a factor, at least 1.
    Divided(f64),
}

impl PhotoSize {
    /// What a photo of a long side in pixels is scaled by; at most 1.
    pub(crate) fn scale(self, long_side: f64) -> f64 {
        match self {
            Self::Kept => 1.0,
            Self::LongSide(pixels) => (f64::from(pixels) / long_side).min(1.0),
            Self::Divided(factor) => (1.0 / factor).min(1.0),
        }
    }
}

/// A factor from 1 (nothing) to 64.
fn parse_factor(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(factor) if (1.0..=64.0).contains(&factor) => Ok(factor),
        _ => Err("not a number from 1 to 64".into()),
    }
}
