//! Cameras of a ground-truth folder.

use glam::{DVec2, DVec3};
use motes_formats::transforms::{TransformsFrame, read_transforms};
use motes_scene::{Camera, Pose};

use crate::score::truth_folder::{TruthFolder, frame_name};

/// A posed camera.
#[derive(Clone, Debug)]
pub struct View {
    /// Name of its picture, without suffix.
    pub name: String,
    /// Axes x right, y down, z forward.
    pub camera_from_world: Pose,
    /// Its lens and size.
    pub camera: Camera,
}

impl View {
    /// Point at a depth (z in the camera) behind the center of a pixel; none where the camera sees nothing there.
    pub fn point(&self, column: usize, row: usize, depth: f64) -> Option<DVec3> {
        let pixel = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
        let direction = self.camera.direction_from_pixel(pixel)?;
        Some(self.camera_from_world.inverse().transform_point(direction * (depth / direction.z)))
    }

    /// Pixel that shows a point, and the depth of the point; none outside the picture.
    pub fn project(&self, point: DVec3) -> Option<(usize, f64)> {
        let q = self.camera_from_world.transform_point(point);
        let pixel = self.camera.pixel_from_direction(q)?;
        let (w, h) = (self.camera.width, self.camera.height);
        let inside = (0.0..w as f64).contains(&pixel.x) && (0.0..h as f64).contains(&pixel.y);
        inside.then(|| (pixel.y as usize * w + pixel.x as usize, q.z))
    }

    /// Direction in the axes of the camera as OpenGL has them: x right, y up, z toward the viewer.
    pub fn to_camera_gl(&self, direction: DVec3) -> DVec3 {
        self.camera_from_world.rotation * direction * DVec3::new(1.0, -1.0, -1.0)
    }
}

/// Cameras of the `train` or the `test` views of a folder.
///
/// # Errors
/// When `transforms_WHICH.json` is missing or malformed.
pub fn views(truth: &TruthFolder, which: &str) -> anyhow::Result<Vec<View>> {
    let (width, height) = truth.size;
    let view = |frame: TransformsFrame| View {
        name: frame_name(&frame.file_path),
        camera_from_world: frame.camera_from_world,
        camera: frame.intrinsics.camera(width, height),
    };
    let path = truth.root.join(format!("transforms_{which}.json"));
    Ok(read_transforms(&path)?.frames.into_iter().map(view).collect())
}
