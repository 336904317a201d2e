//! A photo prepared for matching.

use glam::{Mat3, Vec3};
use motes_math::resample::{Filter, resize};
use motes_scene::{Pinhole, SparsePoints};

use crate::target::TrainingImage;

/// Cell size of the lookup of projected sparse points, pixels.
const CELL: usize = 16;

/// Luminance at matching size, camera, and where the sparse points project.
pub(super) struct Photo {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) luma: Vec<f32>,
    rgb: Vec<u8>,
    pub(super) camera: Pinhole,
    pub(super) rotation: Mat3,
    pub(super) center: Vec3,
    /// Per cell: (x, y, inverse depth) of the sparse points that project there.
    cells: Vec<Vec<[f32; 3]>>,
    columns: usize,
}

impl Photo {
    pub(super) fn new(image: &TrainingImage, sparse: &SparsePoints, long_side: usize) -> Self {
        let (w, h) = (image.camera.width, image.camera.height);
        let scale = (long_side as f64 / w.max(h) as f64).min(1.0);
        let side = |length: usize| ((length as f64 * scale).round() as usize).max(1);
        let camera = image.camera.resized(side(w), side(h));
        let (width, height) = (camera.width, camera.height);
        let source = image.image.to_f32();
        let channels = source.channels;
        let data = resize(&source.data, (w, h, channels), (width, height), Filter::Lanczos3);
        let luma = data
            .chunks_exact(channels)
            .map(|p| 0.299 * p[0] + 0.587 * p[1.min(channels - 1)] + 0.114 * p[2.min(channels - 1)])
            .collect();
        let rgb = data
            .chunks_exact(channels)
            .flat_map(|p| {
                [0, 1, 2].map(|c: usize| (p[c.min(channels - 1)].clamp(0.0, 1.0) * 255.0) as u8)
            })
            .collect();
        let pose = &image.camera_from_world;
        let columns = width.div_ceil(CELL);
        let mut photo = Self {
            width,
            height,
            luma,
            rgb,
            camera,
            rotation: pose.rotation_matrix().as_mat3(),
            center: pose.center_in_world().as_vec3(),
            cells: vec![Vec::new(); columns * height.div_ceil(CELL)],
            columns,
        };
        for position in &sparse.positions {
            if let Some((x, y, z)) = photo.project(Vec3::from(*position)) {
                photo.cells[y as usize / CELL * columns + x as usize / CELL].push([x, y, 1.0 / z]);
            }
        }
        photo
    }

    /// Pixel and depth of a point that lies on the photo.
    pub(super) fn project(&self, position: Vec3) -> Option<(f32, f32, f32)> {
        let p = self.rotation * (position - self.center);
        let x = self.camera.fx as f32 * p.x / p.z + self.camera.cx as f32;
        let y = self.camera.fy as f32 * p.y / p.z + self.camera.cy as f32;
        let inside =
            p.z > 0.0 && x >= 0.0 && y >= 0.0 && x < self.width as f32 && y < self.height as f32;
        inside.then_some((x, y, p.z))
    }

    /// World position of a pixel at depth `z`.
    pub(super) fn unproject(&self, x: f32, y: f32, z: f32) -> Vec3 {
        let ray = Vec3::new(
            (x - self.camera.cx as f32) / self.camera.fx as f32,
            (y - self.camera.cy as f32) / self.camera.fy as f32,
            1.0,
        );
        self.rotation.transpose() * (ray * z) + self.center
    }

    pub(super) fn color(&self, x: usize, y: usize) -> [u8; 3] {
        let at = 3 * (y * self.width + x);
        [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]]
    }

    /// Inverse depths of the up to `N` sparse points that project nearest to a pixel, from the
    /// cells around it; the number found comes first.
    pub(super) fn nearest_depths<const N: usize>(&self, x: f32, y: f32) -> (usize, [f32; N]) {
        let (cx, cy) = (x as usize / CELL, y as usize / CELL);
        let rows = self.cells.len() / self.columns;
        let mut best = [(f32::INFINITY, 0.0f32); N];
        // Two rings of cells: beyond 40 pixels a sparse depth says little about this pixel.
        for row in cy.saturating_sub(2)..(cy + 3).min(rows) {
            for column in cx.saturating_sub(2)..(cx + 3).min(self.columns) {
                for &[px, py, inverse_depth] in &self.cells[row * self.columns + column] {
                    let d2 = (px - x).powi(2) + (py - y).powi(2);
                    if d2 < best[N - 1].0 {
                        best[N - 1] = (d2, inverse_depth);
                        let mut k = N - 1;
                        while k > 0 && best[k].0 < best[k - 1].0 {
                            best.swap(k, k - 1);
                            k -= 1;
                        }
                    }
                }
            }
        }
        let count = best.iter().filter(|b| b.0.is_finite()).count();
        (count, best.map(|b| b.1))
    }
}
