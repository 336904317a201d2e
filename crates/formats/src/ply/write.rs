//! Writing Gaussians in INRIA's column order.

use std::io::Write;
use std::path::Path;

use motes_scene::{ColumnValues, ExposureResponse, ExtraColumn, Gaussians};
use rayon::prelude::*;

use super::{RenderMode, response_comment};
use crate::atomic::{write_checked, write_error};
use crate::error::{FormatError, Result, quoted};
use crate::finite;

/// Rows that a thread packs at a time: about a quarter of a megabyte at SH degree 3.
const ROWS_PER_TASK: usize = 1024;
/// Bytes that are packed before they are written.
const BLOCK_BYTES: usize = 1 << 22;

/// What goes into the header beside the columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlyWriteOptions {
    /// Written as `comment SplatRenderMode`, for viewers that can do both.
    pub render_mode: Option<RenderMode>,
    /// Written as `comment ExposureResponse SLOPE_PER_STOP REFERENCE_STOPS`.
    pub exposure_response: Option<ExposureResponse>,
    /// Further comments, one line each.
    pub comments: Vec<String>,
    /// Which columns are written.
    pub columns: PlyColumns,
}

/// Which columns of Gaussians a PLY gets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PlyColumns {
    /// The standard ones and all extra columns.
    #[default]
    All,
    /// INRIA's, with normals that are zero.
    Standard,
    /// INRIA's without `scale_2`: flat Gaussians (2DGS).
    Flat,
}

/// Writes Gaussians as a binary little-endian PLY: `x y z nx ny nz f_dc_* f_rest_* opacity scale_*
/// rot_*`, then the extra columns. `f_rest` is channel-major. Normals are zero unless `nx`, `ny`
/// or `nz` are among the extra columns.
///
/// # Errors
/// Writing fails, a value is not finite, or an extra column has a name that a PLY file cannot hold
/// or that a standard column has.
///
/// # Panics
/// When the arrays are not [consistent](Gaussians::is_consistent).
pub fn write_gaussians(
    path: &Path,
    gaussians: &Gaussians,
    options: &PlyWriteOptions,
) -> Result<()> {
    finite::gaussians(path, gaussians)?;
    write_checked(path, |writer| write_to(writer, gaussians, options, path))
}

/// Writes Gaussians to a stream, as they are; `name` stands for the file in errors.
///
/// # Errors
/// As [`write_gaussians`].
///
/// # Panics
/// As [`write_gaussians`].
pub fn write_gaussians_to(
    mut writer: impl Write,
    gaussians: &Gaussians,
    options: &PlyWriteOptions,
    name: &Path,
) -> Result<()> {
    write_to(&mut writer, gaussians, options, name)
}

fn write_to(
    writer: &mut dyn Write,
    gaussians: &Gaussians,
    options: &PlyWriteOptions,
    path: &Path,
) -> Result<()> {
    assert!(gaussians.is_consistent(), "arrays of different lengths");
    let refused = |error| write_error(path, error);
    let columns = Columns::new(gaussians, options.columns, path)?;
    writer.write_all(columns.header(gaussians, options).as_bytes()).map_err(refused)?;
    let (n, row_bytes) = (gaussians.len(), columns.row_bytes(gaussians));
    let rows_per_block = (BLOCK_BYTES / row_bytes).max(1);
    let (mut block, mut next) = (Vec::new(), Vec::new());
    let pack_rows = |start: usize, rows: &mut [u8]| {
        for (i, row) in rows.chunks_exact_mut(row_bytes).enumerate() {
            columns.pack(gaussians, start + i, row);
        }
    };
    let task_bytes = ROWS_PER_TASK * row_bytes;
    let pack = |start: usize, block: &mut Vec<u8>| {
        // Only ever packed over: what stays zero is zero in every row.
        block.resize(rows_per_block.min(n - start) * row_bytes, 0);
        if block.len() <= task_bytes {
            return pack_rows(start, block);
        }
        let tasks = block.par_chunks_mut(task_bytes).enumerate();
        tasks.for_each(|(task, rows)| pack_rows(start + task * ROWS_PER_TASK, rows));
    };
    pack(0, &mut block);
    for start in (0..n).step_by(rows_per_block).skip(1) {
        let written = rayon::in_place_scope(|scope| {
            scope.spawn(|_| pack(start, &mut next));
            writer.write_all(&block)
        });
        written.map_err(refused)?;
        std::mem::swap(&mut block, &mut next);
    }
    writer.write_all(&block).map_err(refused)
}

/// The extra columns, normals apart.
struct Columns<'g> {
    normals: [Option<&'g ExtraColumn>; 3],
    others: Vec<&'g ExtraColumn>,
    /// Columns `scale_0..`: 2 or 3.
    scales: usize,
}

const NORMALS: [&str; 3] = ["nx", "ny", "nz"];

impl<'g> Columns<'g> {
    fn new(gaussians: &'g Gaussians, columns: PlyColumns, path: &Path) -> Result<Self> {
        let all = columns == PlyColumns::All;
        let extra = if all { &gaussians.extra[..] } else { &[] };
        let scales = if columns == PlyColumns::Flat { 2 } else { 3 };
        for (i, column) in extra.iter().enumerate() {
            let name = &column.name;
            let spelled =
                !name.is_empty() && name.chars().all(|c| !c.is_whitespace() && !c.is_control());
            if !spelled {
                let cause = format!("a PLY column cannot have the name {}", quoted(name));
                return Err(FormatError::invalid(path, "extra columns", cause));
            }
            let twice = extra[..i].iter().any(|other| other.name == *name);
            if twice || is_standard(name) {
                let cause = format!("the column name {} is used twice", quoted(name));
                return Err(FormatError::invalid(path, "extra columns", cause));
            }
        }
        let normals = NORMALS.map(|name| extra.iter().find(|column| column.name == name));
        let others = extra.iter().filter(|c| !NORMALS.contains(&c.name.as_str())).collect();
        Ok(Self { normals, others, scales })
    }

    fn header(&self, gaussians: &Gaussians, options: &PlyWriteOptions) -> String {
        let mut text = String::from("ply\nformat binary_little_endian 1.0\n");
        text.push_str("comment motes format motes/gaussians 1.0\n");
        text.push_str(&format!("comment SH degree: {}\n", gaussians.sh_degree));
        if let Some(mode) = options.render_mode {
            text.push_str(&format!("comment SplatRenderMode: {}\n", mode.name()));
        }
        if let Some(response) = options.exposure_response {
            text.push_str(&format!("comment {}\n", response_comment(response)));
        }
        for comment in &options.comments {
            // A line break would start a header line of its own.
            let line = comment.replace(char::is_control, " ");
            text.push_str(&format!("comment {line}\n"));
        }
        text.push_str(&format!("element vertex {}\n", gaussians.len()));
        let mut property = |kind: &str, name: &str| {
            text.push_str(&format!("property {kind} {name}\n"));
        };
        ["x", "y", "z"].iter().for_each(|name| property("float", name));
        for (column, name) in self.normals.iter().zip(NORMALS) {
            property(column.map_or("float", |column| type_name(&column.values)), name);
        }
        (0..3).for_each(|i| property("float", &format!("f_dc_{i}")));
        let rest = 3 * (gaussians.sh_coefficients() - 1);
        (0..rest).for_each(|i| property("float", &format!("f_rest_{i}")));
        property("float", "opacity");
        (0..self.scales).for_each(|i| property("float", &format!("scale_{i}")));
        (0..4).for_each(|i| property("float", &format!("rot_{i}")));
        for column in &self.others {
            property(type_name(&column.values), &column.name);
        }
        text.push_str("end_header\n");
        text
    }

    /// Bytes of a row.
    fn row_bytes(&self, gaussians: &Gaussians) -> usize {
        let singles = 3 + 3 * gaussians.sh_coefficients() + 1 + self.scales + 4;
        let normals = self.normals.iter().map(|column| column.map_or(4, value_bytes));
        let others = self.others.iter().map(|column| value_bytes(column));
        4 * singles + normals.chain(others).sum::<usize>()
    }

    /// Writes row `i` over `row`, but for normals that there are none of.
    fn pack(&self, gaussians: &Gaussians, i: usize, row: &mut [u8]) {
        let mut row = put(row, &gaussians.means[i]);
        for column in self.normals {
            row = match column {
                Some(column) => put_value(row, &column.values, i),
                None => &mut row[4..],
            };
        }
        let (first, others) = gaussians.sh_of(i).split_at(3);
        row = put(row, first);
        let per_channel = others.len() / 3;
        for channel in 0..3 {
            let (to, behind) = row.split_at_mut(4 * per_channel);
            for (bytes, rgb) in to.chunks_exact_mut(4).zip(others.chunks_exact(3)) {
                bytes.copy_from_slice(&rgb[channel].to_le_bytes());
            }
            row = behind;
        }
        row = put(row, &[gaussians.opacity_logits[i]]);
        row = put(row, &gaussians.log_scales[i][..self.scales]);
        row = put(row, &gaussians.rotations[i]);
        for column in &self.others {
            row = put_value(row, &column.values, i);
        }
    }
}

/// Writes values to the start of `row` and returns what is behind them.
fn put<'r>(row: &'r mut [u8], values: &[f32]) -> &'r mut [u8] {
    let (to, behind) = row.split_at_mut(4 * values.len());
    for (bytes, value) in to.chunks_exact_mut(4).zip(values) {
        bytes.copy_from_slice(&value.to_le_bytes());
    }
    behind
}

/// Whether [`Columns::header`] writes a column of this name itself, or a reader would take it for
/// one that it does.
fn is_standard(name: &str) -> bool {
    let numbered = |prefix: &str| {
        name.strip_prefix(prefix)
            .is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    };
    ["x", "y", "z", "opacity"].contains(&name)
        || ["f_dc_", "f_rest_", "scale_", "rot_"].into_iter().any(numbered)
}

fn type_name(values: &ColumnValues) -> &'static str {
    match values {
        ColumnValues::I8(_) => "char",
        ColumnValues::U8(_) => "uchar",
        ColumnValues::I16(_) => "short",
        ColumnValues::U16(_) => "ushort",
        ColumnValues::I32(_) => "int",
        ColumnValues::U32(_) => "uint",
        ColumnValues::F32(_) => "float",
        ColumnValues::F64(_) => "double",
    }
}

/// Writes value `i` of a column to the start of `row` and returns what is behind it.
fn put_value<'r>(row: &'r mut [u8], values: &ColumnValues, i: usize) -> &'r mut [u8] {
    fn bytes<const N: usize>(row: &mut [u8], value: [u8; N]) -> &mut [u8] {
        let (to, behind) = row.split_at_mut(N);
        to.copy_from_slice(&value);
        behind
    }
    match values {
        ColumnValues::I8(v) => bytes(row, v[i].to_le_bytes()),
        ColumnValues::U8(v) => bytes(row, [v[i]]),
        ColumnValues::I16(v) => bytes(row, v[i].to_le_bytes()),
        ColumnValues::U16(v) => bytes(row, v[i].to_le_bytes()),
        ColumnValues::I32(v) => bytes(row, v[i].to_le_bytes()),
        ColumnValues::U32(v) => bytes(row, v[i].to_le_bytes()),
        ColumnValues::F32(v) => bytes(row, v[i].to_le_bytes()),
        ColumnValues::F64(v) => bytes(row, v[i].to_le_bytes()),
    }
}

fn value_bytes(column: &ExtraColumn) -> usize {
    match column.values {
        ColumnValues::I8(_) | ColumnValues::U8(_) => 1,
        ColumnValues::I16(_) | ColumnValues::U16(_) => 2,
        ColumnValues::I32(_) | ColumnValues::U32(_) | ColumnValues::F32(_) => 4,
        ColumnValues::F64(_) => 8,
    }
}
