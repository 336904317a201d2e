use super::super::super::extract::tests::pictures_of;
use super::super::Surroundings;
use super::super::consistency::{Photos, shades};
use super::super::pieces::pieces;
use super::super::tests::{FLOOR, VOXEL, all_regions, crossed, glow};
use super::*;

/// What `then` says of a floor that photos show, with this depth: from photo, place on the floor and distance.
fn asked<T>(depth: impl Fn(usize, Vec3, f32) -> f32, then: impl Fn(&Vote<'_>) -> T) -> T {
    let (views, maps) = pictures_of(|i, view, at| {
        let (z, p) = crossed(view, at, 0.0);
        (glow(p), depth(i, p, z))
    });
    let regions = all_regions(&views, &maps);
    let pieces = pieces(&regions, &views, &maps, VOXEL);
    let shades = shades(&views);
    let photos = Photos::new(&views, &maps, &shades);
    let (scene, uneven, known, told) = (Vec::new(), &[][..], &[][..], &[][..]);
    let around = Surroundings { scene, uneven, known, told, voxel: VOXEL };
    then(&Vote::new(&photos, &pieces, &around))
}

/// Before the floor.
fn hanging(i: usize, p: Vec3, z: f32) -> f32 {
    (0.85 + 0.04 * (3.0 * p.x + i as f32).sin()) * z
}

/// What becomes of a plane over a floor that depth hangs before, beside others.
fn squared(plane: Plane, others: &[Vec3]) -> Plane {
    let others: Vec<Plane> = others.iter().map(|&normal| Plane { normal, offset: -2.0 }).collect();
    asked(hanging, |vote| at_right_angles(vote, plane, &others, 1))
}

/// A plane over the floor, turned.
const SKEWED: Vec3 = Vec3::new(0.03, -0.02, 1.0);

#[test]
fn a_plane_goes_to_where_depth_has_much_of_it() {
    let skewed = Plane { normal: SKEWED.normalize(), offset: 0.005 };
    let half = |i: usize, p: Vec3, z| {
        if (5.0 * p.y + i as f32).sin() > 0.0 { z } else { hanging(i, p, z) }
    };
    let plane = asked(half, |vote| on_depth(vote, skewed));
    assert!(turned(&plane) < 0.2, "turned by {} degrees", turned(&plane));
    assert!(plane.offset.abs() < 0.1 * VOXEL, "{}", plane.offset);
}

#[test]
fn a_plane_stays_where_depth_has_little_of_it_or_photos_are_against_it() {
    let skewed = Plane { normal: SKEWED.normalize(), offset: 0.005 };
    assert_eq!(asked(hanging, |vote| on_depth(vote, skewed)), skewed);
    // Depth that lies on the turned plane, about the floor.
    let wrong = |_, p: Vec3, z| z * (1.0 + 0.5 * SKEWED.truncate().dot(p.truncate()));
    assert_eq!(asked(wrong, |vote| on_depth(vote, FLOOR)), FLOOR);
}

fn turned(plane: &Plane) -> f32 {
    plane.normal.angle_between(FLOOR.normal).to_degrees()
}

#[test]
fn a_floor_stands_at_right_angles_to_two_walls() {
    let plane = Plane { normal: Vec3::new(0.01, -0.015, 1.0).normalize(), offset: 0.003 };
    let square = squared(plane, &[Vec3::X, Vec3::Y, Vec3::new(0.02, 0.999, 0.0).normalize()]);
    println!("{square:?}");
    assert!(turned(&square) < 1e-3, "turned by {} degrees", turned(&square));
    assert!(square.offset.abs() < VOXEL, "{}", square.offset);
}

#[test]
fn a_floor_stays_where_photos_are_against_the_right_angle() {
    let slant = Vec3::new(1.0, 0.0, 0.15).normalize();
    let square = squared(FLOOR, &[slant]);
    assert!(turned(&square) < 1.0, "turned by {} degrees", turned(&square));
    let far = Vec3::new(1.0, 0.0, 0.5).normalize();
    assert_eq!(squared(FLOOR, &[far]), FLOOR);
}

#[test]
fn directions_at_right_angles_are_the_nearest() {
    let direction = Vec3::new(0.1, -0.2, 1.0).normalize();
    assert_eq!(square(direction, &[]), direction);
    let one = square(direction, &[Vec3::X]);
    assert!(one.x.abs() < 1e-6 && one.angle_between(direction) < 0.11, "{one}");
    let two = square(-direction, &[Vec3::X, Vec3::Y]);
    assert!((two + Vec3::Z).length() < 1e-6, "{two}");
}
