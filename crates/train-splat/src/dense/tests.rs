use motes_raster::{RenderOptions, render};
use motes_scene::Gaussians;
use motes_testkit::{orbit_pose, small_camera};

use super::*;

/// The unit sphere tiled with flat colored Gaussians: a surface with texture and a known shape. Flat,
/// because a ball of radius σ is seen at its front, not at its center.
fn textured_ball() -> Gaussians {
    let n = 6000;
    let mut g = Gaussians::empty(0);
    for i in 0..n {
        let z = 1.0 - 2.0 * (i as f32 + 0.5) / n as f32;
        let phi = 2.399_963 * i as f32;
        let r = (1.0 - z * z).sqrt();
        g.means.push([r * phi.cos(), r * phi.sin(), z]);
        // Turns the local z axis, the flat one, to the outside.
        g.rotations.push([1.0 + z, -r * phi.sin(), r * phi.cos(), 0.0]);
        g.log_scales.push([0.025f32.ln(), 0.025f32.ln(), 0.001f32.ln()]);
        g.opacity_logits.push(6.0);
        let shade = (i as u32).wrapping_mul(2654435761) >> 24;
        g.sh.extend([shade as f32 / 128.0 - 1.0; 3]);
    }
    g
}

#[test]
fn points_lie_on_the_surface() {
    let ball = textured_ball();
    let images: Vec<TrainingImage> = (0..6)
        .map(|i| {
            let camera = small_camera(360, 288);
            let camera_from_world = orbit_pose(0.2 * f64::from(i));
            let picture = render(&ball, &camera, &camera_from_world, &RenderOptions::default());
            TrainingImage {
                name: i.to_string(),
                camera,
                camera_from_world,
                image: picture.color.to_u8().into(),
                mask: None,
                exposure_gain: 1.0,
            }
        })
        .collect();
    // Sparse points: few, and 3 % off the surface.
    let positions: Vec<[f32; 3]> =
        ball.means.iter().step_by(40).map(|p| p.map(|v| v * 1.03)).collect();
    let sparse = SparsePoints { colors: vec![[0; 3]; positions.len()], positions };
    let dense = dense_points(&images, &sparse, 4);
    assert!(dense.len() > 1000, "{} points", dense.len());
    let mut errors: Vec<f32> =
        dense.positions.iter().map(|p| (Vec3::from(*p).length() - 1.0).abs()).collect();
    errors.sort_by(f32::total_cmp);
    let (median, p90) = (errors[errors.len() / 2], errors[errors.len() * 9 / 10]);
    assert!(median < 0.012 && p90 < 0.04, "median {median} p90 {p90} of {}", dense.len());
    assert_eq!(dense_points(&images, &sparse, 4), dense);
    assert!(dense_points(&images[..1], &sparse, 4).is_empty());
    assert!(dense_points(&images, &SparsePoints::default(), 4).is_empty());
}
