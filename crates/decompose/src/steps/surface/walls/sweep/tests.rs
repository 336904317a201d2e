use glam::DVec3;
use motes_scene::UnitWorld;

use super::super::super::extract::tests::photos;
use super::super::tests::{FLOOR, VOXEL, crossed, glow};
use super::*;
use crate::steps::surface::splat_depth::DepthMap;
use crate::steps::surface::view::View;

/// Photos of a floor whose brightness is told by the place, and depth that hangs before it by a share of the distance.
fn hanging(brightness: impl Fn(Vec3) -> f32, share: f32) -> (Vec<View>, Vec<DepthMap>) {
    let mut photos = photos(12, 1.0, DVec3::ZERO);
    let mut maps = Vec::new();
    for photo in &mut photos {
        let view = View::new(photo, &UnitWorld::IDENTITY);
        let mut depth = Vec::new();
        for (k, pixel) in photo.radiance_linear.floats_mut().iter_mut().enumerate() {
            let (z, at) = crossed(&view, view.at(k as u32), 0.0);
            pixel.fill(brightness(at));
            depth.push((1.0 - share) * z);
        }
        maps.push(DepthMap { depth });
    }
    (photos.iter().map(|p| View::new(p, &UnitWorld::IDENTITY)).collect(), maps)
}

/// The plane of a rectangle in the middle of the first photo.
fn swept(views: &[View], maps: &[DepthMap]) -> Option<Plane> {
    let (w, h) = (views[0].width, views[0].height);
    let is_in = |&k: &u32| {
        let [x, y] = views[0].at(k);
        (w / 4..3 * w / 4).contains(&x) && (h / 4..3 * h / 4).contains(&y)
    };
    let pixels = (0..(w * h) as u32).filter(is_in).collect();
    let region = Region::new(0, pixels, &views[0], &maps[0], VOXEL);
    sweep(&Photos::new(views, maps), &region)
}

#[test]
fn shading_tells_a_plane_that_no_depth_is_near() {
    let (views, maps) = hanging(glow, 0.12);
    let plane = swept(&views, &maps).unwrap();
    let turned = plane.normal.angle_between(FLOOR.normal).to_degrees();
    println!("turned by {turned} degrees, offset {}", plane.offset);
    assert!(turned < 4.0, "turned by {turned} degrees");
    assert!(plane.offset.abs() < 0.02, "{}", plane.offset);
}

#[test]
fn one_brightness_tells_nothing_and_depth_that_is_right_needs_no_plane() {
    let (views, maps) = hanging(|_| 0.3, 0.12);
    assert!(swept(&views, &maps).is_none());
    let (views, maps) = hanging(glow, 0.0);
    assert!(swept(&views, &maps).is_none());
}

#[test]
fn descents_end_at_the_minimum_and_are_the_same_again() {
    let cost = |x: f32| (x - 0.7).powi(2);
    let descent =
        |key| descend(0.0f32, [key, 0], 200, 0.5, cost, |x, scale, [a, ..]| x + scale * a);
    let (least, at) = descent(1);
    assert!((at - 0.7).abs() < 0.01 && least == cost(at), "{at}");
    assert_eq!(descent(1), (least, at));
    assert_ne!(descent(2).1, at);
}
