//! A wall in the pictures left and right, and in none between.

use glam::DVec3;

use crate::steps::surface::planes::Plane;
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

fn completed((views, maps): &(Vec<View>, Vec<DepthMap>)) -> Option<Sheet> {
    let sheet = Sheet::new(WALL, views, maps, 2.5 * VOXEL, VOXEL, 0.04)?.with_openings();
    sheet.completed(&Room::new(std::slice::from_ref(&sheet), views, maps, VOXEL))
}

#[test]
fn what_no_photo_shows_between_two_parts_of_a_wall_is_wall_and_what_is_beyond_them_is_not() {
    let part = completed(&pictures(false, |_, z| z)).unwrap();
    let at = |x: f32| Vec3::new(x, 1.0, 0.5);
    assert!([-1.0, -0.2, 0.0, 0.3, 1.0].into_iter().all(|x| part.covers(at(x))));
    // Beside all that is shown.
    assert!([-1.8, 1.8].into_iter().all(|x| !part.covers(at(x))));
}

#[test]
fn a_wall_has_an_opening_where_a_photo_looks_through_and_none_where_something_hides_it() {
    let through = completed(&pictures(true, |i, z| if i == 6 { 3.0 * z } else { z }));
    assert!(through.is_none_or(|part| !part.covers(Vec3::new(0.0, 1.0, 0.5))));
    let sky = completed(&pictures(true, |i, z| if i == 6 { 0.0 } else { z }));
    assert!(sky.is_none_or(|part| !part.covers(Vec3::new(0.0, 1.0, 0.5))));
    let hidden = completed(&pictures(true, |i, z| if i == 6 { 0.3 * z } else { z })).unwrap();
    assert!(hidden.covers(Vec3::new(0.0, 1.0, 0.5)));
}

#[test]
fn a_wall_that_is_shown_stays_as_it_is() {
    let (views, maps) = pictures(false, |_, z| z);
    let (views, maps) = (&views[..3], &maps[..3]);
    let sheet = Sheet::new(WALL, views, maps, 2.5 * VOXEL, VOXEL, 0.04).unwrap();
    let shown = sheet.with_openings();
    let after = shown.completed(&Room::new(&[], views, maps, VOXEL));
    // The pictures end near -1.5 and -0.5, 0.1 and 0.9.
    let beside = [[-1.7, 0.5], [-0.3, 0.5], [-1.0, 1.05], [-1.0, -0.05]];
    let covers = |[x, z]: [f32; 2]| after.as_ref().is_some_and(|a| a.covers(Vec3::new(x, 1.0, z)));
    assert!(!beside.into_iter().any(covers));
}
