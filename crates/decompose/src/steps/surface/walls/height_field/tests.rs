use super::super::super::extract::tests::pictures_of;
use super::super::consistency::shades;
use super::super::tests::{FLOOR, VOXEL, all_regions, crossed};
use super::*;
use crate::steps::surface::view::View;

/// Hills of a ground.
fn hills(p: Vec3) -> f32 {
    0.02 * (7.0 * p.x).sin() * (6.0 * p.y).cos()
}

/// Brightness that tells places of a ground apart.
fn patches(p: Vec3) -> f32 {
    0.4 + 0.1 * (5.0 * p.x + 1.0).sin() * (4.0 * p.y).cos()
}

/// Where a ray meets a ground of some height.
fn met(view: &View, at: [usize; 2], height: impl Fn(Vec3) -> f32) -> (f32, Vec3) {
    (0..20).fold(crossed(view, at, 0.0), |(_, p), _| crossed(view, at, height(p)))
}

/// Whether the floor is even where photos show ground of one height and Gaussians another, with noise of its own in each photo.
fn is_even_with(shown: impl Fn(Vec3) -> f32, told: impl Fn(Vec3) -> f32) -> bool {
    let (views, maps) = pictures_of(|i, view, at| {
        let noise = 0.03 * (1.3 * at[0] as f32 + 0.9 * at[1] as f32 + 1.7 * i as f32).sin();
        (patches(met(view, at, &shown).1), (1.0 + noise) * met(view, at, &told).0)
    });
    let regions = all_regions(&views, &maps);
    let shades = shades(&views);
    let photos = Photos::new(&views, &maps, &shades);
    is_even(&photos, &regions.iter().collect::<Vec<_>>(), &FLOOR, VOXEL)
}

#[test]
fn heights_that_photos_carry_are_no_floor() {
    assert!(!is_even_with(hills, hills));
    // Gaussians are too high and too low by as much again.
    assert!(!is_even_with(hills, |p| 2.0 * hills(p)));
}

#[test]
fn heights_that_only_gaussians_have_leave_a_floor_even() {
    assert!(is_even_with(|_| 0.0, hills));
    assert!(is_even_with(|_| 0.0, |p| 2.0 * hills(p)));
}

#[test]
fn a_height_field_has_the_heights_that_all_photos_show_together() {
    let (views, maps) = pictures_of(|_, view, at| (0.5, met(view, at, hills).0));
    let regions = all_regions(&views, &maps);
    let regions: Vec<&Region> = regions.iter().collect();
    let shades = shades(&views);
    let field = HeightField::new(&Photos::new(&views, &maps, &shades), &regions, &FLOOR, VOXEL);
    for i in 0..40 {
        let at = Vec3::new(0.3 * (i as f32).sin(), 0.3 * (0.7 * i as f32).cos(), 0.0);
        let height = field.height(at).unwrap();
        assert!((height - hills(at)).abs() < 0.004, "{height} for {}", hills(at));
    }
    let far = [50.0, -50.0, 1e30, f32::MAX, f32::INFINITY, f32::NAN];
    assert!(far.iter().all(|&x| field.height(Vec3::new(x, x, 0.0)).is_none()));
}
