//! A wall in the pictures left and right, and in none between.

use glam::DVec3;

use crate::steps::surface::room::tests::{maps, views};
use crate::steps::surface::splat_depth::DepthMap;
use crate::steps::surface::view::View;

use super::*;

const VOXEL: f32 = 0.01;
const WALL: Plane = Plane { normal: Vec3::NEG_Y, offset: -1.0 };

/// Three cameras before the left of a wall, three before its right, and one before the middle where `middle` says.
fn pictures(middle: bool, depth: impl Fn(usize, f32) -> f32) -> (Vec<View>, Vec<DepthMap>) {
    let at = |i: usize| {
        let x = [-1.0, 1.0, 0.0][i / 3];
        let eye = DVec3::new(x + 0.1 * (i % 3) as f64 - 0.1, 0.0, 0.5);
        [eye, DVec3::new(x, 1.0, 0.5)]
    };
    let views = views(at, if middle { 7 } else { 6 });
    let maps = maps(&views, &[WALL], |i, _, _, z| depth(i, z));
    (views, maps)
}

fn left_out((views, maps): &(Vec<View>, Vec<DepthMap>)) -> Option<Sheet> {
    let sheet = Sheet::new(WALL, views, maps, 2.5 * VOXEL, VOXEL, 0.04)?.with_openings();
    sheet.left_out(&Room::new(std::slice::from_ref(&sheet), views, maps, VOXEL))
}

#[test]
fn what_no_photo_shows_between_two_parts_of_a_wall_is_wall_and_what_is_beyond_them_is_not() {
    let part = left_out(&pictures(false, |_, z| z)).unwrap();
    let at = |x: f32| Vec3::new(x, 1.0, 0.5);
    assert!([-0.2, 0.0, 0.3].into_iter().all(|x| part.covers(at(x))));
    // Shown, and left of all that is shown.
    assert!([-1.0, 1.0, -1.8, 1.8].into_iter().all(|x| !part.covers(at(x))));
}

#[test]
fn a_wall_has_an_opening_where_a_photo_looks_through_and_none_where_something_hides_it() {
    let through = left_out(&pictures(true, |i, z| if i == 6 { 3.0 * z } else { z }));
    assert!(through.is_none_or(|part| !part.covers(Vec3::new(0.0, 1.0, 0.5))));
    let sky = left_out(&pictures(true, |i, z| if i == 6 { 0.0 } else { z }));
    assert!(sky.is_none_or(|part| !part.covers(Vec3::new(0.0, 1.0, 0.5))));
    let hidden = left_out(&pictures(true, |i, z| if i == 6 { 0.3 * z } else { z })).unwrap();
    assert!(hidden.covers(Vec3::new(0.0, 1.0, 0.5)));
}

#[test]
fn a_wall_that_is_shown_is_not_completed() {
    let (views, maps) = pictures(false, |_, z| z);
    let (views, maps) = (&views[..3], &maps[..3]);
    let sheet = Sheet::new(WALL, views, maps, 2.5 * VOXEL, VOXEL, 0.04).unwrap();
    let part = sheet.with_openings();
    let room = Room::new(&[], views, maps, VOXEL);
    assert!(part.left_out(&room).is_none_or(|p| !p.covers(Vec3::new(-1.0, 1.0, 0.5))));
}
