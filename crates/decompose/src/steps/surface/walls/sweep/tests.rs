use super::super::super::extract::tests::pictures_of;
use super::super::consistency::shades;
use super::super::tests::{FLOOR, VOXEL, crossed, glow};
use super::*;
use crate::steps::surface::splat_depth::DepthMap;
use crate::steps::surface::view::View;

/// Photos of a floor whose brightness is told by the place, and depth that hangs before it by a share of the distance.
fn hanging(brightness: impl Fn(Vec3) -> f32, share: f32) -> (Vec<View>, Vec<DepthMap>) {
    pictures_of(|_, view, at| {
        let (z, at) = crossed(view, at, 0.0);
        (brightness(at), (1.0 - share) * z)
    })
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
    sweep(&Photos::new(views, maps, &shades(views)), &region)
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
