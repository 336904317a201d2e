//! `decomposition.json`: what a scene folder holds, and how its light and material were found.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use motes_scene::{Convention, Lobes, ScaleAnchor, Split};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::atomic::FolderDraft;
use crate::capture::{checked_relative_path, resolve};
use crate::documents::{Document, Parsed, read_document, write_document};
use crate::error::{FormatError, Result};
use crate::selection::BoundGaussians;

/// The name of the document in a scene folder.
pub const DECOMPOSITION_FILE: &str = "decomposition.json";
/// The name of the log in an edited scene folder.
pub const EDIT_LOG_FILE: &str = "edit-log.json";

/// How far the length of `up_in_world` may be from 1: hand-written vectors with three digits pass.
const UNIT_TOLERANCE: f64 = 1e-2;

/// A scene taken apart into surface, material and light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "motes decomposition")]
pub struct DecompositionDocument {
    /// `motes/decomposition`.
    pub format: String,
    /// `MAJOR.MINOR`.
    pub version: String,
    /// Program and version that made it.
    #[serde(default)]
    pub made_by: String,
    /// Gaussians with material columns (PLY), relative to this document.
    pub gaussians: String,
    /// Triangle mesh with normals and material (PLY), relative to this document.
    pub surface: String,
    /// Light in photo units (lat-long, EXR), relative to this document.
    pub environment: String,
    /// Axes of the environment.
    pub environment_convention: Convention,
    /// Unit vector in world to the zenith of the environment: the axes of the convention are turned so that its up is there.
    /// Absent: its up is its own axis of the world.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub environment_up_in_world: Option<[f64; 3]>,
    /// Unit vector away from the ground.
    pub up_in_world: [f64; 3],
    /// Lobes of the materials.
    pub lobes: Lobes,
    /// Whether one bounce of indirect light belongs to the scene's image formation.
    pub indirect: bool,
    /// Contrast of the camera's tone curve beyond sRGB, -0.5 to 0.6: with `v` sRGB-encoded light, photos show
    /// `v + contrast (3 v² - 2 v³ - v)`. Colors of the Gaussians are light without it. Absent: none was found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tone_curve_contrast: Option<f64>,
    /// Whether every pixel of the photos shows the scene: no mask and no alpha channel hides one. Where Gaussians cover little, such a
    /// scene is dark, not open. Absent: not known, taken for `false`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fills_photos: Option<bool>,
    /// What the scale of light against base color rests on.
    pub scale_anchor: ScaleAnchorDocument,
    /// What was modeled or left out, and why.
    #[serde(default)]
    pub terms: Vec<TermDocument>,
    /// Pictures under the light of the capture against the photos.
    #[serde(default)]
    pub views: Vec<DecomposedViewDocument>,
    /// Sizes.
    #[serde(default)]
    pub counts: DecompositionCounts,
    /// The file of Gaussians that was taken apart, which has the same rows in the same order: selections of it hold here.
    /// Absent when that is not known, or once rows were changed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source_gaussians: Option<BoundGaussians>,
    /// Elapsed seconds of the decomposition; null when they were not taken.
    #[serde(default)]
    pub seconds: Option<f64>,
    /// Elapsed seconds of every step, in the order in which they ran. Absent when they were not taken.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub step_times: Vec<StepTimeDocument>,
}

impl Document for DecompositionDocument {
    const FORMAT: &'static str = "motes/decomposition";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 5;
}

/// Time of a step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepTimeDocument {
    /// Name of the step, as `decompose --until` takes it.
    pub step: String,
    /// Elapsed seconds.
    pub seconds: f64,
}

/// What the scale of light against base color rests on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ScaleAnchorDocument {
    /// Kind of evidence.
    pub kind: ScaleAnchor,
    /// A sentence.
    pub explanation: String,
    /// Factor on base color that the anchor gave, per channel; light has its inverse.
    pub factor_rgb: [f64; 3],
}

/// A term of the image formation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TermDocument {
    /// Name, such as `specular`.
    pub name: String,
    /// Whether it is part of the result.
    pub kept: bool,
    /// Why, in a sentence.
    pub evidence: String,
    /// What was measured, by name; null where there is no number.
    #[serde(default)]
    pub numbers: BTreeMap<String, Option<f64>>,
}

/// A picture under the light of the capture against its photo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DecomposedViewDocument {
    /// Name of the view.
    pub name: String,
    /// Role of the view.
    pub split: Split,
    /// PSNR of the sRGB-encoded picture, dB, over pixels of the photo that count fully and that the Gaussians cover (alpha 0.5 or
    /// more), whether the surface is met there or not; null where there are none.
    #[serde(default)]
    pub psnr_db: Option<f64>,
}

/// Sizes of the parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct DecompositionCounts {
    /// Gaussians.
    pub gaussians: u64,
    /// Gaussians that no training view saw: their material is a guess.
    pub unobserved_gaussians: u64,
    /// Vertices of the surface.
    pub vertices: u64,
    /// Triangles of the surface.
    pub triangles: u64,
}

/// A checked document with the files of its folder.
#[derive(Clone, Debug, PartialEq)]
pub struct Decomposition {
    /// The document; `up_in_world` has length 1.
    pub document: DecompositionDocument,
    /// Gaussians with material columns.
    pub gaussians: PathBuf,
    /// Mesh with material.
    pub surface: PathBuf,
    /// Light.
    pub environment: PathBuf,
    /// Sentences about keys that were ignored.
    pub warnings: Vec<String>,
}

impl Decomposition {
    /// The file of Gaussians, of which `count` were read, as selections are bound to it: those of the file that was taken
    /// apart hold, too.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn bound_gaussians(&self, count: usize) -> Result<BoundGaussians> {
        let source = self.document.source_gaussians.as_ref();
        let same_rows_as = source.map(|source| source.sha256.clone());
        Ok(BoundGaussians { same_rows_as, ..BoundGaussians::of_file(&self.gaussians, count)? })
    }
}

impl DecompositionDocument {
    /// Checks the document; `path` names it and the files are taken relative to it.
    ///
    /// # Errors
    /// As [`read_decomposition`].
    pub fn check(mut self, path: &Path) -> Result<Decomposition> {
        let file = |place: &str, name: &str| {
            checked_relative_path(path, place, name).map(|file| resolve(path, &file))
        };
        let gaussians = file("/gaussians", &self.gaussians)?;
        let surface = file("/surface", &self.surface)?;
        let environment = file("/environment", &self.environment)?;
        self.up_in_world = unit(self.up_in_world)
            .map_err(|cause| FormatError::invalid(path, "/up_in_world", cause))?;
        let environment_up = self.environment_up_in_world.map(unit).transpose();
        self.environment_up_in_world = environment_up
            .map_err(|cause| FormatError::invalid(path, "/environment_up_in_world", cause))?;
        if !self.scale_anchor.factor_rgb.iter().all(|f| *f > 0.0 && f.is_finite()) {
            let cause = format!("{:?} are not factors", self.scale_anchor.factor_rgb);
            return Err(FormatError::invalid(path, "/scale_anchor/factor_rgb", cause));
        }
        Ok(Decomposition { document: self, gaussians, surface, environment, warnings: Vec::new() })
    }
}

/// The vector with length 1, which it has but for the digits that were written.
fn unit(v: [f64; 3]) -> std::result::Result<[f64; 3], String> {
    let length = v.iter().map(|v| v * v).sum::<f64>().sqrt();
    if (length - 1.0).abs() <= UNIT_TOLERANCE {
        Ok(v.map(|v| v / length))
    } else {
        Err(format!("{v:?} is not a unit vector"))
    }
}

/// Reads the document of a scene folder; `scene` is the folder or the document itself.
///
/// # Errors
/// The document cannot be read or is malformed; a file name is absolute or leads out of the
/// folder; `up_in_world` is not a unit vector; a factor is not positive. Whether the files exist is
/// seen when they are read.
pub fn read_decomposition(scene: &Path) -> Result<Decomposition> {
    let path = if scene.is_dir() { scene.join(DECOMPOSITION_FILE) } else { scene.to_owned() };
    let Parsed { document, warnings } = read_document::<DecompositionDocument>(&path)?;
    Ok(Decomposition { warnings, ..document.check(&path)? })
}

/// Files of a scene folder that this program writes.
pub const SCENE_FILES: [&str; 5] =
    [DECOMPOSITION_FILE, "gaussians.ply", "surface.ply", "environment.exr", EDIT_LOG_FILE];

/// A scene folder in the making: its files appear together, whatever happens meanwhile.
///
/// # Errors
/// What the operating system says.
pub fn scene_draft(folder: &Path) -> Result<FolderDraft> {
    FolderDraft::new(folder, DECOMPOSITION_FILE)
}

/// Writes the document into a scene folder.
///
/// # Errors
/// Writing fails.
pub fn write_decomposition(folder: &Path, document: &DecompositionDocument) -> Result<()> {
    write_document(&folder.join(DECOMPOSITION_FILE), document)
}
