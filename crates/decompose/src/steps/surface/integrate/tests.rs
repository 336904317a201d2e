//! The fast fusion against one voxel and one view at a time in f64.

use fearless_simd::Level;
use glam::{DVec3, Mat3, Quat, Vec2};
use motes_scene::{Pinhole, Pose};

use super::super::tsdf::local;
use super::super::view::Shown;
use super::*;

const WIDTH: usize = 48;
const HEIGHT: usize = 40;
const VOXEL: f32 = 0.05;
const CARVE: f32 = 0.25;

/// Views of a bumpy floor with a step, from around the axis.
fn scene(count: usize) -> (Vec<View>, Vec<DepthMap>, Vec<Silhouette>) {
    let of = |k: usize| {
        let turn = Quat::from_rotation_z(0.4 * k as f32)
            * Quat::from_rotation_x(std::f32::consts::PI - 0.15 * k as f32);
        let rotation = Mat3::from_quat(turn);
        let pixels = WIDTH * HEIGHT;
        let view = View {
            rotation,
            center: rotation.transpose() * Vec3::new(0.0137 + 0.02 * k as f32, 0.0071, -2.0),
            focal: Vec2::new(50.0, 52.0),
            principal: Vec2::new(24.0, 20.0),
            width: WIDTH,
            height: HEIGHT,
            camera: Pinhole {
                fx: 50.0,
                fy: 52.0,
                cx: 24.0,
                cy: 20.0,
                width: WIDTH,
                height: HEIGHT,
            },
            camera_from_unit: Pose::IDENTITY,
            luma: vec![0.5; pixels],
            color: vec![[0; 3]; pixels],
            shown: vec![Shown::Whole; pixels],
            whole: true,
        };
        let depth = (0..pixels).map(|i| {
            let (x, y) = ((i % WIDTH) as f32, (i / WIDTH) as f32);
            let step = if x > 30.0 { 0.4 } else { 0.0 };
            if i % 97 == 5 { 0.0 } else { 2.0 + 0.02 * (0.3 * x + 0.2 * y).sin() - step }
        });
        let inside = |i| if i % 29 == 7 { f32::INFINITY } else { (i % WIDTH) as f32 * 0.3 - 4.0 };
        let hull = Silhouette {
            steady: (0..pixels).map(|i| if i % 31 == 3 { 0.3 } else { 1.0 }).collect(),
            depth_inside: (0..pixels).map(inside).collect(),
        };
        (view, DepthMap { depth: depth.collect() }, hull)
    };
    let mut out = (Vec::new(), Vec::new(), Vec::new());
    for (view, map, hull) in (0..count).map(of) {
        out.0.push(view);
        out.1.push(map);
        out.2.push(hull);
    }
    out
}

/// Depth of a map between the centers of pixels.
fn slow_depth(view: &View, map: &DepthMap, x: f64, y: f64) -> Option<f64> {
    let depth = |i: usize, j: usize| f64::from(map.depth[j * WIDTH + i]);
    let nearest = depth(x as usize, y as usize);
    let (u, v) = (x - 0.5, y - 0.5);
    if !(u >= 0.0 && v >= 0.0 && u < (WIDTH - 1) as f64 && v < (HEIGHT - 1) as f64) {
        return (nearest > 0.0).then_some(nearest);
    }
    let (i, j) = (u as usize, v as usize);
    let (a, b) = (u.fract(), v.fract());
    let four = [depth(i, j), depth(i + 1, j), depth(i, j + 1), depth(i + 1, j + 1)];
    let high = four.iter().fold(0.0, |h: f64, z| h.max(*z));
    let low = four.iter().fold(f64::MAX, |l, z| l.min(*z));
    let even = high - low < f64::from(STEP) * nearest * f64::from(view.footprint());
    let [top, under] = [four[0] + (four[1] - four[0]) * a, four[2] + (four[3] - four[2]) * a];
    (nearest > 0.0 && even).then_some(top + (under - top) * b)
}

/// Distance and views near it of one voxel; none where nothing is known.
fn slow(views: &[View], maps: &[DepthMap], hull: &[Silhouette], p: DVec3) -> (Option<f64>, u8) {
    let (voxel, truncation) = (f64::from(VOXEL), f64::from(TRUNCATION));
    let (mut distance, mut weight, mut near) = (truncation, 0.0, 0u8);
    let (mut inside, mut looks) = (truncation, 0);
    for (k, (view, map)) in views.iter().zip(maps).enumerate() {
        let q = view.rotation.as_dmat3() * (p - view.center.as_dvec3());
        let x = f64::from(view.focal.x) * q.x / q.z + f64::from(view.principal.x);
        let y = f64::from(view.focal.y) * q.y / q.z + f64::from(view.principal.y);
        if !(q.z > 1e-6 && x >= 0.0 && y >= 0.0 && x < WIDTH as f64 && y < HEIGHT as f64) {
            continue;
        }
        let footprint = f64::from(view.footprint());
        let pixel = y as usize * WIDTH + x as usize;
        let mut believed = 1.0;
        if let Some(hull) = hull.get(k) {
            believed = f64::from(hull.steady[pixel]);
            let within = f64::from(hull.depth_inside[pixel]) - 0.5;
            inside = inside.min(within * q.z * footprint / voxel);
            looks += usize::from(within.is_finite());
        }
        let Some(z) = slow_depth(view, map, x, y) else { continue };
        let d = (z - q.z) / voxel;
        if !(d > -truncation) {
            continue;
        }
        let w = believed
            * (voxel / (z * footprint)).powi(2).min(1.0)
            * if d < truncation { 1.0 } else { f64::from(CARVE) };
        distance = (distance * weight + d.min(truncation) * w) / (weight + w);
        weight += w;
        near += u8::from(d < truncation);
    }
    let w = f64::from(HULL_WEIGHT) * (1.0 - weight / f64::from(TOLD));
    if inside > 0.0 && looks >= (views.len() / HULL_SHARE).max(HULL_VIEWS) && w > 0.0 {
        near = if w > weight { u8::MAX } else { near };
        distance = (distance * weight - inside * w) / (weight + w);
        weight += w;
    }
    ((weight > 0.0).then_some(distance), near)
}

#[test]
fn blocks_are_those_of_the_slow_reference() {
    let (views, maps, hull) = scene(6);
    for hull in [&hull[..], &[]] {
        let seen = Seen { views: &views, maps: &maps, hull, voxel: VOXEL, carve: CARVE };
        let (mut compared, mut off) = (0, 0);
        for k in 0..60 {
            let key = IVec3::new(k % 5 - 2, k / 5 % 4 - 2, k / 20 - 1);
            let block = seen.integrate(key);
            for i in 0..VOXELS {
                let at = (key * SIDE as i32 + local(i)).as_dvec3() * f64::from(VOXEL);
                let (distance, near) = slow(&views, &maps, hull, at);
                let fast = block.distance[i].to_f64();
                let same = match distance {
                    Some(d) => (fast - d).abs() < 5e-3 && block.seen[i] == near,
                    None => fast.is_nan(),
                };
                compared += usize::from(distance.is_some());
                off += usize::from(!same);
            }
        }
        // A place on the border of two pixels may fall to either.
        assert!(compared > 8000 && off * 500 < compared, "{off} of {compared}");
    }
}

#[test]
fn every_instruction_set_gives_the_same_block() {
    let (views, maps, hull) = scene(6);
    let seen = Seen { views: &views, maps: &maps, hull: &hull, voxel: VOXEL, carve: CARVE };
    let bits = |level: Level| {
        let block = dispatch!(level, simd => seen.integrate_on(simd, IVec3::new(0, -1, -1)));
        (block.distance.map(f16::to_bits), block.seen)
    };
    let best = bits(Level::new());
    assert!(best.1.iter().any(|s| *s > 0));
    assert_eq!(best, bits(Level::baseline()));
}

#[test]
fn a_block_that_no_view_shows_is_empty() {
    let (views, maps, hull) = scene(3);
    let seen = Seen { views: &views, maps: &maps, hull: &hull, voxel: VOXEL, carve: CARVE };
    let far = seen.integrate(IVec3::new(1000, 0, 0));
    assert!(far.distance.iter().all(|d| d.is_nan()) && far.seen.iter().all(|s| *s == 0));
}
