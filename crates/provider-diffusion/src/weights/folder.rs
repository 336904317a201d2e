//! The parts of a model's folder in the layout of diffusers.

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::error::{DiffusionError, Result};

/// A configuration larger than this is none.
const MOST_JSON_BYTES: u64 = 64 << 20;
const WHOLE: &str = "name the folder that has model_index.json, with all of its parts";
const FILES: [&str; 4] = [
    "diffusion_pytorch_model.safetensors",
    "model.safetensors",
    "diffusion_pytorch_model.fp16.safetensors",
    "model.fp16.safetensors",
];

/// A network of a model: its weights and its configuration.
pub struct Part {
    /// The safetensors file.
    pub path: PathBuf,
    /// `config.json`.
    pub config: Value,
}

/// The part `name` of a model's folder: `unet`, `vae` or `text_encoder`.
///
/// # Errors
/// There is none, or it holds no safetensors.
pub fn part(folder: &Path, name: &str) -> Result<Part> {
    if folder.is_file() {
        let help = "name the folder that has model_index.json, unet/, vae/ and text_encoder/";
        let cause = "a file where the folder of a model is due";
        return Err(DiffusionError::weights(cause, folder, help));
    }
    if !folder.is_dir() {
        return Err(DiffusionError::weights("no such folder", folder, WHOLE));
    }
    let place = folder.join(name);
    if !place.join("config.json").is_file() {
        return Err(DiffusionError::weights(format!("no {name} of a model"), &place, WHOLE));
    }
    let config: Value = read_json(&place.join("config.json"))?;
    match FILES.map(|file| place.join(file)).into_iter().find(|path| path.is_file()) {
        Some(path) => Ok(Part { path, config }),
        None => Err(DiffusionError::weights(
            "no weights in safetensors",
            &place,
            "get diffusion_pytorch_model.safetensors or model.safetensors; .bin files could run code",
        )),
    }
}

impl Part {
    /// The configuration as a type.
    ///
    /// # Errors
    /// It is that of another kind of network.
    pub fn config<T: DeserializeOwned>(&self) -> Result<T> {
        serde_json::from_value(self.config.clone()).map_err(|error| {
            let cause = format!("the configuration is of another kind of network ({error})");
            DiffusionError::weights(
                cause,
                &self.path.with_file_name("config.json"),
                "check the folder",
            )
        })
    }
}

/// `scheduler_config.json` of a model's folder.
///
/// # Errors
/// It cannot be read.
pub fn scheduler(folder: &Path) -> Result<Value> {
    read_json(&folder.join("scheduler/scheduler_config.json"))
}

/// A JSON document of a model.
///
/// # Errors
/// It cannot be read or is none.
pub fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let bad = |cause: String| DiffusionError::weights(cause, path, WHOLE);
    let bytes = std::fs::metadata(path).map_err(|e| bad(format!("cannot be read ({e})")))?.len();
    if bytes > MOST_JSON_BYTES {
        return Err(bad(format!("no JSON of a model: {bytes} bytes")));
    }
    let text = std::fs::read(path).map_err(|e| bad(format!("cannot be read ({e})")))?;
    serde_json::from_slice(&text).map_err(|e| bad(format!("cannot be read ({e})")))
}
