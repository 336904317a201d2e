//! The light at a point of a splat.
//!
//! 1. [`look_around`]: a panorama of the Gaussians around the point, how far each direction is covered, and how far away what it shows is.
//! 2. [`evidence`]: points of the surfaces around with normals and colors, from the views of the capture.
//! 3. [`solve`]: lights that photos clip, or that no photo shows, from how those points are shaded.
//! 4. [`estimate`]: all of it, as one map.

pub mod evidence;
mod lamp;
mod lights;
mod panorama;
mod regions;
pub mod shadows;
pub mod solve;

use glam::{DVec3, Vec3};
use motes_raster::Antialias;
use motes_scene::{Capture, Gaussians, ImageF32, Pinhole, Pose};
use motes_shading::environment::MapAxes;
use serde::Serialize;

use crate::fill::fill;
use crate::sphere::texel_solid_angle;

pub use lights::CLIPPED;
pub use panorama::{Panorama, look_around};
pub use regions::{Region, clipped_regions};

/// A splat and the cameras that it was trained on.
#[derive(Clone, Copy, Debug)]
pub struct Splat<'a> {
    /// Its Gaussians.
    pub gaussians: &'a Gaussians,
    /// Their footprint.
    pub antialias: Antialias,
    /// Training views: intrinsics and poses.
    pub views: &'a [(Pinhole, Pose)],
    /// Unit vector away from the ground.
    pub up_in_world: DVec3,
}

/// Views with a pinhole camera.
pub fn training_views(capture: &Capture) -> Vec<(Pinhole, Pose)> {
    let train = capture.views_of(motes_scene::Split::Train);
    let views = train.iter().map(|i| &capture.views[*i]);
    views
        .filter_map(|view| {
            let camera = capture.cameras[view.camera].as_pinhole()?;
            Some((camera, view.camera_from_world))
        })
        .collect()
}

/// How a place is looked at.
#[derive(Clone, Copy, Debug)]
pub struct PlaceOptions {
    /// Rows of the map.
    pub rows: usize,
    /// Nothing nearer to the point than this is light from around it, world units; by default a twentieth of the distance of the
    /// cameras.
    pub near: Option<f64>,
    /// Whether lights that are clipped or out of view are found from shading.
    pub recover: bool,
    /// Key of all random numbers.
    pub seed: u64,
}

impl Default for PlaceOptions {
    fn default() -> Self {
        Self { rows: 256, near: None, recover: true, seed: 0 }
    }
}

/// What was found about a place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PlaceReport {
    /// Share of the sphere that the panorama covers.
    pub coverage: f64,
    /// Share of the sphere that is clipped.
    pub clipped_share: f64,
    /// By how much clipped light is brighter than white, in the mean over clipped directions; 1 without evidence.
    pub clipped_factor: f64,
    /// Points of surfaces whose shading was looked at.
    pub evidence_points: usize,
    /// Relative error of the shading, root mean square, with light from the panorama alone and with recovered lights.
    pub shading_error: Option<[f64; 2]>,
    /// Share of the light on a level surface that comes from where no photo looked.
    pub unseen_share: Option<f64>,
    /// A small light that the shadows tell of: unit vector toward it, world.
    pub lamp_direction: Option<[f64; 3]>,
    /// Its share of the light on a level surface.
    pub lamp_share: Option<f64>,
}

/// The light at a place.
#[derive(Clone, Debug)]
pub struct PlaceLight {
    /// Linear RGB, in the axes asked for.
    pub map: ImageF32,
    /// The panorama before anything was completed.
    pub panorama: Panorama,
    /// What was found.
    pub report: PlaceReport,
}

/// Typical distance from the point of the cameras' attention to the cameras, world units.
pub fn scale_of(views: &[(Pinhole, Pose)], at: DVec3) -> f64 {
    let distances = views.iter().map(|(_, pose)| pose.center_in_world().distance(at));
    motes_math::median::median(distances).filter(|d| *d > 0.0).unwrap_or(1.0)
}

/// The light at `at` (world), as a map with `axes`.
pub fn estimate(splat: &Splat<'_>, at: DVec3, axes: MapAxes, options: &PlaceOptions) -> PlaceLight {
    let near = options.near.unwrap_or(0.05 * scale_of(splat.views, at));
    let panorama = look_around(splat, at, axes, options.rows, near);
    let base = fill(&panorama.radiance, &panorama.covered);
    let (w, h) = (base.width, base.height);
    let share = |counts: &dyn Fn(usize) -> f64| {
        let texel = |i: usize| texel_solid_angle(i / w, w, h) * counts(i);
        (0..w * h).map(texel).sum::<f64>() / (4.0 * std::f64::consts::PI)
    };
    let mut report = PlaceReport {
        coverage: share(&|i| f64::from(panorama.covered[i])),
        clipped_share: share(&|i| f64::from(u8::from(panorama.clipped[i]))),
        clipped_factor: 1.0,
        ..PlaceReport::default()
    };
    let mut map = base.clone();
    if options.recover {
        let points = evidence::points(splat, at, options.seed);
        report.evidence_points = points.len();
        if let Some(found) = lights::recover(splat, at, &axes, &panorama, &base, &points) {
            map = found.map;
            report.clipped_factor = found.clipped_factor;
            report.shading_error = Some(found.errors);
            report.unseen_share = Some(found.unseen_share);
            report.lamp_direction = found.lamp.map(|lamp| lamp.direction.to_array());
            report.lamp_share = found.lamp.map(|lamp| lamp.share);
        }
    }
    map.data.iter_mut().for_each(|v| *v = v.max(0.0));
    PlaceLight { map, panorama, report }
}

/// Linear radiance of an encoded color.
pub(crate) fn decoded(encoded: &[f32]) -> Vec3 {
    Vec3::from_slice(encoded)
        .clamp(Vec3::ZERO, Vec3::ONE)
        .to_array()
        .map(motes_math::srgb::decode)
        .into()
}
