//! Views around Gaussians that come without a capture.

use motes_scene::Gaussians;
use motes_stage::StageError;
use serde::Serialize;

use crate::frames::{Frame, FrameSize, turntable};

/// Away from the ground, any length above 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direction([f64; 3]);

impl Default for Direction {
    /// About that of COLMAP's worlds.
    fn default() -> Self {
        Self([0.0, -1.0, 0.0])
    }
}

impl Serialize for Direction {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let [x, y, z] = self.0;
        serializer.collect_str(&format_args!("{x},{y},{z}"))
    }
}

/// Three finite numbers `x,y,z` that are not all 0.
pub(super) fn parse_direction(text: &str) -> Result<Direction, String> {
    let parts: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match parts.as_deref() {
        Some(&[x, y, z]) if [x, y, z].iter().all(|v| v.abs() < 1e100) && [x, y, z] != [0.0; 3] => {
            Ok(Direction([x, y, z]))
        }
        _ => Err("expected three numbers x,y,z that are a direction".into()),
    }
}

/// `count` frames around the opaque Gaussians, at the size asked for; `up` as of COLMAP's worlds where it is not given.
pub(super) fn around_model(
    gaussians: &Gaussians,
    up: Option<Direction>,
    size: &FrameSize,
    count: u32,
) -> anyhow::Result<Vec<Frame>> {
    let up = glam::DVec3::from_array(up.unwrap_or_default().0);
    let frames = turntable(gaussians, up, count as usize);
    let mut frames = frames.ok_or_else(|| {
        StageError::bad_input("no Gaussian is opaque: there is nothing to turn around")
    })?;
    frames.iter_mut().for_each(|frame| frame.camera = size.apply(&frame.camera));
    Ok(frames)
}
