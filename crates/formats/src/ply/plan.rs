//! Which column of a PLY file becomes which value of [`Gaussians`].

use std::collections::BTreeSet;
use std::path::Path;

use motes_scene::{ColumnValues, ExtraColumn, Gaussians};

use super::header::{Element, Header, PropertyKind};
use super::rows::{Field, fields, packed_row_bytes};
use super::scalar::Scalar;
use super::{FLAT_LOG_RATIO, SH_C0};
use crate::error::{FormatError, Result, quoted};

/// Numbers of `f_rest` columns and the SH degree each belongs to.
const F_REST_COUNTS: [(usize, u8); 5] = [(0, 0), (9, 1), (24, 2), (45, 3), (72, 4)];

pub(super) struct Plan {
    row_bytes: usize,
    means: [Field; 3],
    rotations: [Field; 4],
    log_scales: [Field; 2],
    /// Absent in files of flat Gaussians (2DGS).
    third_log_scale: Option<Field>,
    opacity_logit: Field,
    /// In the order of [`Gaussians::sh`]: coefficient-major, RGB fastest.
    sh: Vec<Field>,
    sh_degree: u8,
    /// Set when the first three of `sh` are `red green blue` instead of coefficients.
    color_scale: Option<f32>,
    extra: Vec<(String, Field)>,
}

impl Plan {
    pub(super) fn new(header: &Header, element: &Element, path: &Path) -> Result<Self> {
        let columns: Vec<(&str, Field)> = fields(element).collect();
        let mut used = BTreeSet::new();
        let place = format!("ply header line {}", element.line);
        let mut take = |name: &str| {
            let found = columns.iter().find(|(column, _)| *column == name)?;
            used.insert(name.to_owned());
            Some(found.1)
        };
        let missing = |name: &str| missing_property(header, element, path, &place, name);
        let mut require = |name: &str| take(name).ok_or_else(|| missing(name));

        let means = [require("x")?, require("y")?, require("z")?];
        let opacity_logit = require("opacity")?;
        let log_scales = [require("scale_0")?, require("scale_1")?];
        let rotations =
            [require("rot_0")?, require("rot_1")?, require("rot_2")?, require("rot_3")?];
        let third_log_scale = take("scale_2");

        let mut color_scale = None;
        let dc = match ["f_dc_0", "f_dc_1", "f_dc_2"].map(&mut take) {
            [Some(r), Some(g), Some(b)] => [r, g, b],
            [None, None, None] => match ["red", "green", "blue"].map(&mut take) {
                [Some(r), Some(g), Some(b)] => {
                    color_scale = Some(1.0 / full_scale(r.scalar));
                    [r, g, b]
                }
                _ => return Err(missing("f_dc_0")),
            },
            found => {
                let first = found.iter().position(Option::is_none).unwrap_or_default();
                return Err(missing(&format!("f_dc_{first}")));
            }
        };
        let rest_count = columns.iter().filter(|(name, _)| is_f_rest(name)).count();
        let Some(&(_, sh_degree)) = F_REST_COUNTS.iter().find(|(n, _)| *n == rest_count) else {
            let cause = format!(
                "{rest_count} f_rest columns belong to no SH degree (0, 9, 24, 45 and 72 do)"
            );
            return Err(FormatError::invalid(path, place.clone(), cause));
        };
        let mut sh = dc.to_vec();
        // The file holds all of red first, then green, then blue.
        let per_channel = rest_count / 3;
        for k in 0..per_channel {
            for channel in 0..3 {
                let name = format!("f_rest_{}", channel * per_channel + k);
                sh.push(take(&name).ok_or_else(|| missing(&name))?);
            }
        }
        let extra = columns
            .iter()
            .filter(|(name, _)| !used.contains(*name))
            .map(|(name, field)| ((*name).to_owned(), *field))
            .collect();
        let row_bytes = packed_row_bytes(element);
        Ok(Self {
            row_bytes,
            means,
            rotations,
            log_scales,
            third_log_scale,
            opacity_logit,
            sh,
            sh_degree,
            color_scale,
            extra,
        })
    }

    /// Empty Gaussians with room for `rows`.
    pub(super) fn gaussians(&self, rows: usize) -> Gaussians {
        let extra = self.extra.iter().map(|(name, field)| ExtraColumn {
            name: name.clone(),
            values: empty_column(field.scalar, rows),
        });
        Gaussians {
            means: Vec::with_capacity(rows),
            rotations: Vec::with_capacity(rows),
            log_scales: Vec::with_capacity(rows),
            opacity_logits: Vec::with_capacity(rows),
            sh_degree: self.sh_degree,
            sh: Vec::with_capacity(rows * self.sh.len()),
            extra: extra.collect(),
        }
    }

    /// Appends packed rows.
    pub(super) fn append(&self, rows: &[u8], big_endian: bool, gaussians: &mut Gaussians) {
        let standard = self.means.iter().chain(&self.rotations).chain(&self.log_scales);
        let standard = standard.chain([&self.opacity_logit]).chain(&self.third_log_scale);
        let all_f32 = standard.chain(&self.sh).all(|field| field.scalar == Scalar::F32);
        if all_f32 && !big_endian {
            // What nearly every file holds; kept apart because the general way is several times
            // slower.
            self.append_rows(rows, gaussians, |row, field| {
                let mut bytes = [0; 4];
                bytes.copy_from_slice(&row[field.offset..field.offset + 4]);
                f32::from_le_bytes(bytes)
            });
        } else {
            self.append_rows(rows, gaussians, |row, field| {
                field.scalar.decode(&row[field.offset..], big_endian) as f32
            });
        }
        for ((_, field), column) in self.extra.iter().zip(&mut gaussians.extra) {
            let values = rows.chunks_exact(self.row_bytes).map(|row| &row[field.offset..]);
            extend_column(&mut column.values, field.scalar, big_endian, values);
        }
    }

    fn append_rows(&self, rows: &[u8], to: &mut Gaussians, value: impl Fn(&[u8], Field) -> f32) {
        for row in rows.chunks_exact(self.row_bytes) {
            to.means.push(self.means.map(|field| value(row, field)));
            to.rotations.push(self.rotations.map(|field| value(row, field)));
            let [a, b] = self.log_scales.map(|field| value(row, field));
            let third = self.third_log_scale;
            let third = third.map_or_else(|| a.min(b) + FLAT_LOG_RATIO, |field| value(row, field));
            to.log_scales.push([a, b, third]);
            to.opacity_logits.push(value(row, self.opacity_logit));
            let start = to.sh.len();
            to.sh.extend(self.sh.iter().map(|field| value(row, *field)));
            if let Some(scale) = self.color_scale {
                for color in &mut to.sh[start..start + 3] {
                    *color = (*color * scale - 0.5) / SH_C0;
                }
            }
        }
    }
}

fn is_f_rest(name: &str) -> bool {
    name.strip_prefix("f_rest_")
        .is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()))
}

/// The value that stands for a channel at full intensity.
pub(super) fn full_scale(scalar: Scalar) -> f32 {
    match scalar {
        Scalar::F16 | Scalar::F32 | Scalar::F64 => 1.0,
        Scalar::U16 => 65535.0,
        _ => 255.0,
    }
}

fn missing_property(
    header: &Header,
    element: &Element,
    path: &Path,
    place: &str,
    name: &str,
) -> FormatError {
    let list = element.property(name).filter(|p| matches!(p.kind, PropertyKind::List { .. }));
    let (place, cause) = match list {
        Some(property) => (
            format!("ply header line {}", property.line),
            format!("property {} is a list", quoted(name)),
        ),
        None => (place.to_owned(), format!("property {} is missing", quoted(name))),
    };
    let error = FormatError::invalid(path, place, cause);
    if header.elements.iter().any(|e| e.name == "face") {
        error.with_remedy("this looks like a mesh, not like Gaussians")
    } else if ["opacity", "scale_0", "rot_0"].iter().all(|n| element.property(n).is_none()) {
        error.with_remedy("this looks like a point cloud, not like Gaussians")
    } else {
        error
    }
}

fn empty_column(scalar: Scalar, rows: usize) -> ColumnValues {
    match scalar {
        Scalar::I8 => ColumnValues::I8(Vec::with_capacity(rows)),
        Scalar::U8 => ColumnValues::U8(Vec::with_capacity(rows)),
        Scalar::I16 => ColumnValues::I16(Vec::with_capacity(rows)),
        Scalar::U16 => ColumnValues::U16(Vec::with_capacity(rows)),
        Scalar::I32 => ColumnValues::I32(Vec::with_capacity(rows)),
        Scalar::U32 => ColumnValues::U32(Vec::with_capacity(rows)),
        Scalar::F16 | Scalar::F32 => ColumnValues::F32(Vec::with_capacity(rows)),
        Scalar::F64 => ColumnValues::F64(Vec::with_capacity(rows)),
    }
}

fn extend_column<'r>(
    column: &mut ColumnValues,
    scalar: Scalar,
    big_endian: bool,
    values: impl Iterator<Item = &'r [u8]>,
) {
    let values = values.map(|bytes| (bytes, scalar.decode(bytes, big_endian)));
    match column {
        ColumnValues::I8(v) => v.extend(values.map(|(_, x)| x as i8)),
        ColumnValues::U8(v) => v.extend(values.map(|(_, x)| x as u8)),
        ColumnValues::I16(v) => v.extend(values.map(|(_, x)| x as i16)),
        ColumnValues::U16(v) => v.extend(values.map(|(_, x)| x as u16)),
        ColumnValues::I32(v) => v.extend(values.map(|(_, x)| x as i32)),
        ColumnValues::U32(v) => v.extend(values.map(|(_, x)| x as u32)),
        // Not by way of f64, which would change the payload of a NaN.
        ColumnValues::F32(v) if scalar == Scalar::F32 => v.extend(values.map(|(bytes, _)| {
            let mut bits = [bytes[0], bytes[1], bytes[2], bytes[3]];
            if big_endian {
                bits.reverse();
            }
            f32::from_le_bytes(bits)
        })),
        ColumnValues::F32(v) => v.extend(values.map(|(_, x)| x as f32)),
        ColumnValues::F64(v) => v.extend(values.map(|(_, x)| x)),
    }
}
