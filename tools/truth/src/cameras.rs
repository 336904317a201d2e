//! Where the photos are taken from: a ring whose elevation goes up and down.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};
use motes_scene::Pose;
use motes_shading::tracing::Ray;

use crate::scenes::SceneRecipe;

/// Height of a target that the elevations of cameras are given for, in units of the scene.
const LEVEL: f64 = 0.1;

/// A posed pinhole camera.
#[derive(Clone, Debug)]
pub struct Shot {
    /// `train_000`, `test_000`.
    pub name: String,
    /// Axes x right, y down, z forward.
    pub camera_from_world: Pose,
    /// Columns and rows.
    pub size: (usize, usize),
    /// Pixels.
    pub focal: f64,
}

impl Shot {
    /// The ray through (x, y), in pixels from the upper left corner, and its length per unit of
    /// depth.
    pub fn ray(&self, x: f64, y: f64) -> (Ray, f64) {
        let (w, h) = self.size;
        let to = DVec3::new(x - w as f64 / 2.0, y - h as f64 / 2.0, self.focal) / self.focal;
        let world = self.camera_from_world.inverse();
        let direction = (world.rotation * to).normalize();
        (Ray::new(world.translation.as_vec3(), direction.as_vec3()), to.length())
    }

    /// Pixel of a point in front of the camera.
    pub fn project(&self, p: Vec3) -> Option<[f64; 2]> {
        let q = self.camera_from_world.transform_point(p.as_dvec3());
        let (w, h) = (self.size.0 as f64, self.size.1 as f64);
        let pixel = [w / 2.0 + self.focal * q.x / q.z, h / 2.0 + self.focal * q.y / q.z];
        let inside = q.z > 0.0 && (0.0..w).contains(&pixel[0]) && (0.0..h).contains(&pixel[1]);
        inside.then_some(pixel)
    }
}

/// `train` shots once around, then `test` shots, each between two neighbors.
pub fn ring(recipe: &SceneRecipe, size: (usize, usize), train: usize, test: usize) -> Vec<Shot> {
    let unit = f64::from(recipe.unit);
    let views = &recipe.views;
    let (distance, (low, high)) = (views.distance, views.elevation_deg);
    let (start, span) = (views.azimuth_deg.0.to_radians(), TAU * views.azimuth_deg.1 / 360.0);
    let shot = |name: String, turn: f64, wobble: f64| {
        let wobble = wobble * views.unsteady;
        // Three rises per round, so that neighbors differ in height.
        let wave = 0.5 + 0.5 * (3.0 * TAU * turn + 0.7).sin();
        let elevation = f64::from(low) + f64::from(high - low) * wave;
        let (sin, cos) = elevation.to_radians().sin_cos();
        let (s, c) = (start + span * turn).sin_cos();
        let r = f64::from(distance) * unit * (1.0 + 0.04 * wobble);
        let origin = recipe.origin.as_dvec3();
        let raised = DVec3::Z * (views.target.z - LEVEL) * unit;
        let eye = origin + raised + DVec3::new(c * cos, s * cos, sin) * r;
        let aside = DVec3::new(0.03 * wobble, -0.04 * wobble, 0.0);
        let target = origin + (views.target + aside) * unit;
        let pose = Pose::look_at(eye, target, DVec3::Z).unwrap_or(Pose::IDENTITY);
        let focal = f64::from(recipe.focal) * size.0 as f64;
        Shot { name, camera_from_world: pose, size, focal }
    };
    let wobble = |i: usize| (i as f64 * 2.4).sin();
    let trained = (0..train)
        .map(|i| shot(format!("train_{i:03}"), i as f64 / train.max(1) as f64, wobble(i)));
    let tested = (0..test).map(|i| {
        let between = (i * train / test.max(1)) as f64 + 0.5;
        shot(format!("test_{i:03}"), between / train.max(1) as f64, wobble(i + 100))
    });
    trained.chain(tested).collect()
}
