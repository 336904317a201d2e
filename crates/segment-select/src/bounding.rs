//! Planes that bound a scene: what things stand on, and walls.
//!
//! A scene in a room has several, and each is the background of what stands before it. A side of a thing is none: the floor
//! goes on behind it.

use glam::DVec3;

use crate::plane::{SupportPlane, area, largest};
use crate::view_data::Segment;

/// Planes looked for beside the largest.
const TRIES: usize = 6;
/// Share of the area that each of them needs.
const LEAST_SHARE: f32 = 0.04;
/// What lies behind one, as a share of its own area, at most.
const MOST_BEHIND: f32 = 0.1;
/// Cosine from which on two planes face the same way: what is found beside one that bounds a scene is smear of it.
const SAME: f32 = 0.94;
/// What things stand on faces up to within 37 degrees.
const FACING_UP: f64 = 0.8;

/// The planes that bound a scene, none where the largest does not; first the one that things stand on: that which faces `up`, if
/// one does, else the largest. `up` may be zero.
pub(crate) fn bounding_planes(
    segments: &[&Segment],
    cameras: &[DVec3],
    up: DVec3,
) -> Vec<SupportPlane> {
    let Some(first) = SupportPlane::find(segments, cameras) else { return Vec::new() };
    let all: Vec<&Segment> = segments.iter().copied().filter(|s| s.width > 0.0).collect();
    let least = LEAST_SHARE * area(&all);
    let mut found = vec![first];
    let mut left: Vec<&Segment> = all.iter().copied().filter(|s| !first.holds(s)).collect();
    for _ in 0..TRIES {
        let Some(next) = largest(&left, cameras).filter(|next| next.area >= least) else { break };
        let is_before = |eye: &DVec3| next.plane.height(eye.as_vec3()) > 0.0;
        let is_smear = |known: &SupportPlane| known.normal.dot(next.plane.normal) > SAME;
        let behind = next.area_behind(&all);
        if cameras.iter().all(is_before)
            && behind <= MOST_BEHIND * next.area
            && !found.iter().any(is_smear)
        {
            found.push(next.plane);
        }
        let before = left.len();
        left.retain(|s| !next.plane.holds(s));
        if left.len() == before {
            break;
        }
    }
    let facing = |plane: &SupportPlane| plane.normal.as_dvec3().dot(up);
    let upward = (0..found.len()).max_by(|&a, &b| facing(&found[a]).total_cmp(&facing(&found[b])));
    if let Some(upward) = upward.filter(|&k| facing(&found[k]) >= FACING_UP) {
        found.swap(0, upward);
    }
    found
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// A square of superpixels of side 0.1 from a corner, facing `normal`.
    fn square(corner: Vec3, sides: [Vec3; 2], normal: Vec3) -> Vec<Segment> {
        let cells = sides.map(|side| (side.length() / 0.1).round() as usize);
        let at = |i: usize, j: usize| {
            let place = |k: usize, cell: usize| sides[k] * ((cell as f32 + 0.5) / cells[k] as f32);
            corner + place(0, i) + place(1, j)
        };
        let of = |i: usize, j: usize| Segment {
            area_px: 80.0,
            point: at(i, j).to_array(),
            normal: normal.to_array(),
            width: 0.1,
            ..Segment::default()
        };
        (0..cells[0]).flat_map(|i| (0..cells[1]).map(move |j| of(i, j))).collect()
    }

    #[test]
    fn a_room_is_bounded_by_floor_and_wall_and_not_by_a_cupboard() {
        let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
        let floor = square(Vec3::ZERO, [3.0 * x, 1.5 * y], z);
        // The wall is larger than the floor; a cupboard stands before it.
        let wall = square(1.5 * y, [3.0 * x, 2.4 * z], -y);
        let front = square(x + 0.9 * y, [1.2 * x, 1.1 * z], -y);
        let top = square(x + 0.9 * y + 1.1 * z, [1.2 * x, 0.6 * y], z);
        let room = [floor, wall, front, top].concat();
        let segments: Vec<&Segment> = room.iter().collect();
        let cameras = [DVec3::new(1.0, -2.0, 1.6), DVec3::new(2.0, -2.0, 1.4)];
        let found = bounding_planes(&segments, &cameras, DVec3::new(0.0, 0.2, 0.97));
        let [floor, wall] = &found[..] else { panic!("{found:?}") };
        assert!(floor.normal.dot(z) > 0.99 && floor.offset.abs() < 0.01, "{floor:?}");
        assert!(wall.normal.dot(-y) > 0.99 && (wall.offset + 1.5).abs() < 0.01, "{wall:?}");
        // Cameras that say nothing of up: the largest first.
        let found = bounding_planes(&segments, &cameras, DVec3::ZERO);
        assert!(found[0].normal.dot(-y) > 0.99, "{found:?}");
        assert!(bounding_planes(&segments[..2], &cameras, DVec3::Z).is_empty());
    }
}
