//! Colored points without shape: what structure from motion triangulates.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;

use motes_scene::SparsePoints;

use super::plan::full_scale;
use super::rows::{Field, fields, packed_row_bytes};
use super::{SH_C0, open, read_vertices, reserved_rows};
use crate::atomic::{write_checked, write_error};
use crate::error::{FormatError, Result, quoted};
use crate::finite;

/// Color of points in a file without colors: middle gray.
const DEFAULT_COLOR: [u8; 3] = [128; 3];

/// Reads points from a PLY file: columns `x y z`, and `red green blue` (8 or 16 bits, or a
/// fraction of 1) or, in a file of Gaussians, `f_dc_0..2`. Points without color are gray.
///
/// # Errors
/// The file cannot be read, is not a PLY file or ends early, lacks a position column, or holds a
/// position that is not finite.
pub fn read_points(path: &Path) -> Result<SparsePoints> {
    let (mut reader, bytes) = open(path)?;
    read_file(&mut reader, path, bytes)
}

/// Reads points from a stream; `name` stands for the file in errors.
///
/// # Errors
/// As [`read_points`].
pub fn read_points_from(reader: impl Read, name: &Path) -> Result<SparsePoints> {
    read_file(&mut BufReader::with_capacity(1 << 18, reader), name, None)
}

enum Color {
    None,
    Rgb([Field; 3]),
    Coefficients([Field; 3]),
}

struct Reading {
    row_bytes: usize,
    position: [Field; 3],
    color: Color,
    points: SparsePoints,
}

fn read_file(reader: &mut dyn BufRead, path: &Path, bytes: Option<u64>) -> Result<SparsePoints> {
    let (reading, _) = read_vertices(
        reader,
        path,
        bytes,
        |_, element| {
            let columns: Vec<(&str, Field)> = fields(element).collect();
            let find = |name: &str| columns.iter().find(|(n, _)| *n == name).map(|(_, f)| *f);
            let require = |name: &str| {
                find(name).ok_or_else(|| {
                    let place = format!("ply header line {}", element.line);
                    FormatError::invalid(
                        path,
                        place,
                        format!("property {} is missing", quoted(name)),
                    )
                })
            };
            let position = [require("x")?, require("y")?, require("z")?];
            let all = |names: [&str; 3]| match names.map(find) {
                [Some(a), Some(b), Some(c)] => Some([a, b, c]),
                _ => None,
            };
            let color = all(["red", "green", "blue"]).map(Color::Rgb);
            let color = color
                .or_else(|| all(["f_dc_0", "f_dc_1", "f_dc_2"]).map(Color::Coefficients))
                .unwrap_or(Color::None);
            let rows = reserved_rows(element, bytes);
            let points = SparsePoints {
                positions: Vec::with_capacity(rows),
                colors: Vec::with_capacity(rows),
            };
            Ok(Reading { row_bytes: packed_row_bytes(element), position, color, points })
        },
        |reading, rows, big_endian| reading.append(rows, big_endian, path),
    )?;
    Ok(reading.points)
}

impl Reading {
    fn append(&mut self, rows: &[u8], big_endian: bool, path: &Path) -> Result<()> {
        for row in rows.chunks_exact(self.row_bytes) {
            let value = |f: Field| f.scalar.decode(&row[f.offset..], big_endian) as f32;
            let position = self.position.map(value);
            if !position.iter().all(|v| v.is_finite()) {
                let place = format!("row {} of vertex", self.points.len());
                let cause = format!("the position is {position:?}");
                return Err(FormatError::invalid(path, place, cause));
            }
            self.points.positions.push(position);
            // Casting a float to u8 saturates, and takes NaN to 0.
            let to_u8 = |fraction: f32| (fraction * 255.0).round() as u8;
            self.points.colors.push(match self.color {
                Color::None => DEFAULT_COLOR,
                Color::Rgb(rgb) => rgb.map(|f| to_u8(value(f) / full_scale(f.scalar))),
                Color::Coefficients(dc) => dc.map(|f| to_u8(0.5 + SH_C0 * value(f))),
            });
        }
        Ok(())
    }
}

/// Writes points as a binary little-endian PLY: `x y z` float, `red green blue` uchar.
///
/// # Errors
/// Writing fails.
///
/// # Panics
/// When there are not as many colors as positions.
pub fn write_points(path: &Path, points: &SparsePoints) -> Result<()> {
    finite::columns(path, [("position", points.positions.as_flattened(), 3)])?;
    write_checked(path, |writer| write_points_to(writer, points, path))
}

/// Writes points to a stream; `name` stands for the file in errors.
///
/// # Errors
/// As [`write_points`].
///
/// # Panics
/// As [`write_points`].
pub fn write_points_to(mut writer: impl Write, points: &SparsePoints, name: &Path) -> Result<()> {
    assert_eq!(points.positions.len(), points.colors.len(), "one color per position");
    let mut bytes = b"ply\nformat binary_little_endian 1.0\n".to_vec();
    bytes.extend(b"comment motes format motes/points 1.0\n");
    bytes.extend(format!("element vertex {}\n", points.len()).as_bytes());
    for column in ["float x", "float y", "float z", "uchar red", "uchar green", "uchar blue"] {
        bytes.extend(format!("property {column}\n").as_bytes());
    }
    bytes.extend(b"end_header\n");
    for (position, color) in points.positions.iter().zip(&points.colors) {
        position.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend(color);
    }
    writer.write_all(&bytes).map_err(|error| write_error(name, error))
}
