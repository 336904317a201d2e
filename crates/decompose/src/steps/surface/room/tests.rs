//! A floor and a wall, and a side of which depth is noise.

use glam::DVec3;
use motes_scene::{Pose, UnitWorld};

use super::super::extract::tests::photos;
use super::*;

const VOXEL: f32 = 0.01;
const CELL: f32 = 0.04;
const FLOOR: Plane = Plane { normal: Vec3::Z, offset: 0.0 };
const BACK: Plane = Plane { normal: Vec3::NEG_Y, offset: -1.0 };
const SIDE: Plane = Plane { normal: Vec3::X, offset: -0.9 };

/// Cameras on an arc before the wall, to the right.
pub(in super::super) fn views(eye_and_target: impl Fn(usize) -> [DVec3; 2], n: usize) -> Vec<View> {
    let mut photos = photos(n, 1.0, DVec3::ZERO);
    for (i, photo) in photos.iter_mut().enumerate() {
        let [eye, target] = eye_and_target(i);
        photo.camera_from_world = Pose::look_at(eye, target, DVec3::Z).unwrap();
    }
    photos.iter().map(|p| View::new(p, &UnitWorld::IDENTITY)).collect()
}

/// Depth of the nearest of some planes, as `depth` has it of each.
pub(in super::super) fn maps(
    views: &[View],
    planes: &[Plane],
    depth: impl Fn(usize, &Plane, Vec3, f32) -> f32,
) -> Vec<DepthMap> {
    let of = |(i, view): (usize, &View)| {
        let pixel = |k: u32| {
            let ray = view.pixel_ray(view.at(k));
            let seen = planes.iter().filter_map(|p| Some((p.depth(view, ray)?, p)));
            let nearest = seen.min_by(|a, b| a.0.total_cmp(&b.0));
            nearest.map_or(0.0, |(z, plane)| depth(i, plane, view.center + ray * z, z))
        };
        DepthMap { depth: (0..view.luma.len() as u32).map(pixel).collect() }
    };
    views.iter().enumerate().map(of).collect()
}

fn room_views() -> Vec<View> {
    let at = |i: usize| {
        let angle = 0.12 * (i as f64 - 3.5);
        let eye = DVec3::new(0.4 + 1.6 * angle.sin(), 1.0 - 2.4 * angle.cos(), 0.9);
        [eye, DVec3::new(-0.35, 0.8, 0.35)]
    };
    views(at, 8)
}

/// The sheets of a floor and of the back wall where `planes` has it, and the maps that the side is added to; its depth is off by up to
/// so many voxels here and there.
fn found(planes: &[Plane], off: f32) -> (Vec<Sheet>, Vec<View>, Vec<DepthMap>, usize) {
    let views = room_views();
    let mut maps = maps(&views, planes, |i, plane, p, z| {
        let wave = (9.0 * p.y + 7.0 * p.z + 1.3 * i as f32).sin();
        if *plane == SIDE { z * (1.0 + off * VOXEL * wave) } else { z }
    });
    let exact = planes.iter().filter(|p| **p != SIDE);
    let sheet = |p: &Plane| Sheet::new(*p, &views, &maps, 2.5 * VOXEL, VOXEL, CELL);
    let mut sheets: Vec<Sheet> = exact.filter_map(sheet).collect();
    let count = sheets.len();
    let on = add_sides(&mut sheets, count, &views, &mut maps, VOXEL, CELL);
    let on = on.iter().flatten().filter(|on| **on).count();
    (sheets, views, maps, on)
}

#[test]
fn a_side_is_found_at_right_angles_to_a_wall_by_noisy_depth_and_pixels_are_put_onto_it() {
    for off in [0.0, 8.0] {
        let (sheets, views, maps, on) = found(&[FLOOR, BACK, SIDE], off);
        assert_eq!(sheets.len(), 3, "off by {off}");
        let plane = sheets[2].plane;
        println!("off by {off}: {plane:?}, {on} pixels");
        assert!(plane.normal.dot(SIDE.normal) > 0.999, "{plane:?}");
        assert!((plane.offset - SIDE.offset).abs() <= off.max(0.1) * VOXEL, "{plane:?}");
        let lies_on = |(view, map): (&View, &DepthMap)| {
            let at = |k: u32| view.place(view.at(k), map.depth[k as usize]);
            (0..view.luma.len() as u32).filter(|k| plane.height(at(*k)).abs() < 1e-4).count()
        };
        let count: usize = views.iter().zip(&maps).map(lies_on).sum();
        assert!(count >= on && on > 5000, "{on} of {count}");
    }
}

#[test]
fn there_is_no_side_without_a_wall_and_none_of_what_is_no_plane() {
    assert_eq!(found(&[FLOOR, SIDE], 8.0).0.len(), 1);
    assert_eq!(found(&[FLOOR, BACK], 0.0).0.len(), 2);
    assert_eq!(found(&[FLOOR, BACK, SIDE], 60.0).0.len(), 2);
}

#[test]
fn a_wall_that_depth_has_askew_gives_way_to_the_side() {
    let views = room_views();
    let askew = Plane { normal: Vec3::new(0.985, -0.12, 0.12).normalize(), offset: -0.95 };
    let mut maps = maps(&views, &[FLOOR, BACK, askew], |_, _, _, z| z);
    let sheet = |p: Plane| Sheet::new(p, &views, &maps, 2.5 * VOXEL, VOXEL, CELL).unwrap();
    let mut sheets = [FLOOR, BACK, askew].map(sheet).into_iter().collect::<Vec<_>>();
    add_sides(&mut sheets, 2, &views, &mut maps, VOXEL, CELL);
    let normals: Vec<Vec3> = sheets.iter().map(|s| s.plane.normal).collect();
    assert_eq!(normals.len(), 3);
    assert!(normals[2].dot(SIDE.normal) > 0.999, "{normals:?}");
}

#[test]
fn nothing_is_seen_in_no_photo() {
    let mut sheets = Vec::new();
    assert!(add_sides(&mut sheets, 0, &[], &mut [], VOXEL, CELL).is_empty());
    assert!(sheets.is_empty() && Room::new(&sheets, &[], &[], VOXEL).meshes(&sheets).is_empty());
}
