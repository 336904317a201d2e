//! The whole of inverse rendering: surface, light, material, Gaussians.

use std::ops::ControlFlow;

use glam::Vec3;
use motes_math::srgb::{decode, encode};
use motes_raster::RenderOptions;
use motes_scene::{Gaussians, Materials, Surface};
use motes_shading::environment::{Environment, Orientation};
use motes_shading::integrate::IntegrationOptions;
use motes_shading::tracing::MeshError;
use thiserror::Error;

use crate::attributes::{
    nearest_vertices, per_gaussian, vertex_base_color, vertex_materials, vertex_visibility,
};
use crate::cavities::darkening;
use crate::evidence::{median_distance, prior_log_base, share_of_bounce};
use crate::illumination::{Finder, Illumination, ReflectedLight};
use crate::light::cells::CellLight;
use crate::materials::basis::BasisScene;
use crate::materials::find::{PartMaterial, environment};
use crate::materials::profile::Kind;
use crate::materials::scale::ScaleEvidence;
use crate::observed::Observed;
use crate::options::{DecomposeOptions, TermChoice};
use crate::photo_fit::PhotoFit;
use crate::pixels::PixelShading;
use crate::reflection::{MirrorRound, Mirrors, Reshaped};
use crate::relief::{ReliefReport, Shaded};
use crate::rendered::rendered;
use crate::samples::SeenView;
use crate::splat_colors::{ColorTarget, colors_of, fit_colors};
use crate::{Photo, TracedSurface, normal_priors};

/// Why there is no decomposition.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum DecomposeError {
    /// The observer asked for it.
    #[error("the decomposition was cancelled")]
    Cancelled,
    /// Nothing to fit to.
    #[error("no point of the surface is seen by {0} photos: light and material cannot be told")]
    NothingSeen(usize),
    /// The mesh is broken.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// What is known beforehand.
#[derive(Debug, Default)]
pub struct Known {
    /// Light of every capture, photo units; empty when it is to be found.
    pub lights: Vec<Environment>,
    /// Base colours at points of the surface: the scale is set so that they come out.
    pub anchors: Vec<(Vec3, Vec3)>,
    /// Base colours that another program predicted, per photo, `[h, w, 3]`, linear, up to a factor per photo.
    pub base_color_priors: Vec<Option<motes_scene::ImageF32>>,
    /// Normals that another program predicted, per photo, `[h, w, 3]`, unit vectors in world; shorter than 1/2 where there is none.
    pub normal_priors: Vec<Option<motes_scene::ImageF32>>,
}

/// What the scale of light against base colour rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// The light was given.
    Environment,
    /// A base colour was given.
    BaseColor,
    /// Highlights.
    Specular,
    /// What base colours usually are.
    Prior,
}

/// A view under the found light.
#[derive(Clone, Debug)]
pub struct RenderedView {
    /// Index of the photo.
    pub photo: usize,
    /// Linear, photo units, `[h, w, 3]`; 0 where the surface is missed.
    pub radiance_linear: motes_scene::ImageF32,
    /// Base colour as the Gaussians show it, `[h, w, 3]`.
    pub base_color_linear: motes_scene::ImageF32,
    /// PSNR of the sRGB-encoded picture where the surface is hit, dB.
    pub psnr_db: f64,
}

/// What inverse rendering found.
#[derive(Debug)]
pub struct Decomposition {
    /// The Gaussians with shapes, opacities and captured colours as the photos have them under one base colour each; same rows.
    /// None without `photo_steps`.
    pub refined: Option<Gaussians>,
    /// Materials of the Gaussians.
    pub materials: Materials,
    /// The surface with its materials.
    pub surface: Surface,
    /// Light per capture; none when it was given.
    pub lights: Vec<CellLight>,
    /// What the scale rests on.
    pub anchor: Anchor,
    /// Factor that the anchor put on base colours.
    pub base_color_factor: Vec3,
    /// What highlights say about the scale.
    pub scale: ScaleEvidence,
    /// Materials of the parts.
    pub parts: Vec<PartMaterial>,
    /// Whether a bounce of light belongs to the model, and the mean share of the irradiance that it is.
    pub indirect: bool,
    /// Mean share of irradiance that comes from the surface itself.
    pub indirect_share: f32,
    /// Share of the cost of the views without highlights that highlights save.
    pub specular_gain: f32,
    /// Whether any part has a specular lobe.
    pub specular: bool,
    /// Views under the found light: every photo that was asked for.
    pub views: Vec<RenderedView>,
    /// Cells of the light after every round, and the cost of the fit before and after.
    pub light_rounds: Vec<(usize, f64, f64)>,
    /// What came of fitting the light to what is reflected; none where nothing is.
    pub reflected_light: Option<ReflectedLight>,
    /// What shading moved; none where it moved nothing.
    pub relief: Option<ReliefReport>,
    /// Rounds that turned metals to what they mirror.
    pub mirror_rounds: Vec<MirrorRound>,
    /// Points that were fitted to.
    pub samples: usize,
}

/// Indirect light below this share of the irradiance is left out.
const LEAST_INDIRECT: f32 = 0.005;

/// Called before every step with its name and the share of the work that is done.
pub type Observer<'a> = dyn FnMut(&'static str, f32) -> ControlFlow<()> + 'a;

/// Takes apart what `photos` show of `surface`. `score` are further photos that are only compared with.
///
/// # Errors
/// When the observer stops it, no point is seen twice, or the mesh refers to vertices that do not exist.
#[expect(clippy::too_many_arguments, reason = "the inputs of a whole stage")]
pub fn decompose(
    surface: Surface,
    gaussians: &Gaussians,
    photos: &[Photo],
    score: &[Photo],
    known: &Known,
    render: &RenderOptions,
    orientation: Orientation,
    options: &DecomposeOptions,
    seed: u64,
    observer: &mut Observer<'_>,
) -> Result<Decomposition, DecomposeError> {
    let mut step = |name, done| match observer(name, done) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(DecomposeError::Cancelled),
    };
    step("points", 0.0)?;
    let mut scene = TracedSurface::new(surface)?;
    let views: Vec<SeenView<'_>> = photos.iter().map(|p| SeenView::new(p, &scene)).collect();
    normal_priors::apply(&mut scene, &views, &known.normal_priors, options.weight_prior_normals);
    let light_count = photos.iter().map(|p| p.light + 1).max().unwrap_or(1);
    let lights_of_surface = if options.indirect == TermChoice::Off { 0 } else { light_count };
    let mut seen = Observed::new(scene, views, options.samples, lights_of_surface)?;
    let finder = Finder {
        known,
        options,
        orientation,
        light_count,
        distance: median_distance(&seen.samples, &seen.views),
        priors: prior_log_base(&seen.samples, &seen.views, known),
        seed,
    };
    let ray_bias = finder.ray_bias();

    step("light", 0.05)?;
    let is_known = !known.lights.is_empty();
    let mut light_rounds = Vec::new();
    let mut cells = Vec::new();
    let mut lights = known.lights.clone();
    if !is_known {
        let found = finder.problem(&seen).solve(options, seed);
        let costs = found.cells.iter().zip(found.costs.iter().skip(1));
        light_rounds = costs.map(|(n, c)| (*n, c.0, c.1)).collect();
        cells = found.lights;
        lights = cells.iter().map(environment).collect();
    }
    let mut indirect_share = 0.0;
    if !seen.vertex_radiance.is_empty() {
        indirect_share = share_of_bounce(&seen, &lights, ray_bias, seed);
        if options.indirect == TermChoice::Auto && indirect_share < LEAST_INDIRECT {
            seen.vertex_radiance.clear();
        }
    }

    step("material", 0.3)?;
    let mut lit = Illumination::new(&finder, &seen, cells, lights);
    let mut reflected_light = None;
    if !is_known {
        for round in 0..2 {
            step("scale", 0.4 + 0.05 * round as f32)?;
            lit.rescale(&finder, &seen);
        }
        step("reflected light", 0.48)?;
        let rounds = options.reflected_light_rounds;
        if let Some((fitted, report)) = lit.by_reflections(&finder, &seen, rounds) {
            reflected_light = Some(report);
            if report.kept {
                lit = fitted;
            }
        }
    }
    let Illumination { cells: cell_lights, lights, materials: mut found, factor, anchor, .. } = lit;

    let mut relief = None;
    if options.relief_rounds > 0 {
        step("relief", 0.5)?;
        let materials = vertex_materials(&seen.scene, &seen.samples, &found);
        let shaded = Shaded {
            scene: &seen.scene,
            views: &seen.views,
            lights: &lights,
            vertex_radiance: &seen.vertex_radiance,
            materials: &materials,
            smoothness: options.weight_smooth_relief,
            ray_bias,
            seed,
        };
        if let Some((surface, report)) = shaded.reshaped(options.relief_rounds) {
            relief = Some(report);
            seen.move_to(surface, photos, options.samples)?;
            found = finder.materials(&seen, &lights);
        }
    }
    let mut mirror_rounds = Vec::new();
    for round in 0..options.mirror_rounds {
        if found.parts.iter().all(|p| p.kind != Kind::Metal) {
            break;
        }
        step("reflections", 0.55 + 0.05 * round as f32 / options.mirror_rounds as f32)?;
        let materials = vertex_materials(&seen.scene, &seen.samples, &found);
        let mirrors = Mirrors {
            scene: &seen.scene,
            views: &seen.views,
            lights: &lights,
            vertex_radiance: &seen.vertex_radiance,
            materials: &materials,
            smoothness: options.weight_smooth_normals,
            ray_bias,
        };
        let Some(Reshaped { surface, roughness, round: report }) =
            mirrors.reshaped(seed.wrapping_add(u64::from(round)))
        else {
            break;
        };
        mirror_rounds.push(report);
        seen.move_to(surface, photos, options.samples)?;
        found = finder.materials(&seen, &lights);
        found.take_roughness(&seen.samples, &seen.scene.surface, &roughness);
    }

    step("pixels", 0.6)?;
    let Observed { scene, views, samples, vertex_radiance } = seen;
    let materials = vertex_materials(&scene, &samples, &found);
    let specular = found.parts.iter().any(|p| p.kind != Kind::Matte);
    let brdf_samples = if specular { options.pixel_rays / 3 } else { 0 }
        .max(u32::from(!vertex_radiance.is_empty()) * options.pixel_rays / 4);
    let basis_scene = BasisScene {
        scene: &scene,
        lights: &lights,
        vertex_radiance: &vertex_radiance,
        lobes: options.lobes.into(),
        options: IntegrationOptions {
            light_samples: options.pixel_rays.saturating_sub(brdf_samples).max(1),
            brdf_samples,
            ray_bias,
            seed,
            ..IntegrationOptions::default()
        },
    };
    let scored: Vec<SeenView<'_>> = score.iter().map(|p| SeenView::new(p, &scene)).collect();
    let mut shadings: Vec<PixelShading> = views
        .iter()
        .chain(&scored)
        .enumerate()
        .map(|(i, view)| PixelShading::integrate(view, i, &materials, &basis_scene))
        .collect();
    let dark = darkening(&scene, &views, &shadings[..views.len()], &materials);
    for (shading, view) in shadings.iter_mut().zip(views.iter().chain(&scored)) {
        shading.darken(view, &scene, &dark);
    }
    let targets: Vec<ColorTarget> = views
        .iter()
        .zip(&shadings)
        .map(|(view, shading)| {
            let (color, weight) = shading.base_color(view);
            let (camera, camera_from_world) = (view.photo.camera, view.photo.camera_from_world);
            ColorTarget { camera, camera_from_world, color, weight }
        })
        .collect();

    step("colours", 0.65)?;
    let base = vertex_base_color(&scene, &views, &targets, &found);
    let mut nearest = nearest_vertices(&scene.surface, gaussians);
    let typical = Vec3::splat(options.typical_base_color);
    let start: Vec<Vec3> =
        nearest.iter().map(|v| v.map_or(typical, |v| base[v]).map(encode)).collect();
    let fitted = fit_colors(gaussians, &targets, &start, options.color_passes, render);
    drop(targets);
    let mut model = gaussians.colored(|i| fitted.colors[i].to_array());
    let mut refined = None;
    if options.photo_steps > 0 {
        let fit = PhotoFit { views: &views, shadings: &shadings, render, seed };
        let (captured, base) = fit.fit(gaussians, &model, options.photo_steps, |done| {
            step("photos", 0.7 + 0.25 * done)
        })?;
        nearest = nearest_vertices(&scene.surface, &captured);
        (refined, model) = (Some(captured), base);
    }
    let views = rendered(&model, render, views.iter().chain(&scored), &shadings);

    step("attributes", 0.95)?;
    let visibility = vertex_visibility(&scene, ray_bias, seed);
    let materials_of_gaussians = Materials {
        normals: per_gaussian(&nearest, |v| scene.surface.normals[v], [0.0, 0.0, 1.0]),
        base_color_linear: colors_of(&model).iter().map(|c| c.map(decode).to_array()).collect(),
        roughness: per_gaussian(&nearest, |v| materials.roughness[v], 1.0),
        metallic: per_gaussian(&nearest, |v| materials.metallic[v], 0.0),
        visibility: per_gaussian(&nearest, |v| visibility[v], 1.0),
        observations: fitted.observations,
    };
    let surface = Surface {
        base_color_linear: base.iter().map(Vec3::to_array).collect(),
        roughness: materials.roughness,
        metallic: materials.metallic,
        ..scene.surface
    };
    Ok(Decomposition {
        refined,
        materials: materials_of_gaussians,
        surface,
        lights: cell_lights,
        anchor,
        base_color_factor: factor,
        scale: found.scale,
        specular_gain: found.specular_gain,
        parts: found.parts,
        indirect: !vertex_radiance.is_empty(),
        indirect_share,
        specular,
        views,
        light_rounds,
        reflected_light,
        relief,
        mirror_rounds,
        samples: samples.len(),
    })
}
