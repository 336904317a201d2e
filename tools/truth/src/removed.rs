//! A scene without one of its objects, as the test views of a folder show it.

use std::path::Path;

use anyhow::Context as _;
use motes_shading::brdf::Lobes;
use serde::Deserialize;

use crate::cameras::ring;
use crate::expose;
use crate::faults::Fault;
use crate::folder::Folder;
use crate::lights::environment;
use crate::path::PathTracer;
use crate::photography::Camera;
use crate::render::{Buffers, buffers};
use crate::scenes::SceneName;
use crate::world::World;

/// What the folder says about how it was made.
#[derive(Deserialize)]
struct Made {
    width: usize,
    exposure: f64,
    samples: u32,
    bounces: u32,
    seed: u64,
    bsdf: String,
    #[serde(default)]
    faults: Vec<Fault>,
}

#[derive(Deserialize)]
struct Frames {
    frames: Vec<serde_json::Value>,
}

/// Writes `test/removed_OBJECT/` into a folder that [`crate::make`] wrote: the test views under the light of the photos as pictures
/// and as ids, without an object.
///
/// # Errors
/// When the scene has no such object, the folder is of another scene, or a file cannot be read or written.
pub fn make_removed(name: SceneName, object: &str, folder: &Path) -> anyhow::Result<()> {
    let mut recipe = name.recipe();
    let names: Vec<&str> = recipe.things.iter().map(|thing| thing.name).collect();
    let Some(gone) = names.iter().position(|name| *name == object) else {
        anyhow::bail!("there is no object {object}, but {}", names.join(", "));
    };
    recipe.things.remove(gone);
    let read = |file: &str| {
        let path = folder.join(file);
        std::fs::read_to_string(&path).with_context(|| path.display().to_string())
    };
    let made: Made = serde_json::from_str(&read("scene.json")?).context("scene.json")?;
    let count = |file: &str| -> anyhow::Result<usize> {
        let document: Frames =
            serde_json::from_str(&read(file)?).with_context(|| file.to_owned())?;
        Ok(document.frames.len())
    };
    let (train, test) = (count("transforms_train.json")?, count("transforms_test.json")?);
    let lobes = if made.bsdf == "principled" { Lobes::Principled } else { Lobes::Burley };
    let world = World::new(&recipe, lobes)?;
    let shots = ring(&recipe, (made.width, made.width * 3 / 4), train, test);
    let mut guides: Vec<Buffers> =
        shots[train..].iter().map(|shot| buffers(&world, shot)).collect();
    let light = environment(&recipe.capture_light.1.picture()?)?;
    let views = shots[train..].iter().zip(&guides).zip(train..);
    let tracer = PathTracer::new(&world, &light, made.bounces, made.seed).with_lamps();
    let frames = expose(&tracer, views, made.samples, made.seed);
    let camera = Camera { faults: made.faults, seed: made.seed };
    let out = Folder::create(folder, made.exposure)?.taken_with(camera);
    let place = format!("test/removed_{object}");
    out.frames(&place, &shots[train..], &frames)?;
    for (shot, guide) in shots[train..].iter().zip(&mut guides) {
        // The ids of the whole scene: 1 is the ground, 2 the first object.
        let first_later = gone as u8 + 2;
        guide.ids.iter_mut().filter(|id| **id >= first_later).for_each(|id| *id += 1);
        out.ids_as(&format!("{place}/{}_id.png", shot.name), guide)?;
    }
    Ok(())
}
