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
    /// Gaussians with what the comments of their file say about them.
    pub fn new(gaussians: Gaussians, comments: Vec<String>) -> Self {
        let render_mode = RenderMode::from_comments(&comments);
        let exposure_response = response_from_comments(&comments);
        Self { gaussians, comments, render_mode, exposure_response }
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
/// columns are left out. PlayCanvas's compressed PLY is for `motes-codecs`.
///
/// # Errors
/// The file cannot be read, is not a PLY file or ends early, has data after its last row, lacks a
/// column, or has a number of `f_rest` columns that belongs to no SH degree.
pub fn open_gaussians(path: &Path) -> Result<GaussianFile> {
    PlySource::open(path)?.read()
}

/// Reads Gaussians from a stream; `name` stands for the file in errors.
///
/// # Errors
/// As [`open_gaussians`].
pub fn read_gaussians_from(reader: impl Read, name: &Path) -> Result<GaussianFile> {
    PlySource::stream(reader, name)?.read()
}

/// A PLY file whose header is read and whose rows are not: another layout of the same format
/// (PlayCanvas's compressed PLY) is recognized by its header and read by its own codec.
pub struct PlySource<'a> {
    /// Elements, columns and comments.
    pub header: Header,
    /// The bytes after the header.
    pub reader: Box<dyn BufRead + 'a>,
    /// The name in errors.
    pub path: &'a Path,
    /// Bytes of the whole file; `None` for a stream.
    pub bytes: Option<u64>,
}

impl<'a> PlySource<'a> {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// The file cannot be read, or does not begin with the header of a PLY file.
    pub fn open(path: &'a Path) -> Result<Self> {
        let (mut reader, bytes) = open(path)?;
        let header = parse(&mut reader, path)?;
        Ok(Self { header, reader: Box::new(reader), path, bytes })
    }

    /// Reads the header of a stream; `name` stands for the file in errors.
    ///
    /// # Errors
    /// As [`PlySource::open`].
    pub fn stream(reader: impl Read + 'a, name: &'a Path) -> Result<Self> {
        let mut reader = BufReader::with_capacity(1 << 18, reader);
        let header = parse(&mut reader, name)?;
        Ok(Self { header, reader: Box::new(reader), path: name, bytes: None })
    }

    /// Reads the rows: see [`open_gaussians`].
    ///
    /// # Errors
    /// As [`open_gaussians`].
    pub fn read(mut self) -> Result<GaussianFile> {
        read_rows(self.header, &mut *self.reader, self.path, self.bytes)
    }
}

fn read_rows(
    header: Header,
    reader: &mut dyn BufRead,
    path: &Path,
    bytes: Option<u64>,
) -> Result<GaussianFile> {
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
    Ok(GaussianFile::new(reading.finish(), header.comments))
}
