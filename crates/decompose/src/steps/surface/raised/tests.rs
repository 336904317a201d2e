//! A wall paper and a plate, as photos show them and as depth has them.

use glam::Vec3;

use super::super::extract::tests as extract_tests;
use super::super::planes::Plane;
use super::*;

/// Voxel and tolerance, unit world.
const VOXEL: f32 = 0.01;
const TOLERANCE: f32 = 2.5 * VOXEL;
/// Radius of the plate, and height of its top.
const RADIUS: f32 = 0.25;
const RISE: f32 = 6.0 * VOXEL;

/// Depth of a pixel's ray on a ground at z = 0 with a plate of a height.
fn depth(view: &View, ray: Vec3, rise: f32) -> f32 {
    let top = (rise - view.center.z) / ray.z;
    let is_plate = (view.center + ray * top).truncate().length() < RADIUS;
    if is_plate { top } else { -view.center.z / ray.z }
}

/// Photos of a plate of height `shown` in a textured ground, and depths of one of height `told`.
fn pictures(shown: f32, told: f32) -> (Vec<View>, Vec<DepthMap>) {
    extract_tests::pictures(0.1, &|v, ray| depth(v, ray, shown), &|v, ray| depth(v, ray, told))
}

/// Share of the pixels on the plate, its rim left out, that are put onto the ground.
fn put_share(shown: f32) -> f32 {
    let (views, mut maps) = pictures(shown, RISE);
    let plane = Plane { normal: Vec3::Z, offset: 0.0 };
    let sheet = Sheet::new(plane, &views, &maps, TOLERANCE, VOXEL, 4.0 * VOXEL).unwrap();
    let sheet = sheet.without_bumps(&[]);
    let mut on: Vec<Vec<bool>> = maps.iter().map(|m| vec![false; m.depth.len()]).collect();
    put_down(&[sheet], &views, &mut maps, &mut on, TOLERANCE, VOXEL);
    let (mut put, mut count) = (0.0, 0.0);
    for ((view, map), on) in views.iter().zip(&maps).zip(&on) {
        for (i, (&on, &z)) in on.iter().zip(&map.depth).enumerate() {
            let ray = view.pixel_ray([i % view.width, i / view.width]);
            let p = view.center + ray * depth(view, ray, RISE);
            assert!(!on || (view.center + ray * z).z.abs() < 1e-4, "{z} is not on the plane");
            assert!(!on || p.z > 0.0, "what lies on the ground stays");
            if p.z > 0.0 && p.truncate().length() < 0.9 * RADIUS {
                put += f32::from(u8::from(on));
                count += 1.0;
            }
        }
    }
    assert!(count > 1000.0, "{count}");
    put / count
}

#[test]
fn an_error_of_depth_is_told_from_a_thing() {
    let (paper, plate) = (put_share(0.0), put_share(RISE));
    assert!(paper > 0.98, "paper on the wall: {paper}");
    assert!(plate < 0.02, "a plate: {plate}");
}

#[test]
fn what_has_no_texture_stays_where_depth_has_it() {
    let (views, mut maps) = pictures(0.0, RISE);
    let gray = |mut view: View| {
        view.luma.fill(0.5);
        view
    };
    let views: Vec<View> = views.into_iter().map(gray).collect();
    let plane = Plane { normal: Vec3::Z, offset: 0.0 };
    let sheet = Sheet::new(plane, &views, &maps, TOLERANCE, VOXEL, 4.0 * VOXEL).unwrap();
    let mut on: Vec<Vec<bool>> = maps.iter().map(|m| vec![false; m.depth.len()]).collect();
    put_down(&[sheet.without_bumps(&[])], &views, &mut maps, &mut on, TOLERANCE, VOXEL);
    assert!(!on.iter().flatten().any(|&on| on));
}
