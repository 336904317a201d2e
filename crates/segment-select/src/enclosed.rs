//! What lies inside a set of superpixels.
//!
//! Solid things do not interpenetrate: what lies in the convex hull of a set is more often of the same thing
//! than of another, as the strands of a knot, the handle of a cup or a leg between others. The hull is
//! approximated by slabs in fixed directions (k-DOP: Klosowski et al. 1998, "Efficient collision detection
//! using bounding volume hierarchies of k-DOPs").

use glam::Vec3;
use rayon::prelude::*;

use crate::index::SceneIndex;
use crate::seeds::membership;
use crate::walks::Mark;

/// Slabs. They bound a ball to 2 % of its radius.
const SLABS: usize = 49;
/// Share of the points beyond each side of a slab: single superpixels stray.
const OUTER: f32 = 0.01;
/// Each side of a slab is moved in by this share of its thickness: what touches is outside.
const INSET: f32 = 0.05;
/// Superpixels lower than this many sides above the support plane may be of it, seen through a hole.
const CLEAR: f32 = 3.0;

/// Directions spread over half the sphere (Fibonacci lattice).
fn direction(k: usize) -> Vec3 {
    let golden = std::f32::consts::PI * (1.0 + 5f32.sqrt());
    let k = k as f32 + 0.5;
    let z = 1.0 - k / SLABS as f32;
    let (sin, cos) = (k * golden).sin_cos();
    Vec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z
}

/// The superpixels that lie inside `set` without being of it or excluded, and their area as a share of its.
pub(crate) fn enclosed(index: &SceneIndex, set: &[u32], marks: &[Mark]) -> (Vec<u32>, f32) {
    let is_in = membership(index, set);
    let points: Vec<Vec3> = set
        .iter()
        .map(|&n| index.segment(n))
        .filter(|s| s.width > 0.0)
        .map(|s| s.point.into())
        .collect();
    let Some(last) = points.len().checked_sub(1) else { return (Vec::new(), 0.0) };
    let slab = |k: usize| {
        let direction = direction(k);
        let mut along: Vec<f32> = points.iter().map(|p| direction.dot(*p)).collect();
        let outer = (OUTER * last as f32) as usize;
        let low = *along.select_nth_unstable_by(outer, f32::total_cmp).1;
        let high = *along.select_nth_unstable_by(last - outer, f32::total_cmp).1;
        let inset = INSET * (high - low);
        (direction, low + inset, high - inset)
    };
    let slabs: Vec<(Vec3, f32, f32)> = (0..SLABS).into_par_iter().map(slab).collect();
    let is_inside = |n: &u32| {
        let segment = index.segment(*n);
        let point = Vec3::from(segment.point);
        let is_clear =
            || index.planes.iter().all(|p| p.height(point) > p.reach(CLEAR, segment.width));
        !is_in[*n as usize]
            && marks[*n as usize] != Mark::Negative
            && segment.width > 0.0
            && slabs.iter().all(|(d, low, high)| (*low..=*high).contains(&d.dot(point)))
            && is_clear()
    };
    let found: Vec<u32> = (0..index.nodes() as u32).into_par_iter().filter(is_inside).collect();
    let area = |nodes: &[u32]| nodes.iter().map(|&n| index.area(n)).sum::<f32>();
    let share = area(&found) / area(set).max(1e-12);
    (found, share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view_data::{Segment, ViewData};
    use motes_raster::LabelVotes;
    use motes_scene::{Pinhole, Pose};

    #[test]
    fn what_is_inside_a_shell_is_found_and_what_touches_it_is_not() {
        let shell = 400;
        let on_shell = |k: usize| direction(k % SLABS) * if k < 2 * SLABS { 1.0 } else { 0.97 };
        let sign = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let mut points: Vec<Vec3> = (0..shell).map(|k| on_shell(k) * sign(k / SLABS)).collect();
        // Inside, inside but excluded, touching, outside.
        points.extend([Vec3::ZERO, Vec3::splat(0.1), Vec3::X * 1.02, Vec3::X * 1.5]);
        let n = points.len();
        let segment = |p: &Vec3| Segment {
            area_px: 1.0,
            point: p.to_array(),
            width: 0.1,
            ..Segment::default()
        };
        let view = ViewData {
            camera: Pinhole { fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5, width: n, height: 1 },
            camera_from_world: Pose::IDENTITY,
            labels: (0..n as u32).collect(),
            depth: vec![1.0; n],
            segments: points.iter().map(segment).collect(),
            borders: Vec::new(),
            votes: LabelVotes { offsets: vec![0; n + 1], gaussians: vec![], weights: vec![] },
        };
        let index = SceneIndex::new(vec![0], vec![view], 0);
        let set: Vec<u32> = (0..shell as u32).collect();
        let mut marks = vec![Mark::Free; n];
        marks[shell + 1] = Mark::Negative;
        let (inside, share) = enclosed(&index, &set, &marks);
        assert_eq!(inside, [shell as u32]);
        assert!((share - 1.0 / shell as f32).abs() < 1e-6, "{share}");
    }
}
