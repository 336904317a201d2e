//! The file of Gaussians that is edited.

use std::cell::OnceCell;
use std::path::Path;

use motes_formats::FormatError;
use motes_formats::decomposition::Decomposition;
use motes_formats::selection::BoundGaussians;
use motes_formats::standard_stream::is_standard_stream;

/// The file of Gaussians, hashed when it is asked for.
pub(super) struct Source<'a> {
    decomposition: Option<&'a Decomposition>,
    gaussians: &'a Path,
    count: usize,
    /// Its hash, when the run record has it.
    sha256: Option<String>,
    bound: OnceCell<BoundGaussians>,
}

impl<'a> Source<'a> {
    /// `count` Gaussians of a file, with its hash when the run record has it.
    pub(super) fn new(
        decomposition: Option<&'a Decomposition>,
        gaussians: &'a Path,
        count: usize,
        sha256: Option<String>,
    ) -> Self {
        Self { decomposition, gaussians, count, sha256, bound: OnceCell::new() }
    }

    /// Whether it is one, not standard input.
    pub(super) fn is_file(&self) -> bool {
        self.decomposition.is_some() || !is_standard_stream(self.gaussians)
    }

    /// As selections are bound to it.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub(super) fn bound(&self) -> motes_formats::Result<BoundGaussians> {
        if let Some(bound) = self.bound.get() {
            return Ok(bound.clone());
        }
        if !self.is_file() {
            let cause =
                "a selection belongs to a file of Gaussians, and these come from standard input";
            return Err(FormatError::not_supported(self.gaussians, "", cause)
                .with_remedy("name the file that the selection was made for"));
        }
        let found = match (self.decomposition, &self.sha256) {
            (Some(decomposition), _) => decomposition.bound_gaussians(self.count)?,
            (None, Some(sha256)) => BoundGaussians::new(self.gaussians, sha256.clone(), self.count),
            (None, None) => BoundGaussians::of_file(self.gaussians, self.count)?,
        };
        Ok(self.bound.get_or_init(|| found).clone())
    }
}
