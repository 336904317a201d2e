//! Files that operations name.

use motes_formats::FormatError;
use motes_formats::environment::read_environment;
use motes_formats::selection::read_selection;
use motes_scene::{ImageF32, Selection};

use crate::run::Resources;

impl Resources<'_> {
    /// A selection of the Gaussians that the scene was read from.
    pub(crate) fn selection(&self, name: &str) -> Result<Selection, FormatError> {
        Ok(read_selection(&self.file(name), &(self.bound)()?)?.selection)
    }

    /// A map of light, linear radiance.
    pub(crate) fn environment(&self, name: &str) -> Result<ImageF32, FormatError> {
        read_environment(&self.file(name))
    }

    /// A file of the plan by its absolute path.
    pub(crate) fn absolute(&self, name: &str) -> String {
        let joined = self.file(name);
        let full = std::fs::canonicalize(&joined).unwrap_or(joined);
        full.to_string_lossy().into_owned()
    }
}
