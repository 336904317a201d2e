//! The scene folder that a perfect decomposition would write: the true surface, the true light,
//! and the true materials on given Gaussians. What relighting loses on it is not the inversion's.

use std::path::Path;

use glam::Vec3;
use motes_formats::decomposition::{
    DecomposedViewDocument, DecompositionCounts, DecompositionDocument, ScaleAnchorDocument,
    TermDocument, write_decomposition,
};
use motes_formats::documents::Document;
use motes_formats::environment::{read_environment, write_environment};
use motes_formats::ply::{PlyWriteOptions, open_gaussians, write_gaussians, write_surface};
use motes_scene::{Convention, Lobes, Materials, ScaleAnchor, Split, Surface};
use motes_shading::tracing::Ray;

use crate::MakeOptions;
use crate::cameras::ring;
use crate::scenes::{SceneName, SceneRecipe};
use crate::score::truth_folder::TruthFolder;
use crate::variant::recipe_of;
use crate::world::{Seen, World};

/// How far off the surface a Gaussian still counts as observed, in units of the scene.
const REACH: f32 = 0.02;

/// Writes the scene folder `output` for Gaussians trained on the photos of `truth`.
///
/// # Errors
/// When a file cannot be read or written.
pub fn write_oracle(
    name: SceneName,
    options: &MakeOptions,
    truth: &Path,
    gaussians: &Path,
    output: &Path,
) -> anyhow::Result<()> {
    let (recipe, lobes) = (recipe_of(name, options)?, options.lobes);
    let world = World::new(&recipe, lobes)?;
    let folder = TruthFolder::open(truth)?;
    std::fs::create_dir_all(output)?;
    let light = truth.join(format!("env/{}.exr", recipe.capture_light.0));
    let light = read_environment(&light)?.scaled(folder.exposure as f32);
    write_environment(&output.join("environment.exr"), &light, &[])?;
    let surface = true_surface(&world);
    write_surface(&output.join("surface.ply"), &surface)?;

    let mut file = open_gaussians(gaussians)?;
    let materials = true_materials(&world, &recipe, folder.size, &file.gaussians.means);
    let unobserved = materials.observations.iter().filter(|&&n| n == 0).count();
    materials.attach(&mut file.gaussians);
    write_gaussians(&output.join("gaussians.ply"), &file.gaussians, &PlyWriteOptions::default())?;
    let counts = DecompositionCounts {
        gaussians: materials.len() as u64,
        unobserved_gaussians: unobserved as u64,
        vertices: surface.vertices.len() as u64,
        triangles: surface.triangles.len() as u64,
    };
    let document = true_document(&recipe, lobes, &folder, counts);
    Ok(write_decomposition(output, &document)?)
}

/// The material of what lies nearest to every mean.
fn true_materials(
    world: &World,
    recipe: &SceneRecipe,
    size: (usize, usize),
    means: &[[f32; 3]],
) -> Materials {
    // From around the scene: the eye that sees a Gaussian's place tells what it is made of.
    let eyes: Vec<Vec3> = ring(recipe, size, 40, 0)
        .iter()
        .map(|s| s.camera_from_world.center_in_world().as_vec3())
        .collect();
    let mut materials = Materials::default();
    for mean in means {
        let p = Vec3::from(*mean);
        let seen: Vec<Seen> = eyes.iter().filter_map(|e| toward(world, *e, p)).collect();
        let best = seen.iter().min_by(|a, b| {
            let off = |s: &Seen| s.point.position.distance_squared(p);
            off(a).total_cmp(&off(b))
        });
        let (normal, m) = best.map_or((Vec3::Z, [0.5; 3].into()), |s| {
            (s.point.shading_normal, s.point.material.base_color_linear)
        });
        materials.normals.push(normal.to_array());
        materials.base_color_linear.push(m.to_array());
        materials.roughness.push(best.map_or(1.0, |s| s.point.material.roughness));
        materials.metallic.push(best.map_or(0.0, |s| s.point.material.metallic));
        materials.visibility.push(1.0);
        let near = |s: &&Seen| s.point.position.distance(p) < REACH * recipe.unit;
        materials.observations.push(seen.iter().filter(near).count() as u16);
    }
    materials
}

fn true_document(
    recipe: &SceneRecipe,
    lobes: Lobes,
    folder: &TruthFolder,
    counts: DecompositionCounts,
) -> DecompositionDocument {
    let term = |name: &str, kept: bool| TermDocument {
        name: name.into(),
        kept,
        evidence: "known, not found".into(),
        numbers: [].into(),
    };
    DecompositionDocument {
        format: DecompositionDocument::FORMAT.into(),
        version: format!("{}.{}", DecompositionDocument::MAJOR, DecompositionDocument::MINOR),
        made_by: "truth-scene".into(),
        gaussians: "gaussians.ply".into(),
        surface: "surface.ply".into(),
        environment: "environment.exr".into(),
        environment_convention: Convention::Blender,
        environment_up_in_world: None,
        up_in_world: [0.0, 0.0, 1.0],
        lobes: if recipe.lambert { Lobes::Lambert } else { lobes },
        indirect: true,
        tone_curve_contrast: None,
        fills_photos: Some(!recipe.is_masked),
        scale_anchor: ScaleAnchorDocument {
            kind: ScaleAnchor::Environment,
            explanation: "the true light".into(),
            factor_rgb: [1.0; 3],
        },
        terms: vec![term("specular", !recipe.lambert), term("indirect", true)],
        views: folder
            .views
            .iter()
            .map(|name| DecomposedViewDocument {
                name: format!("{name}.png"),
                split: Split::Test,
                psnr_db: None,
            })
            .collect(),
        counts,
        source_gaussians: None,
        seconds: None,
        step_times: Vec::new(),
    }
}

fn toward(world: &World, eye: Vec3, p: Vec3) -> Option<Seen> {
    world.see(&Ray::new(eye, (p - eye).try_normalize()?))
}

/// The meshes with the paint at their vertices.
fn true_surface(world: &World) -> Surface {
    let mut surface = Surface::default();
    for (vertex, normal, material) in world.vertices() {
        surface.vertices.push(vertex.to_array());
        surface.normals.push(normal.to_array());
        surface.base_color_linear.push(material.base_color_linear.to_array());
        surface.roughness.push(material.roughness);
        surface.metallic.push(material.metallic);
    }
    surface.triangles = world.triangles().to_vec();
    surface
}
