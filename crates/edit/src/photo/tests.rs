use glam::DVec3;
use motes_math::tone_curve::ToneCurve;
use motes_scene::ImageF32;
use motes_shading::brdf::Lobes;
use motes_shading::environment::{Convention, MapAxes};

use super::*;
use crate::run::picture;
use crate::{Fill, SceneParts};

/// Wide Gaussians side by side in a plane, gray.
fn wall() -> Gaussians {
    let mut wall = Gaussians::empty(0);
    for i in 0..400 {
        let at = |k: i32| 0.1 * (k as f32 - 9.5);
        wall.means.push([at(i % 20), at(i / 20), 0.0]);
        wall.rotations.push([1.0, 0.0, 0.0, 0.0]);
        wall.log_scales.push([-2.5, -2.5, -5.0]);
        wall.opacity_logits.push(4.0);
        wall.sh.extend([0.0; 3]);
    }
    wall
}

fn view() -> (Pinhole, Pose) {
    let camera = Pinhole { fx: 40.0, fy: 40.0, cx: 20.0, cy: 20.0, width: 40, height: 40 };
    (camera, Pose::look_at(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, DVec3::Y).unwrap())
}

#[test]
fn what_the_edit_leaves_alone_is_the_photo_and_what_it_placed_is_drawn() {
    let (camera, pose) = view();
    let view =
        PhotoView { camera: &camera, camera_from_world: &pose, antialias: Antialias::Classic };
    let before = wall();
    // The photo is not what the splat shows: a color of its own.
    let photo = ImageU8::from_data(40, 40, 3, [40, 160, 90].repeat(1600));
    let mut state = EditState::new("wall", before.clone(), None, None, DVec3::Z);
    let same = photo_after(&photo, &before, &state, view);
    assert_eq!(same.data, photo.data);
    // A red thing in front of the left, a shadow on the right.
    let mut thing = Gaussians::empty(0);
    thing.means.push([-0.5, 0.0, 0.3]);
    thing.rotations.push([1.0, 0.0, 0.0, 0.0]);
    thing.log_scales.push([-1.5; 3]);
    thing.opacity_logits.push(9.0);
    thing.sh.extend([1.7, -1.7, -1.7]);
    state.append(thing, vec![Origin { source: 1, row: 0, motion: 0 }]);
    for row in (0..400).filter(|r| r % 20 > 12) {
        state.gaussians.sh[3 * row..3 * row + 3].fill(-0.8);
    }
    let out = photo_after(&photo, &before, &state, view);
    let at = |x: usize, y: usize| &out.data[3 * (40 * y + x)..3 * (40 * y + x) + 3];
    let thing = camera.fx * -0.5 / 2.7 + 20.0;
    assert!(at(thing as usize, 20)[0] > 200 && at(thing as usize, 20)[1] < 60, "{:?}", at(12, 20));
    assert_eq!(at(18, 36), [40, 160, 90]);
    let dark = at(30, 20);
    assert!(dark[1] < 110 && dark[1] > 40 && dark[1] > 2 * dark[0], "{dark:?}");
}

#[test]
fn a_photo_has_the_tone_curve_of_its_camera_and_the_gaussians_do_not() {
    let (camera, pose) = view();
    let view =
        PhotoView { camera: &camera, camera_from_world: &pose, antialias: Antialias::Classic };
    let (before, curve) = (wall(), ToneCurve::new(0.5));
    let parts = SceneParts {
        environment: ImageF32::filled(2, 1, 3, 0.5),
        axes: MapAxes::of_world(Convention::OpenExr),
        environment_changed: false,
        lobes: Lobes::Lambert,
        indirect: false,
        tone_curve: curve,
    };
    let mut state = EditState::new("wall", before.clone(), None, Some(parts), DVec3::Z);
    let drawn = picture(&state, view.antialias, &camera, &pose).data;
    let plain = render(&before, &camera, &pose, &RenderOptions::default()).color.data;
    let off = |(byte, v): (&u8, &f32)| (f32::from(*byte) - 255.0 * curve.apply(*v)).abs();
    assert!(drawn.iter().zip(&plain).all(|pair| off(pair) < 0.51));
    // Every byte comes back.
    let bytes = (0..4800).map(|k| (k % 256) as u8).collect();
    let photo = ImageU8::from_data(40, 40, 3, bytes);
    assert_eq!(photo_after(&photo, &before, &state, view).data, photo.data);
    // Something dark in front of the left; half as much light on the right.
    let mut thing = Gaussians::empty(0);
    thing.means.push([-0.5, 0.0, 0.3]);
    thing.rotations.push([1.0, 0.0, 0.0, 0.0]);
    thing.log_scales.push([-1.5; 3]);
    thing.opacity_logits.push(9.0);
    let dark = (0.2 - 0.5) / SH_C0 as f32;
    thing.sh.extend([dark; 3]);
    state.append(thing, vec![Origin { source: 1, row: 0, motion: 0 }]);
    let half = srgb::encode(0.5 * srgb::decode(0.5));
    for row in (0..400).filter(|r| r % 20 > 12) {
        state.gaussians.sh[3 * row..3 * row + 3].fill((half - 0.5) / SH_C0 as f32);
    }
    let photo = ImageU8::from_data(40, 40, 3, [150; 3].repeat(1600));
    let out = photo_after(&photo, &before, &state, view);
    let at = |x: usize| f32::from(out.data[3 * (40 * 20 + x)]) / 255.0;
    let shown = |light: f32| curve.apply(srgb::encode(light));
    let of_photo = srgb::decode(curve.invert(150.0 / 255.0));
    let (thing, shade) = (shown(srgb::decode(0.2)), shown(0.5 * of_photo));
    // It is not quite opaque.
    assert!((at(12) - thing).abs() < 0.02 && thing < 0.16, "{} for {thing}", at(12));
    assert!((at(31) - shade).abs() < 0.01, "{} for {shade}", at(31));
}

#[test]
fn where_something_went_the_fill_is_drawn() {
    let (camera, pose) = view();
    let view =
        PhotoView { camera: &camera, camera_from_world: &pose, antialias: Antialias::Classic };
    let before = wall();
    let photo = ImageU8::from_data(40, 40, 3, [200; 3].repeat(1600));
    let mut state = EditState::new("wall", before.clone(), None, None, DVec3::Z);
    let rows: Vec<u32> = (0..400).filter(|r| r % 20 < 8).collect();
    state.remove(&rows, Fill::None);
    let out = photo_after(&photo, &before, &state, view);
    let at = |x: usize| out.data[3 * (40 * 20 + x)];
    assert!(at(12) < 20 && at(26) == 200, "{} {}", at(12), at(26));
}
