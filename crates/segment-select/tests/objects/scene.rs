//! A floor with a red box and a blue box beside it.

use glam::{DVec3, Quat, Vec3};
use motes_formats::selectors::Click;
use motes_scene::{
    Camera, Capture, ColumnValues, ExtraColumn, Gaussians, Pinhole, Pose, Selection, SparsePoints,
    Split, View,
};
use segment_select::{SelectSource, selection_mask};

/// What each Gaussian is part of.
pub(crate) const FLOOR: u32 = 0;
pub(crate) const RED: u32 = 1;
pub(crate) const BLUE: u32 = 2;

fn square(
    g: &mut Gaussians,
    part: &mut Vec<u32>,
    [corner, u, v]: [Vec3; 3],
    n: u32,
    color: [f32; 3],
    label: u32,
) {
    let q = Quat::from_rotation_arc(Vec3::Z, u.cross(v).normalize());
    let size = u.length() / n as f32 * 0.6;
    for i in 0..n * n {
        let (a, b) = ((i % n) as f32 + 0.5, (i / n) as f32 + 0.5);
        g.means.push((corner + u * (a / n as f32) + v * (b / n as f32)).to_array());
        g.rotations.push([q.w, q.x, q.y, q.z]);
        g.log_scales.push([size.ln(), size.ln(), size.ln() - 4.0]);
        g.opacity_logits.push(5.0);
        // A pattern, so that color alone tells little.
        let shade = if (i % n / 3 + i / n / 3).is_multiple_of(2) { 1.0 } else { 0.75 };
        g.sh.extend(color.map(|c| (c * shade - 0.5) / 0.282_094_8));
        part.push(label);
    }
}

pub(crate) fn scene() -> (Gaussians, Vec<u32>, Capture) {
    scene_with(Vec3::new(0.05, -0.2, 0.0))
}

/// The blue box has its low corner at `blue`.
pub(crate) fn scene_with(blue: Vec3) -> (Gaussians, Vec<u32>, Capture) {
    let (mut g, mut part) = (Gaussians::empty(0), Vec::new());
    let floor = [Vec3::new(-2.0, -2.0, 0.0), Vec3::X * 4.0, Vec3::Y * 4.0];
    square(&mut g, &mut part, floor, 40, [0.5, 0.45, 0.4], FLOOR);
    for (low, color, label) in
        [(Vec3::new(-0.7, -0.3, 0.0), [0.7, 0.2, 0.2], RED), (blue, [0.2, 0.3, 0.7], BLUE)]
    {
        let (x, y, z) = (Vec3::X * 0.6, Vec3::Y * 0.6, Vec3::Z * 0.6);
        for side in [[low + z, x, y], [low, x, z], [low + y, z, x], [low, z, y], [low + x, y, z]] {
            square(&mut g, &mut part, side, 12, color, label);
        }
    }
    let values = ColumnValues::U8(part.iter().map(|&p| p as u8).collect());
    g.extra.push(ExtraColumn { name: "object_id".into(), values });
    let camera = Pinhole { fx: 150.0, fy: 150.0, cx: 80.0, cy: 60.0, width: 160, height: 120 };
    let view = |i: usize| {
        let angle = i as f64 * std::f64::consts::TAU / 9.0;
        let eye = DVec3::new(2.2 * angle.cos(), 2.2 * angle.sin(), 1.7);
        View {
            name: format!("v{i}.png"),
            camera: 0,
            camera_from_world: Pose::look_at(eye, DVec3::new(0.0, 0.0, 0.2), DVec3::Z).unwrap(),
            image: format!("v{i}.png").into(),
            mask: None,
            split: if i == 8 { Split::Test } else { Split::Train },
            exposure_stops: None,
        }
    };
    let capture = Capture {
        cameras: vec![Camera::from_pinhole(camera)],
        views: (0..9).map(view).collect(),
        points: SparsePoints::default(),
        world_origin: DVec3::ZERO,
        exposure_response: None,
    };
    (g, part, capture)
}

/// Pixel of a world point in a view, as a click.
pub(crate) fn click_on(capture: &Capture, view: usize, point: [f64; 3], positive: bool) -> Click {
    let p = capture.views[view].camera_from_world.transform_point(DVec3::from_array(point));
    let pixel = [150.0 * p.x / p.z + 80.0, 150.0 * p.y / p.z + 60.0];
    Click { view: format!("v{view}"), pixel, positive }
}

/// Intersection over union of masks in the view that nobody prepared.
pub(crate) fn held_out_iou(
    source: &SelectSource<'_>,
    capture: &Capture,
    a: &Selection,
    b: &Selection,
) -> f64 {
    let camera = capture.cameras[0].as_pinhole().unwrap();
    let pose = &capture.views[8].camera_from_world;
    let mask = |s| selection_mask(source.gaussians, s, &camera, pose, &source.options).data;
    let (a, b) = (mask(a), mask(b));
    let count = |f: &dyn Fn(bool, bool) -> bool| {
        a.iter().zip(&b).filter(|(a, b)| f(**a > 0.5, **b > 0.5)).count() as f64
    };
    count(&|a, b| a && b) / count(&|a, b| a || b)
}

pub(crate) const RED_TOP: [f64; 3] = [-0.4, 0.0, 0.6];
pub(crate) const BLUE_TOP: [f64; 3] = [0.35, 0.1, 0.6];
