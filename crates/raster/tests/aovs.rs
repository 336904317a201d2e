//! Depth of a pixel against the densest point on its ray, found by search in double precision.

use glam::{DMat3, DQuat, DVec3};
use motes_raster::{RenderOptions, render};
use motes_scene::{Gaussians, Pinhole, Pose};

const CAMERA: Pinhole = Pinhole { fx: 60.0, fy: 60.0, cx: 24.0, cy: 18.0, width: 48, height: 36 };

fn one(mean: DVec3, rotation: DQuat, scales: DVec3) -> Gaussians {
    let mut g = Gaussians::empty(0);
    g.means.push(mean.as_vec3().to_array());
    g.rotations.push([rotation.w, rotation.x, rotation.y, rotation.z].map(|v| v as f32));
    g.log_scales.push(scales.to_array().map(|s| s.ln() as f32));
    g.opacity_logits.push(8.0);
    g.sh.extend([0.3; 3]);
    g
}

/// Depth in front of the camera at which the density of a Gaussian is largest on a ray, by golden-section search.
fn densest(ray: DVec3, mean: DVec3, rotation: DQuat, scales: DVec3) -> f64 {
    let whiten = DMat3::from_diagonal(scales.recip()) * DMat3::from_quat(rotation).transpose();
    let distance = |t: f64| (whiten * (ray * t - mean)).length_squared();
    let (mut low, mut high) = (0.0, 10.0 * mean.z);
    let golden = 0.5 * (5.0f64.sqrt() - 1.0);
    for _ in 0..200 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if distance(a) < distance(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}

#[test]
fn depth_is_where_the_ray_passes_the_densest_point() {
    let options = RenderOptions { aovs: true, ..RenderOptions::default() };
    let cases = [
        // A floor seen at a grazing angle, a ball, a needle, a disk that faces the camera.
        (DVec3::new(0.1, 0.4, 3.0), DVec3::new(0.7, 0.3, 1.0), 1.5, DVec3::new(0.6, 0.6, 0.05)),
        (DVec3::new(0.0, 0.0, 4.0), DVec3::X, 0.0, DVec3::splat(0.5)),
        (DVec3::new(-0.2, 0.1, 3.0), DVec3::new(0.2, 1.0, 0.1), 0.9, DVec3::new(0.8, 0.1, 0.1)),
        (DVec3::new(0.3, -0.2, 2.5), DVec3::X, 0.0, DVec3::new(0.4, 0.3, 0.04)),
    ];
    for (mean, axis, angle, scales) in cases {
        let rotation = DQuat::from_axis_angle(axis.normalize(), angle);
        let picture = render(&one(mean, rotation, scales), &CAMERA, &Pose::IDENTITY, &options);
        let aovs = picture.aovs.unwrap();
        let reach = 3.0 * scales.max_element();
        let mut compared = 0;
        for y in 0..CAMERA.height {
            for x in 0..CAMERA.width {
                let depth = f64::from(aovs.depth_median.pixel(x, y)[0]);
                if depth == 0.0 {
                    continue;
                }
                let ray = DVec3::new(
                    (x as f64 + 0.5 - CAMERA.cx) / CAMERA.fx,
                    (y as f64 + 0.5 - CAMERA.cy) / CAMERA.fy,
                    1.0,
                );
                let truth = densest(ray, mean, rotation, scales);
                let truth = truth.clamp(mean.z - reach, mean.z + reach);
                assert!((depth / truth - 1.0).abs() < 1e-3, "{x} {y}: {depth} for {truth}");
                compared += 1;
            }
        }
        assert!(compared > 20, "{compared} pixels");
    }
}

#[test]
fn a_gaussian_around_the_camera_has_the_depth_of_its_center() {
    let options = RenderOptions { aovs: true, ..RenderOptions::default() };
    let g = one(DVec3::new(0.0, 0.0, 1.0), DQuat::IDENTITY, DVec3::splat(5.0));
    let aovs = render(&g, &CAMERA, &Pose::IDENTITY, &options).aovs.unwrap();
    assert!(aovs.depth_median.data.iter().all(|d| *d == 0.0 || *d == 1.0));
}
