//! A flat ground and a crumpled one, photographed.

use super::super::extract::tests as extract_tests;
use super::*;

/// Voxel and tolerance, unit world.
const VOXEL: f32 = 0.01;
const TOLERANCE: f32 = 2.5 * VOXEL;

/// Height of the ground over z = 0.
fn ground(height: f32, [x, y]: [f32; 2]) -> f32 {
    height * (9.0 * x).sin() * (8.0 * y).cos()
}

/// Photos of a textured ground, and its exact depth plus a wave of the given height over it.
fn pictures(height: f32, texture: f32, noise: f32) -> (Vec<View>, Vec<DepthMap>) {
    let shown = |view: &View, ray: Vec3| {
        let mut z = -view.center.z / ray.z;
        for _ in 0..20 {
            let p = view.center + ray * z;
            z = (ground(height, [p.x, p.y]) - view.center.z) / ray.z;
        }
        z
    };
    let told = |view: &View, ray: Vec3| {
        let z = shown(view, ray);
        let p = view.center + ray * z;
        z + noise * ((11.0 * p.x).cos() + (12.0 * p.y).sin())
    };
    extract_tests::pictures(texture, &shown, &told)
}

const LEVEL: Plane = Plane { normal: Vec3::Z, offset: 0.0 };

/// What the plane leaves over what depth leaves.
fn ratio(height: f32, texture: f32, noise: f32) -> f32 {
    let (views, maps) = pictures(height, texture, noise);
    let witnesses = Witnesses::new(&views, &maps, TOLERANCE, VOXEL);
    let rivals = witnesses.rivals(&fitted(LEVEL, &witnesses));
    assert!(rivals.len() > 1000, "{}", rivals.len());
    let sum = |of: fn(&Rivals) -> f32| rivals.iter().map(of).sum::<f32>();
    println!("{} {}", sum(|r| r.by_plane), sum(|r| r.by_depth));
    sum(|r| r.by_plane) / sum(|r| r.by_depth)
}

#[test]
fn noise_of_depth_is_told_from_bumps() {
    // Both lie a voxel and a half around the plane.
    let (table, blanket) = (ratio(0.0, 0.1, 0.75 * VOXEL), ratio(1.5 * VOXEL, 0.1, 0.0));
    assert!(table < 0.5, "a table is flat: {table}");
    assert!(blanket > 2.0, "a blanket is not: {blanket}");
}

#[test]
fn without_texture_plane_and_depth_are_alike() {
    let (views, maps) = pictures(0.0, 0.0, 0.75 * VOXEL);
    let witnesses = Witnesses::new(&views, &maps, TOLERANCE, VOXEL);
    for r in witnesses.rivals(&LEVEL) {
        assert!(r.by_plane < 1e-9 && r.by_depth < 1e-9, "{} {}", r.by_plane, r.by_depth);
    }
}

#[test]
fn a_plane_moves_to_where_the_photos_agree() {
    let (views, maps) = pictures(0.0, 0.1, 0.0);
    let witnesses = Witnesses::new(&views, &maps, TOLERANCE, VOXEL);
    let normal = Vec3::new(0.01, -0.008, 1.0).normalize();
    let found = fitted(Plane { normal, offset: -1.2 * VOXEL }, &witnesses);
    for p in [Vec3::ZERO, 0.4 * Vec3::X, -0.4 * Vec3::X, 0.4 * Vec3::Y, -0.4 * Vec3::Y] {
        let off = found.height(p) / VOXEL;
        assert!(off.abs() < 0.4, "off by {off} voxels at {p}");
    }
}

#[test]
fn a_capture_of_one_photo_or_none_has_no_witnesses() {
    let (mut views, mut maps) = pictures(0.0, 0.1, 0.0);
    for count in [1, 0] {
        views.truncate(count);
        maps.truncate(count);
        let witnesses = Witnesses::new(&views, &maps, TOLERANCE, VOXEL);
        assert_eq!(fitted(LEVEL, &witnesses), LEVEL);
        assert!(witnesses.rivals(&LEVEL).is_empty());
    }
}
