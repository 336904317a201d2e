//! An object of a scene as a mesh of its own, to be composed into the scene without it.

use std::path::Path;

use glam::Vec3;
use motes_formats::atomic::write_atomic;
use motes_formats::ply::write_surface;
use motes_scene::Surface;
use serde_json::json;

use crate::MakeOptions;
use crate::scenes::SceneName;
use crate::variant::{find_object, recipe_of};
use crate::world::World;

/// Writes the mesh of an object with its materials at the vertices, +z up, standing on the origin, and beside it a JSON document that says
/// where its base stands in the scene and how tall it is, world units. The mesh has about `2 steps` by `steps` vertices.
///
/// # Errors
/// When the scene has no such object, or a file cannot be written.
pub fn write_asset(
    name: SceneName,
    options: &MakeOptions,
    object: &str,
    steps: u32,
    output: &Path,
) -> anyhow::Result<()> {
    let recipe = recipe_of(name, options)?;
    let thing = find_object(&recipe, object)?;
    let mut alone = recipe.clone();
    alone.things = vec![recipe.things[thing].clone()];
    alone.lamps.clear();
    alone.walls.clear();
    let world = World::with_steps(&alone, options.lobes, steps)?;
    // The ground is the first object, this the second.
    let (low, high) = world.bounds[1];
    let base = Vec3::new(0.5 * (low.x + high.x), 0.5 * (low.y + high.y), low.z);
    let vertices = world.vertices();
    let first = vertices.len() - world.vertices_of_last();
    let mut surface = Surface::default();
    for (vertex, normal, material) in &vertices[first..] {
        surface.vertices.push((*vertex - base).to_array());
        surface.normals.push(normal.to_array());
        surface.base_color_linear.push(material.base_color_linear.to_array());
        surface.roughness.push(material.roughness);
        surface.metallic.push(material.metallic);
    }
    let of_it = world.triangles().iter().filter(|t| t[0] as usize >= first);
    surface.triangles = of_it.map(|t| t.map(|v| v - first as u32)).collect();
    write_surface(output, &surface)?;
    let document = json!({
        "base_world": base.to_array(),
        "height_world": high.z - low.z,
    });
    let text = serde_json::to_string_pretty(&document)?;
    let beside = output.with_extension("json");
    Ok(write_atomic(&beside, |w| w.write_all(text.as_bytes()))?)
}
