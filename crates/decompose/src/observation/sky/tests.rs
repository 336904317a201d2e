//! Photos of a ball on a plain, under a sky.

use glam::{DVec3, Vec3};
use motes_scene::{ImageF32, Pinhole, Pose, Surface};

use super::*;
use crate::observation::{Photo, TracedSurface, ViewRays};
use crate::toy_ball::ball;

const SIZE: [usize; 2] = [120, 90];
const VIEWS: usize = 6;

/// What is shown from a place in a direction.
type Behind<'a> = dyn Fn(Vec3, Vec3) -> Vec3 + 'a;

fn camera() -> Pinhole {
    let [width, height] = SIZE;
    Pinhole { width, height, fx: 90.0, fy: 90.0, cx: 60.0, cy: 45.0 }
}

/// A photo of the ball; `behind` is what it shows beside it, from where it stands and in a direction.
fn photo(k: usize, behind: &Behind<'_>, below: &dyn Fn(Vec3) -> Vec3) -> Photo {
    let [width, height] = SIZE;
    let turn = k as f64 * 0.5;
    let eye = DVec3::new(4.0 * turn.cos(), 4.0 * turn.sin(), 0.2 + 0.1 * k as f64);
    let mut out = Photo {
        name: k.to_string(),
        light: 0,
        gain: [1.0; 3],
        camera: camera(),
        camera_from_world: Pose::look_at(eye, DVec3::new(0.0, 0.0, 0.5), DVec3::Z).unwrap(),
        radiance_linear: ImageF32::filled(width, height, 3, 0.0).into(),
        usable: vec![true; width * height],
        clipped: Vec::new(),
    };
    let rays = ViewRays::new(&out);
    for i in 0..width * height {
        let d = rays.direction((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        let shown = match (is_ball(rays.eye, d), d.z > 0.0) {
            (true, _) => Vec3::new(0.2, 0.1, 0.05),
            (_, true) => behind(rays.eye, d),
            _ => below(d),
        };
        out.radiance_linear.floats_mut()[i] = shown.to_array();
    }
    out
}

fn is_ball(eye: Vec3, d: Vec3) -> bool {
    let along = -eye.dot(d);
    along * along - eye.length_squared() + 1.0 > 0.0
}

/// What is found in photos of a surface, and the share of pixels whose verdict is right.
fn found(surface: Surface, behind: &Behind<'_>) -> (FoundSky, f64) {
    found_above(surface, behind, &|_| Vec3::new(0.05, 0.09, 0.03))
}

fn found_above(
    surface: Surface,
    behind: &Behind<'_>,
    below: &dyn Fn(Vec3) -> Vec3,
) -> (FoundSky, f64) {
    let scene = TracedSurface::new(surface).unwrap();
    let photos: Vec<Photo> = (0..VIEWS).map(|k| photo(k, behind, below)).collect();
    let views: Vec<SeenView<'_>> = photos.iter().map(|p| SeenView::new(p, &scene)).collect();
    let found = find_sky(&views, Vec3::Z);
    let (mut right, mut all) = (0.0, 0.0);
    for (view, mask) in views.iter().zip(&found.masks) {
        for (i, shown) in mask.iter().enumerate() {
            let [x, y] = [i % SIZE[0], i / SIZE[0]].map(|n| n as f32 + 0.5);
            let d = view.rays.direction(x, y);
            let is_sky = d.z > 0.0 && !is_ball(view.rays.eye, d);
            right += f64::from(u8::from(is_sky == (*shown == Shown::Sky)));
            all += 1.0;
        }
    }
    (found, right / f64::max(all, 1.0))
}

/// Pale at the horizon, blue above, brighter to the east.
fn sky(_: Vec3, d: Vec3) -> Vec3 {
    let t = (3.0 * d.z).min(1.0);
    Vec3::new(0.8, 0.85, 0.9).lerp(Vec3::new(0.3, 0.5, 0.8), t) * (1.0 + 0.3 * d.x)
}

#[test]
fn the_sky_is_what_has_one_color_per_direction_from_everywhere() {
    let (found, right) = found(ball(24, |_| 1.0), &sky);
    assert!(found.is_sky(), "{:?}", (found.photos, found.explained, found.surface));
    assert!(right > 0.98 && found.explained > 0.95, "{right} {}", found.explained);
    assert!(found.area > 0.2 && found.area < 0.8 && found.surface < 0.05, "{}", found.area);
}

#[test]
fn walls_are_no_sky_with_a_surface_or_without() {
    // All that is shown has one.
    let (room, _) = found(ball(24, |_| 30.0), &sky);
    assert!(!room.is_sky());
    // Near, and of several colors: it moves against the directions.
    let wall = |eye: Vec3, d: Vec3| {
        let at = eye + d * 3.0;
        Vec3::splat(0.4 * (1.3 * (2.5 * at.x + 1.5 * at.y).sin()).exp())
    };
    let (near, _) = found(ball(24, |_| 1.0), &wall);
    assert!(!near.is_sky(), "{:?}", (near.photos, near.explained, near.surface));
}

#[test]
fn a_white_sheet_has_no_horizon() {
    let white = Vec3::splat(0.9);
    let (sheet, _) = found_above(ball(24, |_| 1.0), &|_, _| white, &|_| white);
    assert!(!sheet.is_sky() && sheet.below > 0.9 && sheet.explained > 0.9, "{}", sheet.below);
}

#[test]
fn nothing_bright_is_no_sky_and_no_photo_is_none() {
    let (night, _) = found(ball(24, |_| 1.0), &|_, _| Vec3::ZERO);
    assert!(!night.is_sky());
    assert!(!find_sky(&[], Vec3::Z).is_sky());
    let (broken, _) =
        found(ball(24, |_| 1.0), &|_, d| Vec3::splat(if d.x > 0.0 { f32::NAN } else { 0.5 }));
    assert!(broken.masks.iter().flatten().count() == 0 || broken.explained.is_finite());
}
