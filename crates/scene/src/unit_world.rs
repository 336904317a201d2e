//! The world in which a capture is fitted: cameras around the origin, at a distance of about one.
//!
//! A source chooses its unit and origin freely: millimeters, map coordinates of 1e7 m, the
//! arbitrary scale of structure from motion. Fitting in a world of unit size takes that choice out
//! of every length, learning rate and rounding: `world = origin + length * unit`.
//!
//! Rescaling the source changes last bits, and last bits decide ties in a fit, which then ends a few
//! tenths of a decibel elsewhere. So positions are snapped to a grid far finer than they are known,
//! and coarser than those last bits.

use glam::{DVec3, Vec3};
use motes_math::median::upper_median;

use crate::{Gaussians, Pose};

/// Grid of points, in unit lengths. Triangulated points are known to about 1e-3.
const POINT_GRID: f64 = 1.0 / 16_384.0;
/// Grid of camera centers: 2e-6 is 2e-3 pixels at a focal length of 1000.
const CAMERA_GRID: f64 = 1.0 / 524_288.0;
/// Cameras closer together than this share of the distance to the points are in one place.
const ONE_PLACE: f64 = 1e-4;

/// The similarity between the world of a capture and the world it is fitted in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitWorld {
    /// Origin of the unit world, world units.
    pub origin: DVec3,
    /// Length of one unit, world units.
    pub length: f64,
}

impl UnitWorld {
    /// Changes nothing.
    pub const IDENTITY: Self = Self { origin: DVec3::ZERO, length: 1.0 };

    /// Origin: the mean of the camera centers. Length: the distance of the farthest from it; when
    /// the cameras are in one place, the median distance to the points; 1 when there is neither.
    pub fn of(centers: &[DVec3], points: impl Iterator<Item = DVec3>) -> Self {
        let origin = centers.iter().sum::<DVec3>() / centers.len().max(1) as f64;
        let radius = centers.iter().map(|c| c.distance(origin)).fold(0.0, f64::max);
        let mut distances: Vec<f64> =
            points.map(|p| p.distance(origin)).filter(|d| d.is_finite()).collect();
        let median = upper_median(&mut distances, f64::total_cmp).unwrap_or(0.0);
        let length = if radius > ONE_PLACE * median { radius } else { median };
        let usable = origin.is_finite() && length > 0.0 && length.is_finite();
        if usable { Self { origin, length } } else { Self::IDENTITY }
    }

    fn snapped(&self, world: DVec3, grid: f64) -> DVec3 {
        ((world - self.origin) / self.length / grid).round() * grid
    }

    /// A triangulated point in the unit world, on its grid.
    pub fn point(&self, world: DVec3) -> DVec3 {
        self.snapped(world, POINT_GRID)
    }

    /// A point of the unit world in the world.
    pub fn point_in_world(&self, unit: DVec3) -> DVec3 {
        self.origin + unit * self.length
    }

    /// `camera_from_unit` of a `camera_from_world`; the center lies on its grid.
    pub fn pose(&self, camera_from_world: &Pose) -> Pose {
        let center = self.snapped(camera_from_world.center_in_world(), CAMERA_GRID);
        let rotation = camera_from_world.rotation;
        Pose { rotation, translation: -(rotation * center) }
    }

    /// Gaussians of the world in the unit world.
    pub fn gaussians(&self, mut world: Gaussians) -> Gaussians {
        for mean in &mut world.means {
            let p = Vec3::from(*mean).as_dvec3();
            *mean = ((p - self.origin) / self.length).as_vec3().to_array();
        }
        self.shift_scales(&mut world, -1.0);
        world
    }

    /// Gaussians of the unit world in the world.
    pub fn gaussians_in_world(&self, mut unit: Gaussians) -> Gaussians {
        for mean in &mut unit.means {
            let p = Vec3::from(*mean).as_dvec3();
            *mean = self.point_in_world(p).as_vec3().to_array();
        }
        self.shift_scales(&mut unit, 1.0);
        unit
    }

    fn shift_scales(&self, gaussians: &mut Gaussians, sign: f64) {
        let shift = sign * self.length.ln();
        for s in gaussians.log_scales.as_flattened_mut() {
            *s = (f64::from(*s) + shift) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(scale: f64, shift: DVec3) -> Vec<Pose> {
        let eye = |i: usize| {
            let angle = i as f64 * 0.7;
            shift + DVec3::new(3.1 * angle.cos(), 2.9 * angle.sin(), 0.83) * scale
        };
        (0..9).map(|i| Pose::look_at(eye(i), shift, DVec3::Z).unwrap()).collect()
    }

    fn unit_of(poses: &[Pose]) -> UnitWorld {
        let centers: Vec<DVec3> = poses.iter().map(Pose::center_in_world).collect();
        UnitWorld::of(&centers, std::iter::empty())
    }

    #[test]
    fn the_unit_world_is_the_same_at_any_size_and_place() {
        let reference = ring(1.0, DVec3::ZERO);
        let unit = unit_of(&reference);
        assert!(unit.length > 2.0 && unit.length < 4.0, "{unit:?}");
        for (scale, shift) in [
            (1e-6, DVec3::ZERO),
            (1e6, DVec3::ZERO),
            (1.0, DVec3::new(5e5, 4.6e6, 1e7)),
            (7.0, DVec3::new(-3.0, 2.0, 1.0)),
        ] {
            let moved = ring(scale, shift);
            let other = unit_of(&moved);
            for (a, b) in reference.iter().zip(&moved) {
                let (a, b) = (unit.pose(a).center_in_world(), other.pose(b).center_in_world());
                assert!((a - b).length() < 1e-12, "{scale} {shift}: {a} {b}");
            }
            let p = DVec3::new(0.123, -0.456, 0.789);
            assert_eq!(unit.point(p), other.point(p * scale + shift), "{scale} {shift}");
        }
    }

    #[test]
    fn a_second_snap_after_single_precision_finds_the_same_point() {
        let unit = unit_of(&ring(37.0, DVec3::new(10.0, 20.0, 5.0)));
        for i in 0..1000 {
            let f = f64::from(i);
            let p = DVec3::new((f * 0.37).sin(), (f * 0.73).cos(), (f * 0.11).sin()) * 400.0;
            let once = unit.point(p);
            let stored = unit.point_in_world(once).as_vec3();
            assert_eq!(unit.point(stored.as_dvec3()), once);
            assert!((unit.point_in_world(once) - p).length() < 6e-5 * unit.length);
        }
    }

    #[test]
    fn without_cameras_apart_the_points_give_the_length() {
        let points = || [1.0, 2.0, 50.0].into_iter().map(|x| DVec3::new(x, 0.0, 0.0));
        let one = [DVec3::ZERO; 4];
        assert_eq!(UnitWorld::of(&one, points()).length, 2.0);
        assert_eq!(UnitWorld::of(&one, std::iter::empty()), UnitWorld::IDENTITY);
        assert_eq!(UnitWorld::of(&[], std::iter::empty()), UnitWorld::IDENTITY);
        assert_eq!(UnitWorld::of(&[DVec3::NAN], points()), UnitWorld::IDENTITY);
    }

    #[test]
    fn gaussians_come_back() {
        let unit = UnitWorld { origin: DVec3::new(5.0, -3.0, 2.0), length: 1e3 };
        let world = Gaussians {
            means: vec![[100.0, 250.0, -70.0]],
            rotations: vec![[1.0, 0.0, 0.0, 0.0]],
            log_scales: vec![[0.5, -2.0, 3.0]],
            opacity_logits: vec![0.0],
            sh_degree: 0,
            sh: vec![0.1; 3],
            extra: Vec::new(),
        };
        let back = unit.gaussians_in_world(unit.gaussians(world.clone()));
        for (a, b) in back.means[0].iter().zip(&world.means[0]) {
            assert!((a - b).abs() < 1e-4, "{a} {b}");
        }
        for (a, b) in back.log_scales[0].iter().zip(&world.log_scales[0]) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
    }
}
