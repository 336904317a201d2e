//! What a provider is asked.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ProviderKind, Task};
use crate::capture::checked_relative_path;
use crate::documents::{Document, Parsed, read_document};
use crate::error::Result;

/// What a provider is asked. Files are named relative to the document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "motes provider request")]
pub struct ProviderRequest {
    /// `motes/provider-request`.
    pub format: String,
    /// `MAJOR.MINOR`.
    pub version: String,
    /// Seed of the random numbers of models that draw some.
    #[serde(default)]
    pub seed: u64,
    /// One key, the kind, with what is asked.
    pub task: Task,
}

impl Document for ProviderRequest {
    const FORMAT: &'static str = "motes/provider-request";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 1;
}

impl ProviderRequest {
    /// A request.
    pub fn new(task: Task, seed: u64) -> Self {
        Self { format: Self::FORMAT.into(), version: Self::version(), seed, task }
    }

    /// What is asked for.
    pub fn kind(&self) -> ProviderKind {
        self.task.kind()
    }

    /// The files that the request names, relative to its folder, with their places in the document.
    ///
    /// # Errors
    /// A name leads out of the folder; `document` stands for the file in the error.
    pub fn files(&self, document: &Path) -> Result<Vec<PathBuf>> {
        let checked = |(place, name): (String, &str)| checked_relative_path(document, &place, name);
        self.task.files().into_iter().map(checked).collect()
    }
}

/// Reads a request.
///
/// # Errors
/// The file cannot be read or is malformed, or names a file outside of its folder.
pub fn read_request(path: &Path) -> Result<ProviderRequest> {
    let Parsed { document, .. } = read_document::<ProviderRequest>(path)?;
    document.files(path)?;
    Ok(document)
}
