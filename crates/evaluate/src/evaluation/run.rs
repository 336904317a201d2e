//! Scoring sets of renders against the photos of a capture.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use motes_scene::{Capture, ImageU8, Pinhole, Split, SplitChoice};

use crate::score::Photo;
use render::frames::{PlanError, pinhole_of, view_stems, views_of};
use render::model::Model;

/// Where the renders come from.
#[derive(Clone, Debug)]
pub enum Contestant {
    /// Gaussians of a file, rendered here.
    Model(PathBuf, Model),
    /// A folder of pictures, rendered by any program and named after the views.
    Folder(PathBuf),
}

impl Contestant {
    /// File or folder.
    pub fn path(&self) -> &Path {
        match self {
            Self::Model(path, _) | Self::Folder(path) => path,
        }
    }

    pub(crate) fn gaussians(&self) -> Option<usize> {
        match self {
            Self::Model(_, model) => Some(model.gaussians.len()),
            Self::Folder(_) => None,
        }
    }
}

/// What is scored: views of a capture with their photos.
#[derive(Clone, Debug)]
pub struct Course<'a> {
    pub(crate) document: &'a Path,
    pub(crate) capture: &'a Capture,
    pub(crate) stems: Vec<String>,
    pub(crate) views: Vec<(usize, Pinhole)>,
}

/// A view just scored.
#[derive(Debug)]
pub struct ScoredView<'a> {
    /// Its role in the capture.
    pub split: Split,
    /// Name of the view.
    pub name: &'a str,
    /// File stem for its pictures.
    pub stem: &'a str,
    /// The photo.
    pub photo: &'a Photo,
    /// The render, 8 bit.
    pub render: &'a ImageU8,
}

impl<'a> Course<'a> {
    /// The views of all `splits`, each once, in the order of the capture.
    ///
    /// # Errors
    /// When a split has no views or a view no pinhole camera.
    pub fn new(
        document: &'a Path,
        capture: &'a Capture,
        splits: &[SplitChoice],
    ) -> Result<Self, PlanError> {
        let mut indices = BTreeSet::new();
        for split in splits {
            indices.extend(views_of(capture, split.split())?);
        }
        let with_camera = |view| Ok((view, pinhole_of(capture, view)?));
        let views = indices.into_iter().map(with_camera).collect::<Result<_, PlanError>>()?;
        Ok(Self { document, capture, stems: view_stems(capture), views })
    }

    /// Number of views that one contestant is scored on.
    pub fn len(&self) -> usize {
        self.views.len()
    }

    /// Whether there is no view.
    pub fn is_empty(&self) -> bool {
        self.views.is_empty()
    }

    /// Number of views of a split among them.
    pub fn count_of(&self, split: SplitChoice) -> usize {
        let split_of = |view: usize| self.capture.views[view].split;
        self.views.iter().filter(|(view, _)| split.includes(split_of(*view))).count()
    }

    /// Width and height of the images when all have one size, pixels.
    pub fn common_size(&self) -> Option<[u64; 2]> {
        let size = |(_, camera): &(usize, Pinhole)| [camera.width as u64, camera.height as u64];
        let first = self.views.first().map(size)?;
        self.views.iter().all(|view| size(view) == first).then_some(first)
    }
}
