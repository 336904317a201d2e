//! What kind of input a path is.

use std::path::{Path, PathBuf};

use motes_formats::colmap::find_models;

use crate::error::{IngestError, Result};

/// Paths that the user gave.
#[derive(Clone, Debug, Default)]
pub struct ImportInput {
    /// A COLMAP project, a folder with `transforms*.json`, or such a file.
    pub input: Option<PathBuf>,
    /// Folder of a COLMAP model.
    pub model: Option<PathBuf>,
    /// Folder that image names refer to.
    pub images: Option<PathBuf>,
}

/// What was found there.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// COLMAP models, best first unknown: they are compared after reading.
    Colmap {
        /// Model folders.
        models: Vec<PathBuf>,
        /// Folder that image names refer to.
        images: PathBuf,
    },
    /// `transforms.json`, or a training file and files with other splits.
    Transforms {
        /// The file, or the training file.
        train: PathBuf,
        /// `transforms_test.json`.
        test: Option<PathBuf>,
        /// `transforms_val.json`.
        val: Option<PathBuf>,
        /// Models that may hold start points.
        models: Vec<PathBuf>,
    },
}

impl Source {
    /// Recognizes the input.
    ///
    /// # Errors
    /// Nothing is there, or nothing that can be imported.
    pub fn recognize(input: &ImportInput) -> Result<Self> {
        if let Some(model) = &input.model {
            let models = find_models(model);
            if models.is_empty() {
                return Err(no_model(model));
            }
            let beside = || model.parent().map(|p| p.join("images")).filter(|p| p.is_dir());
            let images = input.images.clone().or_else(beside).ok_or_else(|| {
                IngestError::usage(
                    "--model needs --images",
                    "say where the photos are: --images DIR",
                )
            })?;
            return Ok(Self::Colmap { models, images: existing_folder(&images)? });
        }
        let Some(path) = &input.input else {
            return Err(IngestError::usage(
                "no input is given",
                "give a folder, or --model and --images",
            ));
        };
        if path.is_file() {
            return Self::of_file(path);
        }
        let folder = existing_folder(path)?;
        let file = |name: &str| Some(folder.join(name)).filter(|path| path.is_file());
        let models = find_models(&folder);
        if let Some(train) = file("transforms_train.json").or_else(|| file("transforms.json")) {
            let split_files = train.ends_with("transforms_train.json");
            let other = |name: &str| if split_files { file(name) } else { None };
            let (test, val) = (other("transforms_test.json"), other("transforms_val.json"));
            return Ok(Self::Transforms { train, test, val, models });
        }
        if models.is_empty() {
            return Err(no_model(&folder));
        }
        let images = match &input.images {
            Some(images) => existing_folder(images)?,
            None => ["images", "input", "photos"]
                .iter()
                .map(|name| folder.join(name))
                .find(|path| path.is_dir())
                .unwrap_or(folder),
        };
        Ok(Self::Colmap { models, images })
    }

    fn of_file(path: &Path) -> Result<Self> {
        if path.extension().is_some_and(|suffix| suffix.eq_ignore_ascii_case("json")) {
            let folder = path.parent().unwrap_or(Path::new("."));
            let beside = |name: &str| {
                let is_train = path.ends_with("transforms_train.json");
                Some(folder.join(name)).filter(|other| is_train && other.is_file())
            };
            return Ok(Self::Transforms {
                train: path.to_path_buf(),
                test: beside("transforms_test.json"),
                val: beside("transforms_val.json"),
                models: find_models(folder),
            });
        }
        Err(IngestError::bad_input(
            format!("this file is neither a folder nor a transforms.json: {}", path.display()),
            "give the folder of a COLMAP project, or a transforms.json",
        ))
    }
}

fn existing_folder(path: &Path) -> Result<PathBuf> {
    if path.is_dir() {
        return Ok(path.to_path_buf());
    }
    let cause = format!("there is no such folder: {}", path.display());
    Err(IngestError::bad_input(cause, "check the path; relative paths start at the current folder"))
}

fn no_model(folder: &Path) -> IngestError {
    IngestError::bad_input(
        format!("neither a COLMAP model nor a transforms.json is here: {}", folder.display()),
        "a model is cameras + images + points3D (.bin or .txt) in the folder itself, in sparse/ or \
         in sparse/0/; for photos without poses add --photos",
    )
}
