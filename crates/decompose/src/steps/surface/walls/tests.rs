//! A bare floor under a thing, with the torn depth that Gaussians have there.

use super::super::extract::tests::pictures_of;
use super::super::planes::samples;
use super::super::sheet::Sheet;
use super::*;

/// Voxel and tolerance, unit world.
pub(super) const VOXEL: f32 = 0.01;
const TOLERANCE: f32 = 2.5 * VOXEL;
pub(super) const FLOOR: Plane = Plane { normal: Vec3::Z, offset: 0.0 };
/// A disk over the floor: radius and height.
pub(super) const DISK: (f32, f32) = (0.2, 0.15);

/// Where a ray crosses the level of a height.
pub(super) fn crossed(view: &View, pixel: [usize; 2], height: f32) -> (f32, Vec3) {
    let ray = view.pixel_ray(pixel);
    let z = (height - view.center.z) / ray.z;
    (z, view.center + ray * z)
}

/// Whether a pixel shows the disk.
pub(super) fn on_disk(view: &View, pixel: [usize; 2]) -> bool {
    crossed(view, pixel, DISK.1).1.truncate().length() < DISK.0
}

/// Photos of a bare floor and a darker disk over it, and their depth; that of the floor is torn by a share of it.
fn pictures(torn: f32) -> (Vec<View>, Vec<DepthMap>) {
    pictures_of(|i, view, at| {
        if on_disk(view, at) {
            return (0.05, crossed(view, at, DISK.1).0);
        }
        // Another wave in every photo, and more of it toward the camera.
        let (x, y, i) = (at[0] as f32, at[1] as f32, i as f32);
        let wave = (0.5 * x + 1.7 * i).sin() * (0.4 * y - 0.9 * i).cos();
        (0.5, crossed(view, at, 0.0).0 * (1.0 - torn * (wave + 2.0 * wave.max(0.5) - 1.0)))
    })
}

/// Of the pixels beside the disk that count, how many lie on a plane, and of those of the disk, how many have kept their depth.
pub(super) fn counted(
    plane: &Plane,
    views: &[View],
    [before, maps]: [&[DepthMap]; 2],
    counts: impl Fn(&View, [usize; 2], f32) -> bool,
) -> [usize; 4] {
    let [mut floor, mut put, mut disk, mut kept] = [0; 4];
    for ((view, map), before) in views.iter().zip(maps).zip(before) {
        for (k, (&z, &was)) in map.depth.iter().zip(&before.depth).enumerate() {
            let at = [k % view.width, k / view.width];
            if on_disk(view, at) {
                disk += 1;
                kept += usize::from(z == was);
            } else if counts(view, at, was) {
                floor += 1;
                put += usize::from(plane.height(view.place(at, z)).abs() < 1e-4);
            }
        }
    }
    [floor, put, disk, kept]
}

/// The walls of pictures whose pixels count where `counts` says, and their regions.
fn found(
    views: &[View],
    maps: &[DepthMap],
    [uneven, known, told]: [&[Plane]; 3],
    counts: impl Fn(&View, [usize; 2]) -> bool,
) -> (Vec<Wall>, Vec<Region>) {
    let texture = |view: &View| {
        let of = |k| f32::from(!counts(view, [k % view.width, k / view.width]));
        (0..view.width * view.height).map(of).collect()
    };
    let textures: Vec<Vec<f32>> = views.iter().map(texture).collect();
    let regions = bare_regions(views, maps, &textures, VOXEL);
    let scene = samples(views, maps, 4);
    let witnesses = Witnesses::new(views, maps, TOLERANCE, VOXEL);
    let around = Surroundings { scene, uneven, known, told, voxel: VOXEL };
    (walls(&regions, views, &around, &witnesses, 0.01), regions)
}

#[test]
fn a_bare_floor_is_found_in_torn_depth_and_the_thing_on_it_stays() {
    let (views, mut maps) = pictures(0.06);
    let (walls, regions) = found(&views, &maps, [&[]; 3], |_, _| true);
    assert_eq!(walls.len(), 1);
    let plane = walls[0].plane;
    let turned = plane.normal.angle_between(Vec3::Z).to_degrees();
    println!("turned by {turned} degrees, {} voxels off", plane.offset / VOXEL);
    assert!(turned < 3.0, "turned by {turned} degrees");
    assert!(plane.offset.abs() < 4.0 * VOXEL, "{} voxels off", plane.offset / VOXEL);

    let before = maps.clone();
    flatten(&walls, &regions, &views, &mut maps, VOXEL);
    let [floor, put, disk, kept] = counted(&plane, &views, [&before, &maps], |_, _, _| true);
    println!("{put} of {floor} put, {kept} of {disk} kept");
    assert!(put * 10 > floor * 8, "{put} of {floor}");
    assert!(kept * 100 > disk * 99, "{kept} of {disk}");
}

#[test]
fn a_bare_thing_before_something_else_is_no_wall() {
    let (views, maps) = pictures(0.0);
    let (walls, regions) = found(&views, &maps, [&[]; 3], on_disk);
    assert!(!regions.is_empty());
    assert!(walls.is_empty(), "{:?}", walls.iter().map(|w| w.plane).collect::<Vec<_>>());
}

#[test]
fn a_part_of_uneven_ground_is_no_wall() {
    let (views, maps) = pictures(0.06);
    let uneven = Plane { normal: Vec3::new(0.1, 0.0, 1.0).normalize(), offset: 0.0 };
    assert!(found(&views, &maps, [&[uneven], &[], &[]], |_, _| true).0.is_empty());
}

#[test]
fn what_is_askew_to_walls_that_photos_tell_is_no_wall() {
    let (views, maps) = pictures(0.06);
    let count = |x: f32, z: f32| {
        let told = Plane { normal: Vec3::new(x, 0.0, z).normalize(), offset: -2.0 };
        found(&views, &maps, [&[], &[], &[told]], |_, _| true).0.len()
    };
    assert_eq!([count(1.0, 0.5), count(-0.5, 1.0), count(1.0, 1.0)], [0; 3]);
    assert_eq!([count(1.0, 0.05), count(0.05, 1.0), count(-0.05, -1.0)], [1; 3]);
}

/// The depth of a floor that rises toward one side, and a plane that is known.
fn beside_known(torn: f32, rise: f32, known: Plane) -> usize {
    let (views, mut maps) = pictures(torn);
    let slope = Vec3::new(rise, 0.0, 1.0).normalize();
    let risen = Plane { normal: slope, offset: 0.0 };
    for (view, map) in views.iter().zip(&mut maps) {
        for (k, z) in map.depth.iter_mut().enumerate() {
            let at = [k % view.width, k / view.width];
            if let Some(on_slope) = risen.depth(view, view.pixel_ray(at))
                && !on_disk(view, at)
            {
                *z *= on_slope / crossed(view, at, 0.0).0;
            }
        }
    }
    let count = |known: &[Plane]| found(&views, &maps, [&[], known, &[]], |_, _| true).0.len();
    assert_eq!(count(&[]), 1);
    count(&[known])
}

#[test]
fn a_part_of_a_known_plane_whose_depth_is_wrong_is_no_wall() {
    // Photos disagree about the floor by as much as it rises over the plane.
    assert_eq!(beside_known(0.06, 0.08, FLOOR), 0);
    // They agree that a floor lies under the plane of a table.
    assert_eq!(beside_known(0.0, 0.0, Plane { offset: 0.3, ..FLOOR }), 1);
    // A wall that stands on the plane.
    assert_eq!(beside_known(0.06, 0.0, Plane { normal: Vec3::X, offset: -2.0 }), 1);
}

#[test]
fn a_shape_that_photos_agree_about_is_no_wall() {
    let (views, mut maps) = pictures(0.0);
    for (view, map) in views.iter().zip(&mut maps) {
        for (k, z) in map.depth.iter_mut().enumerate() {
            let at = [k % view.width, k / view.width];
            if !on_disk(view, at) {
                let p = crossed(view, at, 0.0).1;
                *z = crossed(view, at, 2.0 * VOXEL * ((9.0 * p.x).sin() * (8.0 * p.y).cos())).0;
            }
        }
    }
    assert!(found(&views, &maps, [&[]; 3], |_, _| true).0.is_empty());
}

#[test]
fn the_largest_plane_is_found_where_depth_is_exact() {
    let (views, maps) = pictures(0.0);
    let (walls, _) = found(&views, &maps, [&[]; 3], |_, _| true);
    assert_eq!(walls.len(), 1);
    assert!(walls[0].plane.normal.angle_between(Vec3::Z) < 1e-3);
    assert!(walls[0].plane.offset.abs() < 1e-3);
}

#[test]
fn an_opening_stays_open_and_what_a_thing_hides_is_closed() {
    let (views, mut maps) = pictures(0.0);
    // A window of a wall: what is seen through it lies behind.
    let window = |p: Vec3| (p.x - 0.45).abs().max(p.y.abs()) < 0.16;
    for (view, map) in views.iter().zip(&mut maps) {
        for (k, z) in map.depth.iter_mut().enumerate() {
            let at = [k % view.width, k / view.width];
            if !on_disk(view, at) && window(crossed(view, at, 0.0).1) {
                *z = crossed(view, at, -1.0).0;
            }
        }
    }
    let cell = 2.0 * VOXEL;
    let sheet = Sheet::new(FLOOR, &views, &maps, TOLERANCE, VOXEL, cell).unwrap().with_openings();
    assert!(!sheet.covers(Vec3::new(0.45, 0.0, 0.0)));
    assert!(sheet.covers(Vec3::new(-0.45, 0.0, 0.0)));
    assert!(sheet.covers(Vec3::ZERO), "the disk hides it");
}

/// The regions of photos that have no texture anywhere.
pub(super) fn all_regions(views: &[View], maps: &[DepthMap]) -> Vec<Region> {
    let textures: Vec<Vec<f32>> = views.iter().map(|v| vec![0.0; v.luma.len()]).collect();
    bare_regions(views, maps, &textures, VOXEL)
}

#[test]
fn a_region_goes_on_where_some_channels_are_clipped_and_ends_where_all_are() {
    let (mut views, maps) = pictures(0.0);
    let mut marked = |shown: Shown| {
        for view in &mut views {
            let left = (0..view.shown.len()).filter(|k| k % view.width < view.width / 3);
            left.for_each(|k| view.shown[k] = shown);
        }
        let regions = all_regions(&views, &maps);
        regions.iter().map(|region| region.pixels.len()).sum::<usize>() as f32
    };
    let whole = marked(Shown::Whole);
    let (clipped, burnt_out) = (marked(Shown::Clipped), marked(Shown::BurntOut));
    assert!(clipped == whole && burnt_out < 0.7 * whole, "{whole} {clipped} {burnt_out}");
    assert_eq!(marked(Shown::Nothing), burnt_out, "a mask hides it");
}

/// Brightness that tells the places of a bare floor apart, as the glow of a lamp does.
pub(super) fn glow(p: Vec3) -> f32 {
    0.2 + 0.3 * (-2.0 * (p - Vec3::new(0.3, 0.2, 0.0)).length_squared()).exp()
}

/// Photos of the floor and a disk a tenth darker; a part of the floor hangs before itself by 8 % of the distance in the photos that
/// `hangs` names.
fn hanging(hangs: impl Fn(usize) -> bool + Sync) -> (Vec<View>, Vec<DepthMap>) {
    pictures_of(|i, view, at| {
        let height = if on_disk(view, at) { DISK.1 } else { 0.0 };
        let (z, p) = crossed(view, at, height);
        let brightness = if height == 0.0 { glow(p) } else { 0.9 * glow(p) };
        (brightness, if height == 0.0 && hangs(i) && p.x > 0.25 { 0.92 * z } else { z })
    })
}

/// Of the pixels that hang, how many were put onto the floor, and of those of the disk, how many have kept their depth.
fn put_down(views: &[View], maps: [&[DepthMap]; 2]) -> [usize; 4] {
    let hung = |view: &View, at, was| was < 0.95 * crossed(view, at, 0.0).0;
    let counts = counted(&FLOOR, views, maps, hung);
    println!("{} of {} put, {} of {} kept", counts[1], counts[0], counts[3], counts[2]);
    assert!(counts[0] > 10_000, "{counts:?}");
    counts
}

#[test]
fn what_hangs_before_a_wall_in_most_photos_is_put_onto_it_and_a_thing_of_nearly_its_color_is_not() {
    let (views, mut maps) = hanging(|i| i % 4 > 0);
    let regions = all_regions(&views, &maps);
    let straight = |r: &usize| regions[*r].view.is_multiple_of(4);
    let walls = [Wall { plane: FLOOR, regions: (0..regions.len()).filter(straight).collect() }];
    let before = maps.clone();
    spread(&walls, &regions.iter().collect::<Vec<_>>(), &views, &mut maps, VOXEL);
    let [hanging, put, disk, kept] = put_down(&views, [&before, &maps]);
    assert!(put * 10 > hanging * 9, "{put} of {hanging}");
    assert!(kept * 100 > disk * 97, "{kept} of {disk}");
}

#[test]
fn a_wall_goes_on_where_it_hangs_in_all_photos_but_not_behind_another() {
    let (views, before) = hanging(|_| true);
    let regions = all_regions(&views, &before);
    let after = |planes: &[Plane]| {
        let mut maps = before.clone();
        spread_to_rest(planes, &regions, &views, &mut maps, VOXEL);
        put_down(&views, [&before, &maps])
    };
    let [hanging, put, disk, kept] = after(&[FLOOR]);
    assert!(put * 10 > hanging * 8, "{put} of {hanging}");
    assert!(kept * 100 > disk * 97, "{kept} of {disk}");
    let above = Plane { offset: 0.3, ..FLOOR };
    let [_, behind, _, kept] = after(&[FLOOR, above]);
    assert!(behind == 0 && kept == disk, "{behind}, {kept} of {disk}");

    // No other photo knows the floor there.
    let mut maps = before.clone();
    let walls = [Wall { plane: FLOOR, regions: (0..regions.len()).collect() }];
    spread(&walls, &regions.iter().collect::<Vec<_>>(), &views, &mut maps, VOXEL);
    let [_, by_walls, ..] = put_down(&views, [&before, &maps]);
    assert!(by_walls * 2 < put, "{by_walls} of {put}");
}
