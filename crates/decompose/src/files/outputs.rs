//! The scene folder that `decompose` writes.

use std::path::Path;

use crate::{Anchor, Decomposition, LobesChoice, Photo};
use anyhow::Context as _;
use glam::Vec3;
use motes_formats::capture::SplitDocument;
use motes_formats::decomposition::{
    ConventionDocument, DecomposedViewDocument, DecompositionCounts, DecompositionDocument,
    LobesDocument, ScaleAnchorDocument, ScaleAnchorKind, TermDocument, write_decomposition,
};
use motes_formats::documents::Document as _;
use motes_formats::environment::write_environment;
use motes_formats::images::write_png;
use motes_formats::ply::{PlyWriteOptions, write_gaussians, write_surface};
use motes_formats::selection::BoundGaussians;
use motes_math::srgb;
use motes_scene::{Gaussians, ImageF32};
use motes_shading::environment::{Convention, Environment, Orientation, direction_from_uv};

use super::report::terms;

/// What is written beside the decomposition itself.
#[derive(Debug)]
pub(super) struct SceneFolder<'a> {
    /// The folder.
    pub path: &'a Path,
    /// Axes of `environment.exr`.
    pub convention: Convention,
    /// Away from the ground.
    pub up_in_world: Vec3,
    /// Lobes of the materials.
    pub lobes: LobesChoice,
    /// About the residual, when there is one.
    pub residual: Option<TermDocument>,
    /// How the Gaussians are written.
    pub ply: PlyWriteOptions,
    /// Training photos, then those that were only compared with.
    pub photos: Vec<&'a Photo>,
    /// How many of them are training photos.
    pub trained: usize,
    /// How many views get previews.
    pub previews: usize,
    /// The Gaussians that were taken apart.
    pub source: BoundGaussians,
    /// Elapsed seconds.
    pub seconds: f64,
    /// Program and version.
    pub made_by: String,
}

/// Width of `environment.exr`.
const MAP_WIDTH: usize = 256;

/// Writes everything; `decomposition.json` last, so that a folder with it is whole.
///
/// # Errors
/// When a file cannot be written.
pub(super) fn write_scene(
    folder: &SceneFolder<'_>,
    gaussians: &Gaussians,
    result: &Decomposition,
    maps: &[ImageF32],
) -> anyhow::Result<DecompositionDocument> {
    let path = folder.path;
    std::fs::create_dir_all(path).with_context(|| format!("cannot make {}", path.display()))?;
    write_gaussians(&path.join("gaussians.ply"), gaussians, &folder.ply)?;
    write_surface(&path.join("surface.ply"), &result.surface)?;
    let attributes = [("motes made by".to_owned(), folder.made_by.clone())];
    for (k, map) in maps.iter().enumerate() {
        let name = if k == 0 { "environment.exr".into() } else { format!("environment_{k}.exr") };
        write_environment(&path.join(name), map, &attributes)?;
    }
    previews(folder, gaussians, result, maps.first())?;
    let document = document(folder, gaussians, result);
    write_decomposition(path, &document)?;
    Ok(document)
}

/// The light of every capture, photo units: `known`, or what was found.
pub(super) fn maps_of(
    known: Option<&Environment>,
    convention: Convention,
    result: &Decomposition,
) -> Vec<ImageF32> {
    match known {
        Some(light) => vec![map_of(light, convention)],
        None => result.lights.iter().map(|light| light.image(MAP_WIDTH)).collect(),
    }
}

fn map_of(light: &Environment, convention: Convention) -> ImageF32 {
    let mut image = ImageF32::filled(2 * MAP_WIDTH, MAP_WIDTH, 3, 0.0);
    let orientation = Orientation::new(convention);
    for y in 0..image.height {
        for x in 0..image.width {
            let (u, v) =
                ((x as f64 + 0.5) / image.width as f64, (y as f64 + 0.5) / image.height as f64);
            let d = orientation.world_from_map(direction_from_uv(u, v)).as_vec3();
            image.pixel_mut(x, y).copy_from_slice(&light.radiance_pdf(d).0.to_array());
        }
    }
    image
}

fn document(
    folder: &SceneFolder<'_>,
    gaussians: &Gaussians,
    result: &Decomposition,
) -> DecompositionDocument {
    let unobserved = result.materials.observations.iter().filter(|&&n| n == 0).count();
    DecompositionDocument {
        format: DecompositionDocument::FORMAT.into(),
        version: DecompositionDocument::version(),
        made_by: folder.made_by.clone(),
        gaussians: "gaussians.ply".into(),
        surface: "surface.ply".into(),
        environment: "environment.exr".into(),
        environment_convention: match folder.convention {
            Convention::OpenExr => ConventionDocument::Openexr,
            Convention::Blender => ConventionDocument::Blender,
            Convention::ThreeJs => ConventionDocument::Threejs,
        },
        up_in_world: folder.up_in_world.as_dvec3().to_array(),
        lobes: match folder.lobes {
            LobesChoice::Lambert => LobesDocument::Lambert,
            _ if !result.specular => LobesDocument::Lambert,
            LobesChoice::Principled => LobesDocument::Principled,
            LobesChoice::Burley => LobesDocument::Burley,
        },
        indirect: result.indirect,
        scale_anchor: scale_anchor(result),
        terms: terms(result).into_iter().chain(folder.residual.clone()).collect(),
        views: result
            .views
            .iter()
            .map(|view| DecomposedViewDocument {
                name: folder.photos[view.photo].name.clone(),
                split: if view.photo < folder.trained {
                    SplitDocument::Train
                } else {
                    SplitDocument::Test
                },
                psnr_db: Some(view.psnr_db).filter(|v| v.is_finite()),
            })
            .collect(),
        counts: DecompositionCounts {
            gaussians: gaussians.len() as u64,
            unobserved_gaussians: unobserved as u64,
            vertices: result.surface.vertices.len() as u64,
            triangles: result.surface.triangles.len() as u64,
        },
        source_gaussians: Some(folder.source.clone()),
        seconds: Some(folder.seconds),
    }
}

fn scale_anchor(result: &Decomposition) -> ScaleAnchorDocument {
    let spread = 100.0 * (result.scale.log_spread.exp() - 1.0);
    let (kind, explanation) = match result.anchor {
        Anchor::Environment => (ScaleAnchorKind::Environment, "the light was given".to_owned()),
        Anchor::BaseColor => {
            (ScaleAnchorKind::AlbedoAnchor, "base colours were given at points of the surface".to_owned())
        }
        Anchor::Specular => (
            ScaleAnchorKind::Specular,
            format!("highlights of {} points, whose coat reflects 4 % of the light whatever their base colour, within {spread:.0} %, with what base colours usually are", result.scale.samples),
        ),
        Anchor::Prior => (
            ScaleAnchorKind::Prior,
            "nothing in the photos tells the scale: base colours were taken to be what they usually are; give --environment or --albedo-anchor to set it".to_owned(),
        ),
    };
    let factor_rgb = result.base_color_factor.as_dvec3().to_array();
    ScaleAnchorDocument { kind, explanation, factor_rgb }
}

/// `previews/VIEW_COMPONENT.png` of some views, and the light.
fn previews(
    folder: &SceneFolder<'_>,
    gaussians: &Gaussians,
    result: &Decomposition,
    map: Option<&ImageF32>,
) -> anyhow::Result<()> {
    if folder.previews == 0 || result.views.is_empty() {
        return Ok(());
    }
    let path = folder.path.join("previews");
    std::fs::create_dir_all(&path).with_context(|| format!("cannot make {}", path.display()))?;
    let step = result.views.len().div_ceil(folder.previews);
    for view in result.views.iter().step_by(step) {
        let photo = folder.photos[view.photo];
        let stem =
            Path::new(&photo.name).with_extension("").to_string_lossy().replace(['/', '\\'], "_");
        let attribute = |of: &dyn Fn(usize) -> [f32; 3]| {
            motes_raster::render(
                &gaussians.colored(of),
                &photo.camera,
                &photo.camera_from_world,
                &Default::default(),
            )
            .color
        };
        let m = &result.materials;
        let parts = [
            ("photo", encoded(&photo.radiance_linear)),
            ("rendered", encoded(&view.radiance_linear)),
            ("base_color", encoded(&view.base_color_linear)),
            ("normal", attribute(&|i| m.normals[i].map(|v| 0.5 * v + 0.5))),
            ("roughness", attribute(&|i| [m.roughness[i]; 3])),
            ("metallic", attribute(&|i| [m.metallic[i]; 3])),
            ("visibility", attribute(&|i| [m.visibility[i]; 3])),
        ];
        for (name, image) in parts {
            write_png(&path.join(format!("{stem}_{name}.png")), &image.to_u8())?;
        }
    }
    if let Some(map) = map {
        // Exposed for the mean: a sun is white in it.
        let mean = map.data.iter().sum::<f32>() / map.data.len().max(1) as f32;
        let exposed = map.clone().scaled(0.5 / mean.max(1e-6));
        write_png(&path.join("environment.png"), &encoded(&exposed).to_u8())?;
    }
    Ok(())
}

fn encoded(linear: &ImageF32) -> ImageF32 {
    let mut image = linear.clone();
    image.data.iter_mut().for_each(|v| *v = srgb::encode_clipped(*v));
    image
}
