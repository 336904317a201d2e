//! How many steps a capture needs: by what a photo sees of the scene.
//!
//! A step looks at one photo. Where every photo sees the whole object, each Gaussian is visited in
//! every step; in a room or along a walk a photo sees the share `f` of the Gaussians, and as many steps
//! visit each of them less often. Two bounds, in steps of the preset, say how long a fit pays: a
//! Gaussian gains from up to [`GAUSSIAN_VISITS`] visits, and a photo that is visited more than one in
//! [`FEW_PHOTOS`] of the steps is learned by heart.

use glam::DVec3;
use rayon::prelude::*;

use crate::plan::Plan;
use crate::target::TrainingImage;

/// Gaussians that are looked at, evenly chosen.
const SAMPLES: usize = 20_000;
/// Visits that a Gaussian gains from, over the steps of the preset.
const GAUSSIAN_VISITS: f64 = 1.5;
/// With so many training photos the steps of the preset visit each as often as it bears.
const FEW_PHOTOS: f64 = 20.0;

/// Mean share of the points that lie in the view of a photo, [0, 1].
pub(crate) fn seen_share(images: &[TrainingImage], means: &[[f32; 3]]) -> f64 {
    let count = means.len().min(SAMPLES);
    if count == 0 || images.is_empty() {
        return 1.0;
    }
    let point = |i: usize| {
        let row = means[(i as u64 * means.len() as u64 / count as u64) as usize];
        DVec3::from_array(row.map(f64::from))
    };
    let seen: usize =
        images.par_iter().map(|image| (0..count).filter(|&i| sees(image, point(i))).count()).sum();
    seen as f64 / (images.len() * count) as f64
}

fn sees(image: &TrainingImage, point: DVec3) -> bool {
    let p = image.camera_from_world.transform_point(point);
    let camera = &image.camera;
    let (x, y) = (camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy);
    let inside = |v: f64, size: usize| v >= 0.0 && v < size as f64;
    p.z > 0.0 && inside(x, camera.width) && inside(y, camera.height)
}

/// How many times the preset's steps a capture of so many photos gets, before the preset's own bound.
pub(crate) fn steps_factor(photos: usize, seen: f64) -> f64 {
    (GAUSSIAN_VISITS / seen.max(1e-3)).min(photos as f64 / FEW_PHOTOS).max(1.0)
}

/// What the plan resolved to, for the report.
pub(crate) fn reason(plan: &Plan, photos: usize, seen: f64) -> String {
    format!(
        "a photo sees {:.0} % of the start, and there are {photos}: {:.2} times the steps of the \
         preset (at most {:.1})",
        100.0 * seen,
        plan.steps_factor,
        plan.longest
    )
}

#[cfg(test)]
mod tests {
    use motes_scene::{ImageU8, Pinhole, Pose};

    use super::*;
    use crate::FitOptions;

    fn photo(yaw: f64) -> TrainingImage {
        let target = DVec3::new(yaw.cos(), yaw.sin(), 0.0);
        TrainingImage {
            name: String::new(),
            camera: Pinhole { fx: 20.0, fy: 20.0, cx: 20.0, cy: 20.0, width: 40, height: 40 },
            camera_from_world: Pose::look_at(DVec3::ZERO, target, DVec3::Z).unwrap(),
            image: ImageU8::filled(40, 40, 3, 9).into(),
            mask: None,
            exposure_gain: 1.0,
        }
    }

    #[test]
    fn a_photo_of_a_quarter_turn_sees_a_quarter_of_a_ring() {
        let ring = |i: usize| (i as f32 + 0.5) * std::f32::consts::TAU / 1000.0;
        let means: Vec<_> = (0..1000).map(|i| [ring(i).cos(), ring(i).sin(), 0.0]).collect();
        let turns: Vec<_> = (0..4).map(|i| photo(f64::from(i))).collect();
        assert!((seen_share(&turns, &means) - 0.25).abs() < 1e-3);
        assert_eq!(seen_share(&turns, &[[f32::NAN; 3]]), 0.0);
        assert_eq!(seen_share(&turns, &[]), 1.0);
    }

    #[test]
    fn steps_follow_visits_and_few_photos_get_no_more() {
        assert_eq!(steps_factor(87, 1.0), 1.5);
        assert_eq!(steps_factor(100, 0.5), 3.0);
        assert_eq!(steps_factor(25, 0.5), 1.25);
        assert_eq!(steps_factor(20, 0.1), 1.0);
        assert_eq!(steps_factor(40, 0.1), 2.0);
        assert!(steps_factor(1000, 0.0).is_finite());
    }

    #[test]
    fn a_preset_bounds_its_steps_and_a_number_that_was_given_stays() {
        let mut plan = Plan::new(&FitOptions::default(), 100).unwrap();
        let own = plan.iterations;
        plan.lengthen(2.0);
        assert_eq!(plan.iterations, 2 * own);
        plan.lengthen(1e9);
        assert_eq!(f64::from(plan.iterations), plan.longest * f64::from(own));
        let given = FitOptions { iterations: Some(77), ..FitOptions::default() };
        let mut plan = Plan::new(&given, 100).unwrap();
        plan.lengthen(2.0);
        assert_eq!(plan.iterations, 77);
    }
}
