//! The Gaussians a fit starts with.

use glam::{DVec3, Vec3};
use motes_math::knn::rms_neighbor_distance;
use motes_math::median::upper_median;
use motes_math::rng::keyed_rng;
use motes_math::sh::SH_C0;
use motes_math::sigmoid::logit;
use motes_scene::camera_path::common_point;
use motes_scene::{Gaussians, Pose, SparsePoints};
use rand::RngExt;

use crate::dense::dense_points;
use crate::options::FitOptions;
use crate::target::TrainingImage;

/// Stream number of the random start, see [`keyed_rng`].
const STREAM: u64 = 0x1217;
/// Depths of random Gaussians when the cameras look at no common point, in extents of the cameras.
const NEAR: f64 = 0.3;
const FAR: f64 = 30.0;

/// One Gaussian per point: its color, a ball as wide as the distance to its three neighbors
/// (Kerbl et al. 2023).
///
/// Points with a non-finite coordinate are left out. `extent` bounds the scales: a lone point far
/// away must not become a ball around everything.
pub(crate) fn from_points(points: &SparsePoints, extent: f64, options: &FitOptions) -> Gaussians {
    let distances = rms_neighbor_distance(&points.positions, 3);
    let (low, high) = (1e-6 * extent as f32, 0.5 * extent as f32);
    let mut g = Gaussians::empty(0);
    for (i, &distance) in distances.iter().enumerate().filter(|(_, d)| d.is_finite()) {
        let scale = (options.init_scale * distance).clamp(low, high);
        push(&mut g, points.positions[i], points.colors[i].map(|c| f32::from(c) / 255.0), scale);
    }
    g.opacity_logits.fill(logit(options.init_opacity));
    g
}

/// Brightest color coefficient of a start: its square must survive the loss in single precision.
const MAX_SH: f32 = 1e6;

/// Given Gaussians without those that are not Gaussians (a value that is not finite, a rotation
/// without direction); values beyond what a fit can use are brought back.
pub(crate) fn usable(mut given: Gaussians) -> Gaussians {
    let mut broken = given.invalid_rows().into_iter().peekable();
    let rows: Vec<u32> =
        (0..given.len() as u32).filter(|row| broken.next_if_eq(row).is_none()).collect();
    given.gather(&rows);
    for logit in &mut given.opacity_logits {
        *logit = logit.clamp(-1e4, 1e4);
    }
    for s in given.log_scales.as_flattened_mut() {
        *s = s.clamp(-80.0, 80.0);
    }
    for value in &mut given.sh {
        *value = value.clamp(-MAX_SH, MAX_SH);
    }
    given
}

/// The sparse points and, up to `wanted` in all, evenly chosen dense ones.
pub(crate) fn with_dense_points(
    images: &[TrainingImage],
    sparse: &SparsePoints,
    step: usize,
    wanted: usize,
) -> SparsePoints {
    let mut all = sparse.clone();
    let room = wanted.saturating_sub(all.len());
    if step == 0 || room == 0 {
        return all;
    }
    let dense = dense_points(images, sparse, step);
    let take = room.min(dense.len());
    for i in 0..take {
        let row = (i as u64 * dense.len() as u64 / take as u64) as usize;
        all.positions.push(dense.positions[row]);
        all.colors.push(dense.colors[row]);
    }
    all
}

/// Random Gaussians in the space that the cameras look at, colored by the photo they were drawn from.
///
/// Each lies on the ray of a random pixel of a random photo. Depths are between a third and three
/// times that of the point that all optical axes pass nearest to, evenly spread over their inverses;
/// without such a point between [`NEAR`] and [`FAR`] extents of the cameras.
///
/// All of them together let a third of the light through: opaque ones would hide each other from
/// the gradients and settle as a fog before every camera.
pub(crate) fn random(
    images: &[TrainingImage],
    seed: u64,
    extent: f64,
    options: &FitOptions,
) -> Gaussians {
    let poses: Vec<Pose> = images.iter().map(|image| image.camera_from_world).collect();
    let focus = common_point(&poses).ok();
    let mut rng = keyed_rng(seed, STREAM, 0);
    let mut points = SparsePoints::default();
    for _ in 0..options.init_random {
        let image = &images[rng.random_range(0..images.len())];
        let camera = &image.camera;
        let (u, v) = (rng.random::<f64>(), rng.random::<f64>());
        let depth = focus.map(|f| image.camera_from_world.transform_point(f).z);
        let (near, far) = match depth.filter(|z| *z > 0.0) {
            Some(z) => (z / 3.0, z * 3.0),
            None => (NEAR * extent, FAR * extent),
        };
        let t = rng.random::<f64>();
        let z = 1.0 / ((1.0 - t) / near + t / far);
        let (px, py) = (u * camera.width as f64, v * camera.height as f64);
        let in_camera =
            DVec3::new((px - camera.cx) / camera.fx * z, (py - camera.cy) / camera.fy * z, z);
        let in_world = image.camera_from_world.inverse().transform_point(in_camera);
        let pixel = image.image.pixel(
            (px as usize).min(image.image.width - 1),
            (py as usize).min(image.image.height - 1),
        );
        points.positions.push(in_world.as_vec3().to_array());
        points.colors.push(std::array::from_fn(|c| pixel[c.min(pixel.len() - 1)]));
    }
    // About the cube root of their number stands behind one another, each of which covers its
    // share of a layer about twice: the circles of one standard deviation touch.
    let layers = (points.len() as f32).cbrt().max(1.0);
    let opacity = options.init_opacity.min(0.5 / layers).max(2.0 * options.prune_opacity);
    let thin = FitOptions { init_opacity: opacity, ..options.clone() };
    from_points(&points, extent, &thin)
}

fn push(g: &mut Gaussians, mean: [f32; 3], color: [f32; 3], scale: f32) {
    g.means.push(mean);
    g.rotations.push([1.0, 0.0, 0.0, 0.0]);
    g.log_scales.push([scale.max(f32::MIN_POSITIVE).ln(); 3]);
    g.opacity_logits.push(0.0);
    g.sh.extend(color.map(|c| (c - 0.5) / SH_C0 as f32));
}

/// The point that all optical axes pass nearest to; in front of the first camera when there is none.
pub(crate) fn axes_focus(images: &[TrainingImage]) -> DVec3 {
    let poses: Vec<Pose> = images.iter().map(|image| image.camera_from_world).collect();
    common_point(&poses).unwrap_or_else(|_| {
        poses.first().map_or(DVec3::ZERO, |pose| pose.inverse().transform_point(DVec3::Z))
    })
}

/// The length that learning rates and size limits refer to, world units.
///
/// The radius of the camera centers, as in 3DGS; when the cameras are (nearly) in one place, a
/// tenth of the median distance to the points; 1 when there is nothing to measure.
pub fn scene_extent<'a>(
    cameras_from_world: impl IntoIterator<Item = &'a Pose>,
    positions: &[[f32; 3]],
) -> f64 {
    let centers: Vec<DVec3> = cameras_from_world.into_iter().map(Pose::center_in_world).collect();
    let mean = centers.iter().sum::<DVec3>() / centers.len().max(1) as f64;
    let radius = centers.iter().map(|c| (*c - mean).length()).fold(0.0, f64::max);
    let mut distances: Vec<f64> = positions
        .iter()
        .map(|p| (Vec3::from(*p).as_dvec3() - mean).length())
        .filter(|d| d.is_finite())
        .collect();
    let median = upper_median(&mut distances, f64::total_cmp).unwrap_or(0.0);
    let extent = (1.1 * radius).max(0.1 * median);
    if extent > 0.0 && extent.is_finite() { extent } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use motes_scene::{ImageU8, Pinhole};

    use super::*;

    fn ring(views: usize) -> Vec<TrainingImage> {
        let camera = Pinhole { fx: 50.0, fy: 50.0, cx: 20.0, cy: 15.0, width: 40, height: 30 };
        (0..views)
            .map(|i| {
                let angle = 0.5 * i as f64;
                let eye = DVec3::new(4.0 * angle.cos(), 4.0 * angle.sin(), 1.0);
                TrainingImage {
                    name: format!("{i}"),
                    camera,
                    camera_from_world: Pose::look_at(eye, DVec3::new(0.0, 0.0, 0.2), DVec3::Z)
                        .unwrap(),
                    image: ImageU8::filled(40, 30, 3, 200).into(),
                    mask: None,
                    exposure_gain: 1.0,
                }
            })
            .collect()
    }

    #[test]
    fn points_become_balls_as_wide_as_their_spacing() {
        let positions = (0..100).map(|i| [(i % 10) as f32, (i / 10) as f32, 0.0]).collect();
        let mut points = SparsePoints { positions, colors: vec![[255, 0, 128]; 100] };
        points.positions.push([f32::NAN; 3]);
        points.colors.push([0; 3]);
        let g = from_points(&points, 100.0, &FitOptions::default());
        assert!(g.is_consistent() && g.len() == 100 && g.invalid_rows().is_empty());
        assert!((g.log_scales[55][0].exp() - 1.0).abs() < 1e-5);
        let red = 0.5 + SH_C0 as f32 * g.sh_of(0)[0];
        assert!((red - 1.0).abs() < 1e-6);
    }

    #[test]
    fn coincident_points_keep_a_scale_above_zero() {
        let points = SparsePoints { positions: vec![[1.0; 3]; 50], colors: vec![[9; 3]; 50] };
        let g = from_points(&points, 2.0, &FitOptions::default());
        assert!(g.log_scales.iter().flatten().all(|s| s.is_finite()));
    }

    #[test]
    fn the_random_start_lies_in_view_and_depends_on_the_seed_only() {
        let images = ring(4);
        let options = FitOptions { init_random: 500, ..FitOptions::default() };
        let g = random(&images, 3, 4.0, &options);
        assert!(g.is_consistent() && g.len() == 500 && g.invalid_rows().is_empty());
        assert_eq!(g, random(&images, 3, 4.0, &options));
        assert_ne!(g, random(&images, 4, 4.0, &options));
        let focus = axes_focus(&images);
        assert!((focus - DVec3::new(0.0, 0.0, 0.2)).length() < 1e-9, "{focus}");
    }

    #[test]
    fn the_extent_survives_one_view_and_one_place() {
        let extent = |images: Vec<TrainingImage>, points: &[[f32; 3]]| {
            scene_extent(images.iter().map(|image| &image.camera_from_world), points)
        };
        let points = [[9.0, 0.0, 1.0]; 3];
        assert!(extent(ring(1), &points) > 0.1);
        assert_eq!(extent(ring(1), &[]), 1.0);
        let many = extent(ring(12), &points);
        assert!(many > 4.0 && many < 5.0, "{many}");
    }
}
