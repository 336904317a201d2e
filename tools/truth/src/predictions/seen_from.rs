//! Buffers of some views, as another view sees them.

use glam::{DVec3, Vec3};
use motes_math::median::median;
use motes_scene::ImageU8;

use super::{View, views};
use crate::score::truth_folder::{TruthBuffers, TruthFolder};

/// Share of the depth by which points of one surface differ within a pixel.
const DEPTH_TOLERANCE: f64 = 0.01;

/// Points of surfaces with what is known of them.
#[derive(Clone, Debug, Default)]
pub struct SurfaceCloud {
    points: Vec<(Seen, u8)>,
}

/// The surface behind a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Linear.
    pub base_color: Vec3,
    /// Unit, world.
    pub normal: Vec3,
    /// World.
    pub position: DVec3,
}

impl SurfaceCloud {
    /// What the test views of a folder show.
    ///
    /// # Errors
    /// When a buffer is missing or has another size.
    pub fn of_test_views(truth: &TruthFolder) -> anyhow::Result<Self> {
        let mut cloud = Self::default();
        for view in views(truth, "test")? {
            let (buffers, depth) = (truth.buffers(&view.name)?, truth.depth(&view.name)?);
            cloud.add(&view, &buffers, &depth.data);
        }
        Ok(cloud)
    }

    /// Adds the pixels of a view; `depth` is `[h, w]`, z in the camera, 0 for nothing.
    fn add(&mut self, view: &View, buffers: &TruthBuffers, depth: &[f32]) {
        let width = view.camera.width;
        for (i, z) in depth.iter().enumerate().filter(|(_, z)| **z > 0.0 && z.is_finite()) {
            let Some(position) = view.point(i % width, i / width, f64::from(*z)) else { continue };
            let of = |data: &[f32]| Vec3::from_slice(&data[3 * i..3 * i + 3]);
            let seen = Seen {
                base_color: of(&buffers.albedo.data),
                normal: of(&buffers.normal.data).normalize_or_zero(),
                position,
            };
            self.points.push((seen, buffers.ids.data[i]));
        }
    }

    /// Twice the median distance of the points from their middle, per axis the median; none without a point.
    pub fn extent(&self) -> Option<f32> {
        let axis = |c: usize| median(self.points.iter().map(|p| p.0.position[c]));
        let middle = DVec3::new(axis(0)?, axis(1)?, axis(2)?);
        let away = median(self.points.iter().map(|p| p.0.position.distance(middle)))?;
        Some(2.0 * away as f32)
    }

    /// The nearest surface behind every pixel of a view, means over its points there; none where no point of the pixel's object is.
    pub fn seen_from(&self, view: &View, ids: &ImageU8) -> Vec<Option<Seen>> {
        let n = view.camera.width * view.camera.height;
        let shown: Vec<(usize, f64, &Seen)> = self
            .points
            .iter()
            .filter_map(|(seen, id)| {
                let (pixel, depth) = view.project(seen.position)?;
                (ids.data[pixel] == *id).then_some((pixel, depth, seen))
            })
            .collect();
        let mut nearest = vec![f64::INFINITY; n];
        for (pixel, depth, _) in &shown {
            nearest[*pixel] = nearest[*pixel].min(*depth);
        }
        let none = (Vec3::ZERO, Vec3::ZERO, DVec3::ZERO, 0.0f32);
        let mut sums = vec![none; n];
        for (pixel, depth, seen) in shown {
            if depth <= nearest[pixel] * (1.0 + DEPTH_TOLERANCE) {
                let sum = &mut sums[pixel];
                sum.0 += seen.base_color;
                sum.1 += seen.normal;
                sum.2 += seen.position;
                sum.3 += 1.0;
            }
        }
        let mean = |(base_color, normal, position, count): (Vec3, Vec3, DVec3, f32)| {
            (count > 0.0 && normal.length() > 0.5 * count).then(|| Seen {
                base_color: base_color / count,
                normal: normal.normalize(),
                position: position / f64::from(count),
            })
        };
        sums.into_iter().map(mean).collect()
    }
}
