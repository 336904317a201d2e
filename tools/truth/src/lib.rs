//! Ground truth for inverse rendering.
//!
//! [`make`] writes a folder: photos of a made scene with cameras, its lights, the same views under
//! other lights, and the buffers of what is really there. `docs/formats/ground-truth.md` describes
//! the layout. Everything is made of numbers: the shapes, the textures, the lights.
//!
//! Invariant: for one recipe, one size and one seed the files are the same at any thread count.

pub mod asset;
pub mod cameras;
pub mod changed;
mod denoise;
pub mod faults;
pub mod folder;
pub mod glass;
pub mod lamps;
pub mod lights;
mod made;
pub mod oracle;
pub mod path;
pub mod photography;
pub mod photos;
mod points;
pub mod predictions;
pub mod probe;
pub mod render;
pub mod repainted;
pub mod scenes;
pub mod score;
pub mod shapes;
mod texture;
pub mod variant;
pub mod world;

use std::path::Path;

use anyhow::Context as _;
use motes_scene::ImageF32;
use motes_shading::brdf::Lobes;

use crate::cameras::{Shot, ring};
use crate::faults::Fault;
use crate::folder::Folder;
use crate::lights::{Light, environment};
use crate::path::PathTracer;
use crate::photography::Camera;
use crate::photos::Photos;
use crate::render::{Buffers, buffers, radiance};
use crate::scenes::SceneName;
use crate::world::World;

pub use changed::make_removed;

/// How a scene is made.
#[derive(Clone, Debug)]
pub struct MakeOptions {
    /// Columns; rows are three quarters.
    pub width: usize,
    /// Photos.
    pub train_views: usize,
    /// Views with buffers and relit pictures.
    pub test_views: usize,
    /// Paths per pixel, each with four directions from the light at its first surface.
    pub samples: u32,
    /// Surfaces after the first.
    pub bounces: u32,
    /// Lobes of what is not Lambert.
    pub lobes: Lobes,
    /// What is wrong with the camera; the scene's own faults when none.
    pub faults: Option<Vec<Fault>>,
    /// Key of all random numbers.
    pub seed: u64,
    /// An object that is left out.
    pub omit: Option<String>,
    /// The light of the photos, one of the scene's; its own when none.
    pub light: Option<String>,
    /// Photo value over radiance; found from the photos when none.
    pub exposure: Option<f64>,
    /// Leave out the pictures under other lights.
    pub no_relights: bool,
}

impl Default for MakeOptions {
    fn default() -> Self {
        Self {
            width: 480,
            train_views: 20,
            test_views: 6,
            samples: 8,
            bounces: 3,
            lobes: Lobes::Burley,
            faults: None,
            seed: 0,
            omit: None,
            light: None,
            exposure: None,
            no_relights: false,
        }
    }
}

/// Share of the photos' pixels that may be brighter than white.
const CLIPPED: f64 = 0.01;

/// Makes a scene and writes it to `folder`; `say` hears about every light.
///
/// # Errors
/// When a file cannot be written.
pub fn make(
    name: SceneName,
    options: &MakeOptions,
    folder: &Path,
    say: &mut dyn FnMut(&str),
) -> anyhow::Result<()> {
    let recipe = variant::recipe_of(name, options)?;
    let world = World::new(&recipe, options.lobes)?;
    let size = (options.width, options.width * 3 / 4);
    let shots = ring(&recipe, size, options.train_views, options.test_views);
    let guides: Vec<Buffers> = shots.iter().map(|shot| buffers(&world, shot)).collect();
    let train = options.train_views;

    let faults = options.faults.clone().unwrap_or_else(|| recipe.faults.clone());
    let camera = Camera { faults, seed: options.seed };

    // Salt 0 is the light of the photos, which the scene's lamps are part of.
    let take = |light: &Light, which: std::ops::Range<usize>, samples, salt: u64| {
        let picture = light.picture()?;
        let environment = environment(&picture)?;
        let seed = options.seed ^ (salt << 32);
        let frames = shots[which.clone()].iter().zip(&guides[which.clone()]).zip(which.clone());
        let tracer = PathTracer::new(&world, &environment, options.bounces, seed);
        let tracer = if salt == 0 { tracer.with_lamps() } else { tracer };
        anyhow::Ok((picture, expose(&tracer, frames, samples, seed)))
    };
    let (capture, light) = &recipe.capture_light;
    say(&format!("{}: {train} photos under {capture}", recipe.name));
    let (picture, photos) = take(light, 0..train, options.samples, 0)?;
    let exposure = options.exposure.unwrap_or_else(|| exposure_of(&photos, &guides, &recipe));
    let out = Folder::create(folder, exposure).context("the folder of the scene")?;
    let out = out.taken_with(camera.clone()).with_masks(recipe.is_masked);
    out.light(capture, &picture)?;
    for (view, (shot, frame)) in (0..).zip(shots.iter().zip(&photos)) {
        let photo = camera.photo(&frame.clone().scaled(exposure as f32), shot.focal, view);
        let photo = out.masked(photo, &guides[view as usize]);
        out.png(&format!("images/{}.png", shot.name), &photo)?;
    }
    let (_, frames) = take(light, train..shots.len(), options.samples, 0)?;
    out.frames("test/capture", &shots[train..], &frames, &guides[train..])?;
    let mut lights = vec![(*capture, picture)];
    for (k, (name, light)) in recipe.relights.iter().enumerate() {
        say(&format!("{}: {} views under {name}", recipe.name, options.test_views));
        let (picture, frames) = take(light, train..shots.len(), options.samples, k as u64 + 1)?;
        out.light(name, &picture)?;
        let place = format!("test/relight_{name}");
        out.frames(&place, &shots[train..], &frames, &guides[train..])?;
        lights.push((name, picture));
    }
    for (i, (shot, guide)) in shots.iter().zip(&guides).enumerate() {
        if i >= train {
            out.buffers(shot, guide)?;
        }
        out.ids(shot, guide)?;
    }
    let all = Photos { shots: &shots, train, guides: &guides, photos: &photos, exposure };
    let target = recipe.origin.as_dvec3() + recipe.views.target * f64::from(recipe.unit);
    let mut told = camera.told(&shots[..train], target);
    told.extend_from_slice(&shots[train..]);
    let points = points::sparse_points(&world, &all, options.seed);
    let all = Photos { shots: &told, ..all };
    out.colmap(&all, &points)?;
    out.documents(&recipe, &world, &all, &lights, options)
}

fn expose<'a>(
    tracer: &PathTracer<'_>,
    views: impl Iterator<Item = ((&'a Shot, &'a Buffers), usize)>,
    samples: u32,
    seed: u64,
) -> Vec<ImageF32> {
    views
        .map(|((shot, guide), i)| radiance(tracer, shot, guide, samples, (seed, i as u64)))
        .collect()
}

/// The exposure that leaves [`CLIPPED`] of the metered pixels too bright, to three digits.
fn exposure_of(photos: &[ImageF32], guides: &[Buffers], recipe: &scenes::SceneRecipe) -> f64 {
    // 1 is the ground, whether the scene has one or not.
    let first_lamp = 2 + recipe.things.len();
    let is_metered = |coverage: f32, id: u8| {
        (!recipe.is_masked || coverage > 0.0)
            && (recipe.meters_lamps || usize::from(id) < first_lamp)
    };
    let of_photo = |(photo, guide): (&ImageF32, &Buffers)| -> Vec<f32> {
        let pixels = photo.data.chunks_exact(3).zip(guide.coverage.data.iter().zip(&guide.ids));
        let counted = pixels.filter(|(_, (coverage, id))| is_metered(**coverage, **id));
        counted.map(|(c, _)| c[0].max(c[1]).max(c[2])).collect()
    };
    let mut brightest: Vec<f32> = photos.iter().zip(guides).flat_map(of_photo).collect();
    brightest.sort_unstable_by(f32::total_cmp);
    let last = brightest.len().saturating_sub(1) as f64;
    let white = brightest.get((last * (1.0 - CLIPPED)) as usize).copied().unwrap_or(1.0);
    let exposure = 1.0 / f64::from(white.max(1e-6));
    let digits = 10f64.powi(2 - exposure.log10().floor() as i32);
    (exposure * digits).round() / digits
}
