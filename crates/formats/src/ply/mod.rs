//! PLY files: Gaussians in the layout that every splat program reads, colored points, and surfaces
//! with a material.
//!
//! `docs/formats/gaussians-ply.md` and `surface-ply.md` are normative. Columns are found by name, in any order, any
//! scalar type, in ascii and both binary encodings; columns that motes does not know are carried
//! through in their type and order.

mod columns;
mod faces;
mod gaussians;
pub mod header;
mod mesh;
mod plan;
mod points;
pub mod rows;
pub mod scalar;
mod surface;
mod write;

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use motes_scene::ExposureResponse;

use crate::error::{FormatError, Result};

pub use gaussians::{GaussianFile, PlySource, open_gaussians, read_gaussians, read_gaussians_from};
pub use mesh::{has_faces, read_mesh};
pub use points::{read_points, read_points_from, write_points, write_points_to};
pub use surface::{read_surface, read_surface_from, write_surface, write_surface_to};
pub use write::{PlyColumns, PlyWriteOptions, write_gaussians, write_gaussians_to};

/// `color = 0.5 + SH_C0 * f_dc` at degree 0.
pub const SH_C0: f32 = motes_math::sh::SH_C0 as f32;

/// Third log scale of a flat Gaussian (2DGS, a file without `scale_2`), relative to the smaller of
/// the other two: its thickness is a thousandth of its smaller radius. Relative, because the size
/// of a scene is not known, and finite, so that stages may fit it further.
pub const FLAT_LOG_RATIO: f32 = -6.907_755;

/// How the opacities and scales of a file were meant to be splatted: the comment
/// `SplatRenderMode`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RenderMode {
    /// With a constant 2D dilation, as 3DGS does.
    Default,
    /// With the 2D Mip filter, which keeps the energy of small splats (Mip-Splatting).
    Mip,
}

impl RenderMode {
    /// The word in the comment `SplatRenderMode`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::Mip => "mip",
        }
    }

    /// From the comments of a file; `antialiased 1` is Postshot's word for it.
    fn from_comments(comments: &[String]) -> Option<Self> {
        comments.iter().find_map(|comment| {
            let (key, value) = comment.split_once([' ', ':'])?;
            match (key, value.trim_matches([' ', ':'])) {
                ("SplatRenderMode", "default") | ("antialiased", "0") => Some(Self::Default),
                ("SplatRenderMode", "mip") | ("antialiased", "1") => Some(Self::Mip),
                _ => None,
            }
        })
    }
}

const RESPONSE_KEY: &str = "ExposureResponse:";

/// Rust prints the shortest digits that read back as the same bits.
fn response_comment(response: ExposureResponse) -> String {
    format!("{RESPONSE_KEY} {} {}", response.slope_per_stop, response.reference_stops)
}

/// From the comments of a file; anything but two plausible numbers is not a response.
fn response_from_comments(comments: &[String]) -> Option<ExposureResponse> {
    let text = comments.iter().find_map(|comment| comment.strip_prefix(RESPONSE_KEY))?;
    let numbers: Vec<f64> = text.split_whitespace().filter_map(|n| n.parse().ok()).collect();
    let &[slope_per_stop, reference_stops] = numbers.as_slice() else { return None };
    let response = ExposureResponse { slope_per_stop, reference_stops };
    response.is_plausible().then_some(response)
}

/// Opens a file for [`rows::Body`]: the reader and the size, when it has one.
fn open(path: &Path) -> Result<(BufReader<File>, Option<u64>)> {
    let io = |error| FormatError::io(path, error);
    let file = File::open(path).map_err(io)?;
    let metadata = file.metadata().map_err(io)?;
    if metadata.is_dir() {
        return Err(FormatError::invalid(path, "", "this is a folder, not a PLY file"));
    }
    let size = metadata.is_file().then_some(metadata.len());
    Ok((BufReader::with_capacity(1 << 18, file), size))
}

/// Parses the header and reads the rows of `vertex`; elements before it are passed over.
fn read_vertices<T: Send>(
    reader: &mut dyn BufRead,
    path: &Path,
    file_bytes: Option<u64>,
    prepare: impl FnOnce(&header::Header, &header::Element) -> Result<T>,
    append: impl FnMut(&mut T, &[u8], bool) -> Result<()> + Send,
) -> Result<(T, header::Header)> {
    read_vertices_behind(header::parse(reader, path)?, reader, path, file_bytes, prepare, append)
}

/// [`read_vertices`] of a reader that stands behind its header.
fn read_vertices_behind<T: Send>(
    header: header::Header,
    reader: &mut dyn BufRead,
    path: &Path,
    file_bytes: Option<u64>,
    prepare: impl FnOnce(&header::Header, &header::Element) -> Result<T>,
    mut append: impl FnMut(&mut T, &[u8], bool) -> Result<()> + Send,
) -> Result<(T, header::Header)> {
    let Some(at) = header.elements.iter().position(|element| element.name == "vertex") else {
        return Err(FormatError::invalid(path, "ply header", "there is no element vertex"));
    };
    let vertex = &header.elements[at];
    if vertex.count > u64::from(u32::MAX) {
        let place = format!("ply header line {}", vertex.line);
        let cause = format!("{} rows are more than the 2^32 - 1 that fit", vertex.count);
        return Err(FormatError::invalid(path, place, cause));
    }
    let mut body = rows::Body::new(reader, path, &header, file_bytes)?;
    let mut result = prepare(&header, vertex)?;
    for element in &header.elements[..at] {
        body.skip(element)?;
    }
    let big_endian = body.is_big_endian();
    body.read(vertex, &mut |rows| append(&mut result, rows, big_endian))?;
    if header.elements[at + 1..].iter().all(|element| element.count == 0) {
        body.end()?;
    }
    Ok((result, header))
}

/// Rows to make room for: all of them when the file is known to be large enough.
fn reserved_rows(element: &header::Element, file_bytes: Option<u64>) -> usize {
    let unproven = 1 << 12;
    if file_bytes.is_some() { element.count as usize } else { element.count.min(unproven) as usize }
}

#[cfg(test)]
mod tests;
