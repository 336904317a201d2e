//! The Gaussians a fit starts with.

use glam::{DVec3, Vec3};
use motes_math::knn::rms_neighbour_distance;
use motes_math::rng::keyed_rng;
use motes_math::sh::SH_C0;
use motes_math::sigmoid::logit;
use motes_scene::{Gaussians, SparsePoints};
use rand::RngExt;

use crate::options::FitOptions;
use crate::target::TrainingImage;

/// Stream number of the random start, see [`keyed_rng`].
const STREAM: u64 = 0x1217;

/// One Gaussian per point: its colour, a ball as wide as the distance to its three neighbours
/// (Kerbl et al. 2023).
///
/// Points with a non-finite coordinate are left out. `extent` bounds the scales: a lone point far
/// away must not become a ball around everything.
pub(crate) fn from_points(points: &SparsePoints, extent: f64, options: &FitOptions) -> Gaussians {
    let distances = rms_neighbour_distance(&points.positions, 3);
    let (low, high) = (1e-6 * extent as f32, 0.5 * extent as f32);
    let mut g = Gaussians::empty(0);
    for (i, &distance) in distances.iter().enumerate().filter(|(_, d)| d.is_finite()) {
        let scale = (options.init_scale * distance).clamp(low, high);
        push(&mut g, points.positions[i], points.colors[i].map(|c| f32::from(c) / 255.0), scale);
    }
    g.opacity_logits.fill(logit(options.init_opacity));
    g
}

/// Random Gaussians in the space that the cameras look at, coloured by the photo they were drawn from.
///
/// Each lies on the ray of a random pixel of a random photo, at a depth between a tenth and twice
/// the distance to the point that all optical axes pass nearest to.
pub(crate) fn random(
    images: &[TrainingImage],
    seed: u64,
    extent: f64,
    options: &FitOptions,
) -> Gaussians {
    let focus = axes_focus(images);
    let mut rng = keyed_rng(seed, STREAM, 0);
    let mut g = Gaussians::empty(0);
    for _ in 0..options.init_random {
        let image = &images[rng.random_range(0..images.len())];
        let camera = &image.camera;
        let (u, v) = (rng.random::<f64>(), rng.random::<f64>());
        let distance =
            (focus - image.camera_from_world.center_in_world()).length().max(0.1 * extent);
        let z = distance * (0.1 + 1.9 * rng.random::<f64>());
        let (px, py) = (u * camera.width as f64, v * camera.height as f64);
        let in_camera =
            DVec3::new((px - camera.cx) / camera.fx * z, (py - camera.cy) / camera.fy * z, z);
        let in_world = image.camera_from_world.inverse().transform_point(in_camera);
        let pixel = image.image.pixel(
            (px as usize).min(image.image.width - 1),
            (py as usize).min(image.image.height - 1),
        );
        let color = std::array::from_fn(|c| f32::from(pixel[c]) / 255.0);
        let spacing = (z * camera.width as f64 / camera.fx)
            / (options.init_random as f64 / images.len() as f64).sqrt().max(1.0);
        push(&mut g, in_world.as_vec3().to_array(), color, spacing as f32);
    }
    g.opacity_logits.fill(logit(options.init_opacity));
    g
}

fn push(g: &mut Gaussians, mean: [f32; 3], color: [f32; 3], scale: f32) {
    g.means.push(mean);
    g.rotations.push([1.0, 0.0, 0.0, 0.0]);
    g.log_scales.push([scale.max(f32::MIN_POSITIVE).ln(); 3]);
    g.opacity_logits.push(0.0);
    g.sh.extend(color.map(|c| (c - 0.5) / SH_C0 as f32));
}

/// The point nearest to all optical axes in the least-squares sense; in front of the first camera
/// when the axes are parallel.
pub(crate) fn axes_focus(images: &[TrainingImage]) -> DVec3 {
    let mut normal = glam::DMat3::ZERO;
    let mut rhs = DVec3::ZERO;
    for image in images {
        let center = image.camera_from_world.center_in_world();
        let axis = image.camera_from_world.rotation_matrix().row(2);
        let projector = glam::DMat3::IDENTITY
            - glam::DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
        normal += projector;
        rhs += projector * center;
    }
    let count = images.len().max(1) as f64;
    if (normal * (1.0 / count)).determinant() > 1e-6 {
        return normal.inverse() * rhs;
    }
    images.first().map_or(DVec3::ZERO, |image| {
        let pose = &image.camera_from_world;
        pose.center_in_world() + pose.rotation_matrix().row(2)
    })
}

/// The length that learning rates and size limits refer to, world units.
///
/// The radius of the camera centres, as in 3DGS; when the cameras are (nearly) in one place, a
/// tenth of the median distance to the points; 1 when there is nothing to measure.
pub fn scene_extent(images: &[TrainingImage], points: &SparsePoints) -> f64 {
    let centers: Vec<DVec3> =
        images.iter().map(|image| image.camera_from_world.center_in_world()).collect();
    let mean = centers.iter().sum::<DVec3>() / centers.len().max(1) as f64;
    let radius = centers.iter().map(|c| (*c - mean).length()).fold(0.0, f64::max);
    let mut distances: Vec<f64> = points
        .positions
        .iter()
        .map(|p| (Vec3::from(*p).as_dvec3() - mean).length())
        .filter(|d| d.is_finite())
        .collect();
    let middle = distances.len() / 2;
    let median = match distances.is_empty() {
        true => 0.0,
        false => *distances.select_nth_unstable_by(middle, f64::total_cmp).1,
    };
    let extent = (1.1 * radius).max(0.1 * median);
    if extent > 0.0 && extent.is_finite() { extent } else { 1.0 }
}
