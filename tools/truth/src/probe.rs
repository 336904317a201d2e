//! The true light at a point: a path-traced panorama.

use std::path::Path;

use anyhow::Context as _;
use glam::Vec3;
use motes_formats::atomic::write_atomic;
use motes_formats::environment::write_environment;
use motes_scene::ImageF32;
use motes_shading::environment::{Convention, Orientation, direction_from_uv};
use motes_shading::sampling::{PointSet, unit_f64};
use motes_shading::tracing::Ray;
use rayon::prelude::*;
use serde_json::json;

use crate::MakeOptions;
use crate::lights::environment;
use crate::path::PathTracer;
use crate::scenes::SceneName;
use crate::variant::recipe_of;
use crate::world::World;

/// Rows of the panorama.
const ROWS: usize = 128;
/// Sets its random numbers apart from those of pictures.
const STREAM: u64 = 1 << 60;
const PIXEL_PURPOSE: u32 = 1;

/// Writes `probe/light.exr` (radiance, Blender's axes) and `probe/probe.json` (the point in world) into a folder that
/// [`crate::make`] wrote. `at` is in units of the scene, from its middle.
///
/// # Errors
/// When the scene has no such light, or a file cannot be written.
pub fn make_probe(
    name: SceneName,
    options: &MakeOptions,
    at: Vec3,
    folder: &Path,
) -> anyhow::Result<()> {
    let recipe = recipe_of(name, options)?;
    let world = World::new(&recipe, options.lobes)?;
    let light = environment(&recipe.capture_light.1.picture()?)?;
    let tracer = PathTracer::new(&world, &light, options.bounces, options.seed).with_lamps();
    let point = recipe.origin + at * recipe.unit;
    let map = panorama(&tracer, point, options.samples, options.seed);
    let out = folder.join("probe");
    std::fs::create_dir_all(&out).with_context(|| out.display().to_string())?;
    write_environment(&out.join("light.exr"), &map, &[])?;
    let document = json!({"at_world": point.to_array(), "light": recipe.capture_light.0});
    let text = serde_json::to_string_pretty(&document)?;
    Ok(write_atomic(&out.join("probe.json"), |w| w.write_all(text.as_bytes()))?)
}

fn panorama(tracer: &PathTracer<'_>, at: Vec3, samples: u32, seed: u64) -> ImageF32 {
    let (w, h) = (2 * ROWS, ROWS);
    let orientation = Orientation::new(Convention::Blender);
    let pixel = |i: usize| {
        let item = STREAM | i as u64;
        let sum: Vec3 = (0..samples)
            .map(|k| {
                let p = PointSet::new(seed, item, PIXEL_PURPOSE, samples).point(k);
                let u = ((i % w) as f64 + unit_f64(p[1])) / w as f64;
                let v = ((i / w) as f64 + unit_f64(p[2])) / h as f64;
                let direction = orientation.world_from_map(direction_from_uv(u, v)).as_vec3();
                tracer.radiance(Ray::new(at, direction), item, k, samples)
            })
            .sum();
        (sum / samples as f32).to_array()
    };
    let data: Vec<[f32; 3]> = (0..w * h).into_par_iter().map(pixel).collect();
    ImageF32::from_data(w, h, 3, data.into_iter().flatten().collect())
}
