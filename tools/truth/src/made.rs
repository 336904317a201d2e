//! How a ground-truth folder was made, so that more test views can be added to it.

use std::path::Path;

use anyhow::Context as _;
use motes_shading::brdf::Lobes;
use serde::Deserialize;

use crate::cameras::{Shot, ring};
use crate::faults::Fault;
use crate::folder::Folder;
use crate::photography::Camera;
use crate::scenes::SceneRecipe;

/// What the folder says about itself.
#[derive(Deserialize)]
struct Document {
    title: String,
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

/// How a folder was made.
pub(crate) struct Made {
    /// Photo value over radiance.
    pub(crate) exposure: f64,
    /// Paths per pixel.
    pub(crate) samples: u32,
    /// Surfaces after the first.
    pub(crate) bounces: u32,
    /// Key of all random numbers.
    pub(crate) seed: u64,
    /// Of what is not Lambert.
    pub(crate) lobes: Lobes,
    /// Number of the first test view.
    pub(crate) first: usize,
    /// The test views.
    pub(crate) shots: Vec<Shot>,
    camera: Camera,
}

impl Made {
    /// Reads the documents of a folder that [`crate::make`] wrote for `recipe`.
    ///
    /// # Errors
    /// A document is missing or malformed, or of another scene.
    pub(crate) fn read(folder: &Path, recipe: &SceneRecipe) -> anyhow::Result<Self> {
        let made: Document = document(folder, "scene.json")?;
        anyhow::ensure!(
            made.title == recipe.name,
            "{} is a folder of the scene {}",
            folder.display(),
            made.title
        );
        let count = |file: &str| document::<Frames>(folder, file).map(|d| d.frames.len());
        let (train, test) = (count("transforms_train.json")?, count("transforms_test.json")?);
        let shots = ring(recipe, (made.width, made.width * 3 / 4), train, test).split_off(train);
        Ok(Self {
            exposure: made.exposure,
            samples: made.samples,
            bounces: made.bounces,
            seed: made.seed,
            lobes: if made.bsdf == "principled" { Lobes::Principled } else { Lobes::Burley },
            first: train,
            shots,
            camera: Camera { faults: made.faults, seed: made.seed },
        })
    }

    /// The folder, to write more pictures into.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn reopen(&self, folder: &Path, recipe: &SceneRecipe) -> anyhow::Result<Folder> {
        let out = Folder::create(folder, self.exposure)?.taken_with(self.camera.clone());
        Ok(out.with_masks(recipe.is_masked))
    }
}

fn document<T: serde::de::DeserializeOwned>(folder: &Path, file: &str) -> anyhow::Result<T> {
    let path = folder.join(file);
    let named = || path.display().to_string();
    let text = std::fs::read_to_string(&path).with_context(named)?;
    serde_json::from_str(&text).with_context(named)
}
