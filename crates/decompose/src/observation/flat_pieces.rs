//! Flat pieces of the surface: tables, floors and walls, which have meshes of their own.

use glam::Vec3;
use motes_math::disjoint_sets::DisjointSets;
use motes_scene::camera_path::mean_up;
use motes_scene::{Pose, Surface};

use super::photo::Photo;

/// Per triangle: 0 for things, else a number that names its flat piece.
pub(crate) fn sheet_of_triangles(surface: &Surface) -> Vec<u32> {
    let mut pieces = DisjointSets::new(surface.vertices.len());
    for t in &surface.triangles {
        t[1..].iter().for_each(|v| pieces.join(t[0], *v));
    }
    let roots = pieces.labels();
    let mut flat = vec![true; surface.vertices.len()];
    for (v, &r) in roots.iter().enumerate() {
        let (n, m) = (Vec3::from(surface.normals[v]), Vec3::from(surface.normals[r as usize]));
        flat[r as usize] &= n.dot(m) > 0.9999;
    }
    let of = |t: &[u32; 3]| roots[t[0] as usize];
    surface.triangles.iter().map(|t| if flat[of(t) as usize] { of(t) + 1 } else { 0 }).collect()
}

/// A flat piece faces up where its normal is within about 25 degrees of up as the cameras have it.
const FACES_UP: f32 = 0.9;

/// Unit vector away from the ground: the normal of the largest flat piece that faces up as the cameras have it, else
/// what the cameras say ([`mean_up`]); +z without photos.
pub fn up_in_world(surface: &Surface, photos: &[Photo]) -> Vec3 {
    let cameras: Vec<Pose> = photos.iter().map(|p| p.camera_from_world).collect();
    up_by_cameras(surface, &cameras)
}

fn up_by_cameras(surface: &Surface, cameras: &[Pose]) -> Vec3 {
    let of_cameras = mean_up(cameras).map_or(Vec3::Z, |up| up.as_vec3());
    let mut areas: std::collections::BTreeMap<u32, (f32, Vec3)> = std::collections::BTreeMap::new();
    for (t, sheet) in surface.triangles.iter().zip(sheet_of_triangles(surface)) {
        let [a, b, c] = t.map(|v| Vec3::from(surface.vertices[v as usize]));
        let normal = Vec3::from(surface.normals[t[0] as usize]);
        if sheet != 0 && normal.dot(of_cameras) > FACES_UP {
            areas.entry(sheet).or_insert((0.0, normal)).0 += (b - a).cross(c - a).length();
        }
    }
    let largest = areas.values().max_by(|a, b| a.0.total_cmp(&b.0));
    largest.map_or(of_cameras, |(_, normal)| *normal)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// Cameras on one side of a place that look down at it.
    fn cameras() -> Vec<Pose> {
        let on_an_arc = |k: i32| {
            let (sin, cos) = (0.3 * f64::from(k)).sin_cos();
            Pose::look_at(DVec3::new(3.0 * cos, 3.0 * sin, 2.0), DVec3::ZERO, DVec3::Z).unwrap()
        };
        (-2..=2).map(on_an_arc).collect()
    }

    /// A square whose normal leans by an angle from +z toward +x.
    fn square(lean_deg: f32) -> Surface {
        let (sin, cos) = lean_deg.to_radians().sin_cos();
        let corner = |u: f32, v: f32| [u * cos, v, -u * sin];
        Surface {
            vertices: vec![
                corner(-1.0, -1.0),
                corner(1.0, -1.0),
                corner(1.0, 1.0),
                corner(-1.0, 1.0),
            ],
            normals: vec![[sin, 0.0, cos]; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Surface::default()
        }
    }

    #[test]
    fn up_does_not_lean_toward_cameras_that_look_down_from_one_side() {
        let up = up_by_cameras(&Surface::default(), &cameras());
        assert!(up.dot(Vec3::Z) > 0.999, "{up}");
        assert_eq!(up_by_cameras(&Surface::default(), &[]), Vec3::Z);
    }

    #[test]
    fn level_ground_says_more_than_cameras_and_a_slope_says_nothing() {
        let up = up_by_cameras(&square(8.0), &cameras());
        assert!(up.dot(Vec3::Z) < 0.995, "the ground leans: {up}");
        let up = up_by_cameras(&square(40.0), &cameras());
        assert!(up.dot(Vec3::Z) > 0.999, "{up}");
    }
}
