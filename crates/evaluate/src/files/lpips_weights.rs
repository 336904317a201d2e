//! Weights of LPIPS.

use std::path::Path;

use motes_formats::FormatError;
use motes_formats::tensors::read_tensors;
use sha2::{Digest as _, Sha256};

use crate::lpips::{Lpips, LpipsNet, LpipsRange};

impl Lpips {
    /// Reads the weights of `net` from a safetensors file, see [`Self::new`].
    ///
    /// # Errors
    /// When the file cannot be read or holds other tensors.
    pub fn load(path: &Path, net: LpipsNet, range: LpipsRange) -> Result<Self, FormatError> {
        let (tensors, _) = read_tensors(path)?;
        let mut lpips = Self::new(net, range, &tensors).map_err(|error| {
            let text = error.to_string();
            let (cause, help) = text.split_once("\nhelp: ").unwrap_or((&text, ""));
            FormatError::invalid(path, "", cause).with_remedy(help)
        })?;
        let bytes = std::fs::read(path).map_err(|error| FormatError::io(path, error))?;
        let digest = Sha256::digest(&bytes);
        lpips.weights_sha256 = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(lpips)
    }
}
