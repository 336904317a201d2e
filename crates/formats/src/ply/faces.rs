//! What both readers of meshes say about faces.

use std::path::Path;

use crate::error::{FormatError, Result};

/// What programs call the list of a face's corners.
pub(super) const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// The number of a vertex; `None` for what is none.
pub(super) fn vertex_number(value: f64) -> Option<u32> {
    let is_whole = (0.0..f64::from(u32::MAX)).contains(&value) && value.fract() == 0.0;
    is_whole.then_some(value as u32)
}

/// Refuses triangles with a corner that does not exist.
pub(super) fn check_corners(triangles: &[[u32; 3]], vertices: usize, path: &Path) -> Result<()> {
    let dangling = triangles.iter().position(|t| t.iter().any(|v| *v as usize >= vertices));
    match dangling {
        None => Ok(()),
        Some(row) => {
            let cause = format!("{:?} names a vertex of {vertices}", triangles[row]);
            Err(FormatError::invalid(path, format!("row {row} of face"), cause))
        }
    }
}
