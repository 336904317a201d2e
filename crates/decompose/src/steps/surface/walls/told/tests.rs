//! A bare floor with a thing on it, both told by shading, and depth that knows nothing of the floor.

use super::super::super::extract::tests::pictures_of;
use super::super::super::planes::samples;
use super::super::tests::{DISK, FLOOR, VOXEL, all_regions, counted, crossed, glow, on_disk};
use super::*;

/// Photos, and depth that is right on the disk and hangs before the floor by a share of the distance that differs from photo to photo
/// and from place to place.
fn pictures(share: f32) -> (Vec<View>, Vec<DepthMap>) {
    pictures_of(|i, view, at| {
        let is_disk = on_disk(view, at);
        let (z, p) = crossed(view, at, if is_disk { DISK.1 } else { 0.0 });
        let wave = 1.0 + 0.3 * (3.0 * p.x + 2.0 * p.y + 1.7 * i as f32).sin();
        if is_disk { (0.5 * glow(p), z) } else { (glow(p), (1.0 - share * wave) * z) }
    })
}

fn found(views: &[View], maps: &mut [DepthMap]) -> Told {
    let regions = all_regions(views, maps);
    let around = |maps: &[DepthMap]| Surroundings {
        scene: samples(views, maps, 4),
        uneven: &[],
        known: &[],
        told: &[],
        voxel: VOXEL,
    };
    told(&regions, views, maps, around, 0.01)
}

#[test]
fn a_floor_that_no_depth_is_near_is_found_and_the_thing_on_it_stays() {
    let (views, before) = pictures(0.12);
    let mut maps = before.clone();
    let told = found(&views, &mut maps);
    assert_eq!(told.planes.len(), 1, "{:?}", told.planes);
    let plane = told.planes[0];
    let turned = plane.normal.angle_between(FLOOR.normal).to_degrees();
    let [floor, put, disk, kept] = counted(&plane, &views, [&before, &maps], |_, _, _| true);
    println!(
        "turned by {turned} degrees, offset {}, {put} of {floor} put, {kept} of {disk} kept",
        plane.offset
    );
    assert!(turned < 2.0 && plane.offset.abs() < VOXEL, "{turned} {}", plane.offset);
    assert!(put * 10 > floor * 8, "{put} of {floor}");
    assert!(kept * 100 > disk * 97, "{kept} of {disk}");
    let marked = told.on.iter().flatten().filter(|on| **on).count();
    assert!(marked >= put, "{marked} for {put}");
}

#[test]
fn depth_that_is_right_stays() {
    let (views, before) = pictures(0.0);
    let mut maps = before.clone();
    assert!(found(&views, &mut maps).planes.is_empty());
    assert!(maps.iter().zip(&before).all(|(a, b)| a.depth == b.depth));
}

#[test]
fn walls_are_the_same_at_any_number_of_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (views, mut maps) = pictures(0.12);
        let told = pool.install(|| found(&views, &mut maps));
        (told.planes, maps.into_iter().map(|m| m.depth).collect::<Vec<_>>())
    };
    assert!(run(1) == run(3));
}
