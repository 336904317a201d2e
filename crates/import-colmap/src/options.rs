//! What the user can choose.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// How photos, masks, points and the split are made.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(default)]
pub struct ImportOptions {
    /// Downscale photos whose long side exceeds this many pixels (Lanczos-3, in one pass with the
    /// undistortion) [default: keep the size]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=65535))]
    pub max_resolution: Option<u32>,

    /// Hold out every N-th photo by sorted name, starting with the first (index % N == 0)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..), conflicts_with_all = ["test_list", "train_list"])]
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

    /// Keep the whole field of view of distorted photos and mask out pixels without content
    /// [default: crop to the largest rectangle without such pixels]
    #[arg(long)]
    pub keep_border: bool,
}
