//! Cameras of a ground-truth folder.

use std::path::Path;

use anyhow::Context as _;
use glam::{DMat4, DVec2, DVec3};
use serde::Deserialize;

#[derive(Deserialize)]
struct Transforms {
    fl_x: f64,
    fl_y: f64,
    cx: f64,
    cy: f64,
    w: usize,
    h: usize,
    frames: Vec<Frame>,
}

#[derive(Deserialize)]
struct Frame {
    file_path: String,
    transform_matrix: [[f64; 4]; 4],
}

/// A posed pinhole camera.
#[derive(Clone, Debug)]
pub struct View {
    /// Name of its picture, without suffix.
    pub name: String,
    /// Columns and rows.
    pub size: (usize, usize),
    /// Axes x right, y up, z toward the viewer.
    pub world_from_camera: DMat4,
    focal: DVec2,
    center: DVec2,
}

impl View {
    /// Point at a depth (z in the camera) behind the center of a pixel.
    pub fn point(&self, column: usize, row: usize, depth: f64) -> DVec3 {
        let pixel = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
        let slope = (pixel - self.center) / self.focal;
        self.world_from_camera.transform_point3(DVec3::new(slope.x, -slope.y, -1.0) * depth)
    }

    /// Pixel that shows a point, and the depth of the point; none outside the picture.
    pub fn project(&self, point: DVec3) -> Option<(usize, f64)> {
        let q = self.world_from_camera.inverse().transform_point3(point);
        let depth = -q.z;
        let pixel = DVec2::new(q.x, -q.y) / depth * self.focal + self.center;
        let (w, h) = self.size;
        let inside =
            depth > 0.0 && (0.0..w as f64).contains(&pixel.x) && (0.0..h as f64).contains(&pixel.y);
        inside.then(|| (pixel.y as usize * w + pixel.x as usize, depth))
    }

    /// Direction in the axes of the camera.
    pub fn to_camera(&self, direction: DVec3) -> DVec3 {
        self.world_from_camera.inverse().transform_vector3(direction)
    }
}

/// Cameras of `transforms_train.json` or `transforms_test.json`.
///
/// # Errors
/// When it is missing or malformed.
pub fn views(path: &Path) -> anyhow::Result<Vec<View>> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let all: Transforms =
        serde_json::from_str(&text).with_context(|| path.display().to_string())?;
    let view = |frame: &Frame| {
        let stem = Path::new(&frame.file_path).file_stem().unwrap_or_default();
        View {
            name: stem.to_string_lossy().into_owned(),
            size: (all.w, all.h),
            world_from_camera: DMat4::from_cols_array_2d(&frame.transform_matrix).transpose(),
            focal: DVec2::new(all.fl_x, all.fl_y),
            center: DVec2::new(all.cx, all.cy),
        }
    };
    Ok(all.frames.iter().map(view).collect())
}
