//! Reading Gaussians.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use motes_scene::{ExposureResponse, Gaussians};

use super::columns::Reading;
use super::header::{Header, parse};
use super::plan::Plan;
use super::{RenderMode, open, read_vertices_behind, response_from_comments};
use crate::error::Result;

/// Gaussians and what else their file says.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussianFile {
    /// The Gaussians.
    pub gaussians: Gaussians,
    /// Header comments in order, without the word `comment`.
    pub comments: Vec<String>,
    /// The render mode, when a comment tells.
    pub render_mode: Option<RenderMode>,
    /// How the brightness of photos follows their metadata, when a comment tells.
    pub exposure_response: Option<ExposureResponse>,
}

impl GaussianFile {
    /// Of a format that says nothing else.
    pub(crate) fn of(gaussians: Gaussians) -> Self {
        Self { gaussians, comments: Vec::new(), render_mode: None, exposure_response: None }
    }
}

/// Reads Gaussians from a PLY file: see [`open_gaussians`], which also returns the comments.
///
/// # Errors
/// As [`open_gaussians`].
pub fn read_gaussians(path: &Path) -> Result<Gaussians> {
    open_gaussians(path).map(|file| file.gaussians)
}

/// Reads Gaussians and header comments from a PLY file.
///
/// Values are taken as they are: NaN and infinity pass, see [`Gaussians::invalid_rows`]. Normals
/// that are all zero are dropped (the writer adds them again), all other columns that have no
/// place in [`Gaussians`] arrive in [`Gaussians::extra`]. Columns of `half` arrive as f32, list
/// columns are left out. PlayCanvas's compressed PLY is read, too.
///
/// # Errors
/// The file cannot be read, is no PLY file or ends early, has data after its last row, lacks a
/// column, or has a number of `f_rest` columns that belongs to no SH degree.
pub fn open_gaussians(path: &Path) -> Result<GaussianFile> {
    let (mut reader, bytes) = open(path)?;
    read_file(&mut reader, path, bytes)
}

/// Reads Gaussians from a stream; `name` stands for the file in errors.
///
/// # Errors
/// As [`open_gaussians`].
pub fn read_gaussians_from(reader: impl Read, name: &Path) -> Result<GaussianFile> {
    read_file(&mut BufReader::with_capacity(1 << 18, reader), name, None)
}

fn read_file(reader: &mut dyn BufRead, path: &Path, bytes: Option<u64>) -> Result<GaussianFile> {
    let header = parse(reader, path)?;
    if crate::splats::is_compressed(&header) {
        let gaussians = crate::splats::read_compressed(&header, reader, path, bytes)?;
        return Ok(with_comments(gaussians, header));
    }
    let (reading, header) = read_vertices_behind(
        header,
        reader,
        path,
        bytes,
        |header, element| {
            let plan = Plan::new(header, element, path)?;
            // Of a stream, every block makes its own room.
            let rows = if bytes.is_some() { element.count as usize } else { 0 };
            Ok(Reading::new(plan, rows))
        },
        |reading, rows, big_endian| {
            reading.append(rows, big_endian);
            Ok(())
        },
    )?;
    Ok(with_comments(reading.finish(), header))
}

fn with_comments(gaussians: Gaussians, header: Header) -> GaussianFile {
    let render_mode = RenderMode::from_comments(&header.comments);
    let exposure_response = response_from_comments(&header.comments);
    GaussianFile { gaussians, comments: header.comments, render_mode, exposure_response }
}
