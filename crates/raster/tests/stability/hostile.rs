//! Any bits in any column: finite pictures, finite gradients.

use motes_raster::{
    Frame, GaussianGradients, Modifiers, Planes, RenderOptions, ViewTransform, render,
};
use motes_scene::{Gaussians, Pinhole};
use motes_testkit::{check_property, orbit_pose, small_camera};
use proptest::prelude::*;

/// Any bit pattern, with the limits of the type and ordinary values more often than by chance.
fn anything() -> impl Strategy<Value = f32> {
    let limits = [
        0.0,
        -0.0,
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        f32::MIN,
        f32::MIN_POSITIVE,
        1e-45,
        1e8,
        -1e8,
        1e4,
        -1e4,
    ];
    prop_oneof![
        8 => -1.0..1.0f32,
        1 => any::<u32>().prop_map(f32::from_bits),
        1 => prop::sample::select(limits.to_vec()),
    ]
}

fn gaussians() -> impl Strategy<Value = Gaussians> {
    const ROW: usize = 3 + 4 + 3 + 1 + 12;
    prop::collection::vec(prop::collection::vec(anything(), ROW), 0..8).prop_map(|rows| {
        let mut g = Gaussians::empty(1);
        for row in rows {
            g.means.push([row[0], row[1], row[2]]);
            g.rotations.push([row[3], row[4], row[5], row[6]]);
            g.log_scales.push([row[7] - 1.0, row[8] - 1.0, row[9] - 1.0]);
            g.opacity_logits.push(row[10]);
            g.sh.extend(&row[11..]);
        }
        g
    })
}

#[test]
fn any_bits_give_finite_pictures_and_gradients() {
    let camera = small_camera(24, 17);
    check_property(3000, &(gaussians(), 0.0..6.0f64), |(gaussians, angle)| {
        let pose = orbit_pose(angle);
        let options = RenderOptions { aovs: true, ..RenderOptions::default() };
        let picture = render(&gaussians, &camera, &pose, &options);
        let aovs = picture.aovs.as_ref().unwrap();
        let planes = [
            &picture.color,
            &picture.alpha,
            &aovs.depth_expected,
            &aovs.depth_median,
            &aovs.normal_in_world,
        ];
        for (i, plane) in planes.into_iter().enumerate() {
            prop_assert!(plane.data.iter().all(|v| v.is_finite()), "plane {i}");
        }
        prop_assert!(picture.alpha.data.iter().all(|a| (-1e-6..=1.0).contains(a)), "alpha");

        let mut frame = Frame::new();
        let view = ViewTransform::new(&camera, &pose);
        frame.forward(&gaussians, &view, &Modifiers::default(), &options);
        let mut gradient = Planes::new(camera.width, camera.height, 4);
        for (i, value) in gradient.data.iter_mut().enumerate() {
            *value = (i as f32).sin();
        }
        let mut got = GaussianGradients::default();
        frame.backward(&gaussians, &Modifiers::default(), &options, &gradient, &mut got);
        let finite = |values: &[f32]| values.iter().all(|v| v.is_finite());
        prop_assert!(finite(got.means.as_flattened()), "means {:?}", got.means);
        prop_assert!(finite(got.rotations.as_flattened()), "rotations {:?}", got.rotations);
        prop_assert!(finite(got.log_scales.as_flattened()), "log_scales {:?}", got.log_scales);
        prop_assert!(finite(&got.opacity_logits) && finite(&got.sh), "opacities, sh");
        Ok(())
    });
}

#[test]
fn any_camera_gives_finite_pictures() {
    let gaussians = motes_testkit::random_gaussians(3, 40, 2);
    let value = || prop_oneof![3 => -100.0..100.0f64, 1 => any::<f64>()];
    let cameras = (value(), value(), value(), value(), 1usize..70, 1usize..50);
    check_property(1000, &cameras, |(fx, fy, cx, cy, width, height)| {
        let camera = Pinhole { fx, fy, cx, cy, width, height };
        let picture = render(&gaussians, &camera, &orbit_pose(0.3), &RenderOptions::default());
        prop_assert!(picture.color.data.iter().all(|v| v.is_finite()), "{camera:?}");
        prop_assert_eq!(picture.color.data.len(), 3 * width * height);
        Ok(())
    });
}
