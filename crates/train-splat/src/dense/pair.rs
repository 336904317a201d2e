//! Which photos to match with, and how their pixels map.

use glam::{Mat3, Vec3};
use motes_scene::SparsePoints;

use super::photo::Photo;

/// Photos that a photo is matched with.
const NEIGHBORS: usize = 4;
/// Angle between two lines of sight that a match gains most from, radians: less and the depth is
/// uncertain, more and the patch looks different.
const BEST_ANGLE: f32 = 0.17;

/// The plane-induced map into a second photo: `(x', y') ~ map (x, y, 1) + inverse_depth · shift`.
pub(super) struct Pair {
    pub(super) other: usize,
    pub(super) map: Mat3,
    pub(super) shift: Vec3,
}

impl Pair {
    fn new(photos: &[Photo], i: usize, other: usize) -> Self {
        let (a, b) = (&photos[i], &photos[other]);
        let intrinsics = |p: &Photo| {
            let c = &p.camera;
            Mat3::from_cols(
                Vec3::new(c.fx as f32, 0.0, 0.0),
                Vec3::new(0.0, c.fy as f32, 0.0),
                Vec3::new(c.cx as f32, c.cy as f32, 1.0),
            )
        };
        let b_from_a = b.rotation * a.rotation.transpose();
        let translation = b.rotation * (a.center - b.center);
        Self {
            other,
            map: intrinsics(b) * b_from_a * intrinsics(a).inverse(),
            shift: intrinsics(b) * translation,
        }
    }

    /// Pixel of the second photo; `None` behind it.
    #[inline]
    pub(super) fn transfer(&self, x: f32, y: f32, inverse_depth: f32) -> Option<(f32, f32)> {
        let q = self.map * Vec3::new(x, y, 1.0) + self.shift * inverse_depth;
        (q.z > 1e-6).then(|| (q.x / q.z, q.y / q.z))
    }
}

/// The photos that see most of what photo `i` sees, under useful angles.
pub(super) fn neighbors(photos: &[Photo], i: usize, sparse: &SparsePoints) -> Vec<Pair> {
    let mut scores: Vec<(f32, usize)> = (0..photos.len()).map(|k| (0.0, k)).collect();
    // Every photo pair shares thousands of points; a few hundred rank the pairs as well.
    let stride = (sparse.len() / 2000).max(1);
    for position in sparse.positions.iter().step_by(stride) {
        let position = Vec3::from(*position);
        let Some((.., z)) = photos[i].project(position) else { continue };
        let sight = (position - photos[i].center).normalize_or_zero();
        for (score, k) in &mut scores {
            let other = &photos[*k];
            let Some((.., other_z)) = other.project(position) else { continue };
            let angle = sight.angle_between((position - other.center).normalize_or_zero());
            let by_angle = (-((angle / BEST_ANGLE).max(1e-3).ln()).powi(2)).exp();
            // Patches of very different size do not compare.
            let by_scale = (-((z / other_z).ln() / 0.5).powi(2)).exp();
            *score += by_angle * by_scale;
        }
    }
    scores.retain(|&(score, k)| k != i && score > 0.0);
    scores.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    scores.truncate(NEIGHBORS);
    scores.iter().map(|&(_, k)| Pair::new(photos, i, k)).collect()
}
