//! `transforms.json`: posed photos as nerfstudio, instant-ngp and the NeRF-synthetic set write
//! them.
//!
//! `transform_matrix` is `world_from_camera` with OpenGL camera axes (x right, y up, z
//! backward); it is turned into `camera_from_world` with COLMAP's axes here, so nothing past
//! this module knows of OpenGL. `applied_transform` says how a tool had re-oriented the world
//! before writing; the poses are taken as they are and the note is passed on.

mod document;
mod intrinsics;

use std::path::{Path, PathBuf};

use glam::{DMat3, DQuat, DVec3};
use motes_scene::Pose;

pub use intrinsics::Intrinsics;

use crate::colmap::relative_name;
use crate::error::{FormatError, Result};
use document::{Document, Frame};

/// One posed photo.
#[derive(Clone, Debug, PartialEq)]
pub struct TransformsFrame {
    /// Image path below the folder of the JSON file, `/` between parts; the NeRF-synthetic set
    /// leaves the suffix away.
    pub file_path: String,
    /// Mask path below the folder of the JSON file (black = ignore).
    pub mask_path: Option<String>,
    /// World to camera; camera axes x right, y down, z forward.
    pub camera_from_world: Pose,
    /// Intrinsics of this frame: its own keys where it has them, else those of the file.
    pub intrinsics: Intrinsics,
}

/// What a `transforms.json` says.
#[derive(Clone, Debug, PartialEq)]
pub struct Transforms {
    /// Frames in file order.
    pub frames: Vec<TransformsFrame>,
    /// Start points (a PLY below the folder of the JSON file).
    pub ply_file_path: Option<String>,
    /// `file_path`s of training frames, when the file lists them.
    pub train_filenames: Option<Vec<String>>,
    /// `file_path`s of validation frames, when the file lists them.
    pub val_filenames: Option<Vec<String>>,
    /// `file_path`s of test frames, when the file lists them.
    pub test_filenames: Option<Vec<String>>,
    /// Rows of the 3x4 `applied_transform`, for the report.
    pub applied_transform: Option<Vec<Vec<f64>>>,
}

/// Reads one file of posed photos.
///
/// # Errors
/// Not JSON, no frames, a matrix that is not a rigid motion, a path that leads out of the folder,
/// an unknown camera model, the same photo twice.
pub fn read_transforms(path: &Path) -> Result<Transforms> {
    let bytes = std::fs::read(path).map_err(|error| FormatError::io(path, error))?;
    parse(&bytes, path)
}

fn parse(bytes: &[u8], path: &Path) -> Result<Transforms> {
    let document: Document = serde_json::from_slice(bytes).map_err(|error| {
        let place = format!("line {}, column {}", error.line(), error.column());
        FormatError::invalid(path, place, format!("this is not a transforms.json: {error}"))
    })?;
    if document.frames.is_empty() {
        return Err(FormatError::invalid(path, "frames", "there are no frames"));
    }
    let mut seen = std::collections::HashSet::new();
    let mut frames = Vec::with_capacity(document.frames.len());
    for (index, frame) in document.frames.iter().enumerate() {
        let place = format!("frame {index}");
        let invalid = |cause: String| FormatError::invalid(path, place.as_str(), cause);
        let file_path = relative_name(&frame.file_path).map_err(invalid).map_err(|error| {
            error.with_remedy("file_path must be relative to the folder of the JSON file")
        })?;
        if !seen.insert(file_path.clone()) {
            return Err(invalid(format!("the photo {file_path} is there twice")));
        }
        let mask_path =
            frame.mask_path.as_deref().map(relative_name).transpose().map_err(invalid)?;
        let camera_from_world = pose_of(frame).map_err(invalid)?;
        let intrinsics = Intrinsics::of(&document.shared, &frame.own).map_err(invalid)?;
        frames.push(TransformsFrame { file_path, mask_path, camera_from_world, intrinsics });
    }
    let invalid = |cause: String| FormatError::invalid(path, "ply_file_path", cause);
    let names = |list: Option<Vec<String>>| -> Result<Option<Vec<String>>> {
        let normal = |name: String| {
            relative_name(&name)
                .map_err(|cause| FormatError::invalid(path, "file name lists", cause))
        };
        list.map(|list| list.into_iter().map(normal).collect()).transpose()
    };
    Ok(Transforms {
        frames,
        ply_file_path: document
            .ply_file_path
            .as_deref()
            .map(relative_name)
            .transpose()
            .map_err(invalid)?,
        train_filenames: names(document.train_filenames)?,
        val_filenames: names(document.val_filenames)?,
        test_filenames: names(document.test_filenames)?,
        applied_transform: document.applied_transform,
    })
}

/// `camera_from_world` of an OpenGL `world_from_camera` matrix.
fn pose_of(frame: &Frame) -> std::result::Result<Pose, String> {
    let rows = &frame.transform_matrix;
    let shape_ok = (rows.len() == 3 || rows.len() == 4) && rows.iter().all(|row| row.len() == 4);
    if !shape_ok {
        return Err("transform_matrix is not 4 x 4".into());
    }
    if !rows.iter().flatten().all(|v| v.is_finite()) {
        return Err("transform_matrix has a value that is not finite".into());
    }
    if rows.get(3).is_some_and(|row| row[..] != [0.0, 0.0, 0.0, 1.0]) {
        return Err("the last row of transform_matrix is not 0 0 0 1".into());
    }
    let column = |c: usize| DVec3::new(rows[0][c], rows[1][c], rows[2][c]);
    // OpenGL's y (up) and z (backward) against our y (down) and z (forward).
    let matrix = DMat3::from_cols(column(0), -column(1), -column(2));
    let scale = matrix.determinant().cbrt();
    // A turned-over or sheared camera cannot be rendered; positive comparison refuses NaN.
    let rigid = scale > 1e-9 && {
        let unit = matrix * (1.0 / scale);
        let residue = unit * unit.transpose() - DMat3::IDENTITY;
        residue.to_cols_array().iter().all(|v| v.abs() < 1e-2)
    };
    if !rigid {
        return Err("the 3 x 3 part of transform_matrix is not a rotation".into());
    }
    let rotation = DQuat::from_mat3(&(matrix * (1.0 / scale)));
    let pose = Pose::new(rotation, column(3)).ok_or("transform_matrix has no rotation")?;
    Ok(pose.inverse())
}

/// Entry point for fuzzing: whether the bytes are a valid file; must never panic.
pub fn fuzz_one(data: &[u8]) -> bool {
    parse(data, &PathBuf::from("fuzz")).is_ok()
}

#[cfg(test)]
mod tests;
