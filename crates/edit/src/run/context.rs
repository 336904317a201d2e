//! What operations may look at beside the state, and how they fail.

use std::fmt;
use std::path::{Path, PathBuf};

use motes_formats::FormatError;
use motes_formats::selection::BoundGaussians;
use motes_raster::Antialias;
use motes_scene::Capture;

use crate::stylize::PictureEditor;

/// What operations may look at beside the state.
pub struct Resources<'a> {
    /// Names the plan in errors.
    pub plan: &'a Path,
    /// Files of the plan are relative to this folder.
    pub folder: &'a Path,
    /// The file that the Gaussians were read from, for selections that are bound to it.
    pub bound: &'a dyn Fn() -> Result<BoundGaussians, FormatError>,
    /// Cameras and photos, when given.
    pub capture: Option<(&'a Capture, &'a Path)>,
    /// The footprint to draw the Gaussians with.
    pub antialias: Antialias,
    /// Programs that may be started.
    pub editors: Editors<'a>,
    /// Whether the user asked to stop.
    pub stopped: &'a dyn Fn() -> bool,
}

/// What an operation has edit pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Program<'a> {
    /// Nothing: most operations.
    None,
    /// A command line.
    Command(&'a str),
    /// The provider of the command line.
    Provider,
}

/// Programs that operations may start. A plan is a document of anybody: what it names is started only when the user
/// named the same command.
#[derive(Clone, Copy)]
pub struct Editors<'a> {
    /// Command lines that the user named.
    pub named: &'a [String],
    /// The provider that the user named.
    pub provider: Option<&'a dyn PictureEditor>,
    /// Whether any is started. A dry run starts none: operations that need one are skipped.
    pub start: bool,
}

impl Editors<'_> {
    /// Whether the operation at `at` is to start `program`.
    ///
    /// # Errors
    /// The user did not name it.
    pub fn starts(self, program: Program<'_>, at: &str) -> Result<bool, EditError> {
        match program {
            Program::Command(command) if !self.named.iter().any(|named| named == command) => {
                let cause =
                    "this program of a file is not started: the command line does not name it";
                Err(EditError::plan(format!("{at}/editor"), cause).remedy(
                    "read the command in the file; if you trust it, give the same one with --editor",
                ))
            }
            Program::Provider if self.start && self.provider.is_none() => {
                Err(EditError::plan(at, "no program is named that edits the pictures")
                    .remedy("give --provider, or --editor with a command"))
            }
            _ => Ok(self.start),
        }
    }
}

impl Resources<'_> {
    /// A file of the plan.
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }
}

/// Why a plan cannot be applied.
#[derive(Debug)]
pub enum EditError {
    /// An operation does not fit.
    Plan {
        /// JSON pointer.
        at: String,
        /// What is wrong.
        cause: String,
        /// What the user can do about it.
        remedy: Option<String>,
    },
    /// A file is broken; the operation that names it.
    File {
        /// JSON pointer.
        at: String,
        /// What is wrong.
        source: Box<FormatError>,
    },
    /// The user asked to stop.
    Stopped,
}

impl EditError {
    /// An operation that does not fit.
    pub fn plan(at: impl Into<String>, cause: impl Into<String>) -> Self {
        Self::Plan { at: at.into(), cause: cause.into(), remedy: None }
    }

    /// The same error with what the user can do about it.
    #[must_use]
    pub fn remedy(mut self, text: impl Into<String>) -> Self {
        if let Self::Plan { remedy, .. } = &mut self {
            *remedy = Some(text.into());
        }
        self
    }

    /// An error of reading the file that the operation at `at` names.
    pub(crate) fn file(at: &str) -> impl Fn(FormatError) -> Self {
        move |source| Self::File { at: at.to_owned(), source: Box::new(source) }
    }
}

impl fmt::Display for EditError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plan { at, cause, .. } => write!(f, "{cause} ({at})"),
            Self::File { at, source } => write!(f, "{source} ({at})"),
            Self::Stopped => f.write_str("interrupted"),
        }
    }
}

impl std::error::Error for EditError {}
