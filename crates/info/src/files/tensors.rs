//! Safetensors: checkpoints of train-splat, and weights.

use std::path::Path;

use motes_formats::Result;
use motes_formats::tensors::{TensorData, read_tensors};

use crate::{Description, Kind, measure};

/// Whether a file may be safetensors: a length, then JSON.
pub(super) fn starts_like(opening: &[u8]) -> bool {
    opening.get(5..8) == Some(&[0; 3]) && opening.get(8) == Some(&b'{')
}

/// Named arrays; of a checkpoint, its step, options and box in the unit world.
///
/// # Errors
/// It is broken.
pub(super) fn describe(path: &Path) -> Result<Description> {
    let (tensors, metadata) = read_tensors(path)?;
    let text = |key: &str| metadata.get(key).cloned();
    let number = |key: &str| text(key).and_then(|text| text.parse::<u64>().ok());
    let is_checkpoint = text("format").is_some_and(|format| format == "motes/fit-checkpoint");
    let kind = if is_checkpoint { Kind::Checkpoint } else { Kind::Tensors };
    let mut found = Description::new(kind, "safetensors").count("tensors", tensors.len());
    let named = tensors.iter().map(|(name, tensor)| format!("{name} {:?}", tensor.shape()));
    found.columns = named.collect();
    let bad = tensors.values().filter_map(TensorData::as_f32).map(measure::non_finite);
    found.non_finite = Some(bad.sum());
    if is_checkpoint {
        let version = text("version").unwrap_or_default();
        found.format = format!("motes/fit-checkpoint {version}, safetensors");
        let gaussians = tensors.get("means").map_or(0, |means| means.shape()[0]);
        found = found.count("gaussians", gaussians).fact("step", number("step"));
        found = found.fact("capture_sha256", text("capture_sha256"));
        found.sh_degree = number("sh_degree").and_then(|degree| degree.try_into().ok());
        found.seed = number("seed");
    }
    Ok(found)
}
