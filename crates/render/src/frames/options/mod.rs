//! Command-line options that choose which frames are rendered, and at what size.

mod files;
mod look;
mod video;

use std::path::PathBuf;

use clap::Args;
use motes_scene::{Pinhole, SplitChoice};
use serde::Serialize;

use super::FrameSource;

pub use files::{DepthRange, FrameFormat, PictureFormat, PreviewAov};
pub use look::{Background, FrameLook, Projection, parse_background};
pub use video::VideoOptions;

/// Which poses to render; exactly one of these.
#[derive(Args, Clone, Debug, Default, Serialize)]
#[group(required = true, multiple = false)]
#[command(next_help_heading = "Cameras")]
pub struct FrameSelection {
    /// Views of one split of the capture
    #[arg(long, value_enum, value_name = "SPLIT")]
    pub split: Option<SplitChoice>,

    /// One view of the capture, by name; repeatable
    #[arg(long, value_name = "NAME")]
    pub view: Vec<String>,

    /// Interpolate between two views: one image at --t, or --frames N from A to B
    #[arg(long, num_args = 2, value_names = ["A", "B"])]
    pub between: Vec<String>,

    /// N images on a circle around the point that the training cameras look at
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub orbit: Option<u32>,

    /// N images on a spiral in front of the point that the training cameras look at
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub spiral: Option<u32>,

    /// Cameras of a motes/camera-path document; needs no capture
    #[arg(long, value_name = "FILE")]
    pub path: Option<PathBuf>,
}

/// Where between the two views of `--between`.
#[derive(Args, Clone, Debug, Default, Serialize)]
#[command(next_help_heading = "Cameras")]
pub struct BetweenOptions {
    /// Position between A and B, 0 to 1, with --between [default: 0.5]
    #[arg(long, value_name = "FRACTION", value_parser = parse_fraction)]
    pub t: Option<f64>,

    /// Number of images from A to B, both included, with --between
    #[arg(long, conflicts_with = "t", value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub frames: Option<u32>,
}

impl BetweenOptions {
    /// Whether any of them was given.
    pub fn is_given(&self) -> bool {
        self.t.is_some() || self.frames.is_some()
    }
}

fn parse_fraction(text: &str) -> Result<f64, String> {
    let t = text.parse().ok().filter(|t| (0.0..=1.0).contains(t));
    t.ok_or_else(|| "expected a number from 0 to 1".into())
}

impl FrameSelection {
    /// The source; `None` for `--path`.
    pub fn source(&self, options: &BetweenOptions) -> Option<FrameSource> {
        if let Some(split) = self.split {
            return Some(FrameSource::Split(split.split()));
        }
        if !self.view.is_empty() {
            return Some(FrameSource::Views(self.view.clone()));
        }
        if let [a, b] = self.between.as_slice() {
            let times = match options.frames {
                None => vec![options.t.unwrap_or(0.5)],
                Some(n) => {
                    let last = f64::from(n.saturating_sub(1).max(1));
                    (0..n).map(|i| f64::from(i) / last).collect()
                }
            };
            return Some(FrameSource::Between(a.clone(), b.clone(), times));
        }
        let orbit = self.orbit.map(|n| FrameSource::Orbit(n as usize));
        orbit.or_else(|| self.spiral.map(|n| FrameSource::Spiral(n as usize)))
    }
}

/// Size of the pictures; without any of these, as the cameras say.
#[derive(Args, Clone, Debug, Default, Serialize)]
#[command(next_help_heading = "Image")]
pub struct FrameSize {
    /// Width in pixels; the height keeps the aspect ratio unless given
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=32_768))]
    pub width: Option<u32>,

    /// Height in pixels; the width keeps the aspect ratio unless given
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=32_768))]
    pub height: Option<u32>,

    /// Factor on width and height
    #[arg(long, value_name = "FACTOR", conflicts_with_all = ["width", "height"],
        value_parser = parse_factor)]
    pub scale: Option<f64>,
}

/// A factor that leaves a size to speak of.
fn parse_factor(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(factor) if factor > 0.0 && factor <= 1e3 => Ok(factor),
        _ => Err("expected a number above 0, at most 1000".into()),
    }
}

impl FrameSize {
    /// The camera at the wanted size; its field of view stays unless both sides are given.
    pub fn apply(&self, camera: &Pinhole) -> Pinhole {
        let (old_width, old_height) = (camera.width as f64, camera.height as f64);
        let side = |value: f64| value.round().clamp(1.0, 32_768.0) as usize;
        let (width, height) = match (self.width, self.height, self.scale) {
            (Some(w), Some(h), _) => (w as usize, h as usize),
            (Some(w), None, _) => (w as usize, side(f64::from(w) * old_height / old_width)),
            (None, Some(h), _) => (side(f64::from(h) * old_width / old_height), h as usize),
            (None, None, Some(s)) => (side(s * old_width), side(s * old_height)),
            (None, None, None) => return *camera,
        };
        camera.resized(width, height)
    }

    /// The size of a panorama: 2:1 unless both sides are given, 2048×1024 unless one is.
    pub fn panorama(&self) -> (usize, usize) {
        let (width, height) = match (self.width, self.height) {
            (Some(w), Some(h)) => (w, h),
            (Some(w), None) => (w, w.div_ceil(2)),
            (None, Some(h)) => (2 * h, h),
            (None, None) => (2048, 1024),
        };
        let scale =
            |side: u32| (f64::from(side) * self.scale.unwrap_or(1.0)).round().clamp(2.0, 32_768.0);
        (scale(width) as usize, scale(height) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Pinhole =
        Pinhole { fx: 400.0, fy: 400.0, cx: 320.0, cy: 240.0, width: 640, height: 480 };

    #[test]
    fn sizes_keep_the_field_of_view() {
        let size = |width, height, scale| FrameSize { width, height, scale }.apply(&CAMERA);
        assert_eq!(size(None, None, None), CAMERA);
        let half = size(Some(320), None, None);
        assert_eq!((half.width, half.height, half.fx, half.cy), (320, 240, 200.0, 120.0));
        assert_eq!(size(None, Some(240), None), half);
        assert_eq!(size(None, None, Some(0.5)), half);
        let panorama = |width, height, scale| FrameSize { width, height, scale }.panorama();
        assert_eq!(panorama(None, None, None), (2048, 1024));
        assert_eq!(panorama(Some(100), None, None), (100, 50));
        assert_eq!(panorama(None, None, Some(0.5)), (1024, 512));
    }

    #[test]
    fn between_gives_one_time_or_many() {
        let selection =
            FrameSelection { between: vec!["a".into(), "b".into()], ..FrameSelection::default() };
        let times = |t, frames| match selection.source(&BetweenOptions { t, frames }) {
            Some(FrameSource::Between(_, _, times)) => times,
            other => panic!("{other:?}"),
        };
        assert_eq!(times(None, None), [0.5]);
        assert_eq!(times(Some(0.25), None), [0.25]);
        assert_eq!(times(None, Some(3)), [0.0, 0.5, 1.0]);
    }
}
