//! Packed rows to the arrays of [`Gaussians`].
//!
//! Rows are turned into columns by all threads, each some hundred rows at a time: a row is read once and every array is written
//! once, while the rows are still in the cache of the thread.

use motes_scene::{ColumnValues, ExtraColumn, Gaussians};
use rayon::prelude::*;

use super::plan::Plan;
use super::rows::Field;
use super::scalar::Scalar;
use super::{FLAT_LOG_RATIO, SH_C0};

/// Rows per task: about a quarter of a megabyte at SH degree 3.
const ROWS_PER_TASK: usize = 1024;

/// Gaussians that are being read.
pub(super) struct Reading {
    plan: Plan,
    gaussians: Gaussians,
    /// Rows that have arrived. The arrays may be longer, the columns of normals shorter.
    rows: usize,
}

impl Reading {
    /// `rows` are believed to come: the arrays get that length, which costs no memory before it is written to.
    pub(super) fn new(plan: Plan, rows: usize) -> Self {
        let extra = plan.extra.iter().map(|(name, field)| {
            // Normals are mostly zero, and then not kept.
            let room = if is_normal(name) { 0 } else { rows };
            ExtraColumn { name: name.clone(), values: empty_column(field.scalar, room) }
        });
        let gaussians = Gaussians {
            means: vec![[0.0; 3]; rows],
            rotations: vec![[0.0; 4]; rows],
            log_scales: vec![[0.0; 3]; rows],
            opacity_logits: vec![0.0; rows],
            sh_degree: plan.sh_degree,
            sh: vec![0.0; rows * plan.sh.len()],
            extra: extra.collect(),
        };
        Self { plan, gaussians, rows: 0 }
    }

    /// Appends packed rows.
    pub(super) fn append(&mut self, rows: &[u8], big_endian: bool) {
        let Self { plan, gaussians: to, .. } = self;
        let start = self.rows;
        let end = start + rows.len() / plan.row_bytes;
        let values = plan.sh.len();
        if to.means.len() < end {
            to.means.resize(end, [0.0; 3]);
            to.rotations.resize(end, [0.0; 4]);
            to.log_scales.resize(end, [0.0; 3]);
            to.opacity_logits.resize(end, 0.0);
            to.sh.resize(end * values, 0.0);
        }
        let all_f32 = plan.is_all_f32() && !big_endian;
        let turn = |rows: &[u8], to: Rows<'_>| match (all_f32, plan.f_rest_offset) {
            // What nearly every file holds; kept apart because the general way is several times slower.
            (true, Some(offset)) => fill(plan, rows, to, f32_of, |row, sh| {
                interleave(&row[offset..offset + 4 * sh.len()], sh);
            }),
            (true, None) => fill(plan, rows, to, f32_of, |row, sh| {
                gather(&plan.sh[3..], sh, |field| f32_of(row, field));
            }),
            (false, _) => {
                let value = |row: &[u8], field: Field| {
                    field.scalar.decode(&row[field.offset..], big_endian) as f32
                };
                fill(plan, rows, to, value, |row, sh| {
                    gather(&plan.sh[3..], sh, |field| value(row, field));
                });
            }
        };
        let extend = |((name, field), column): (&(String, Field), &mut ExtraColumn)| {
            let values = rows.chunks_exact(plan.row_bytes).map(|row| &row[field.offset..]);
            if is_normal(name) && !field.scalar.is_integer() {
                let zero = |bytes: &[u8]| bytes[..field.scalar.size()].iter().all(|b| *b == 0);
                if column.values.is_empty() && values.clone().all(zero) {
                    return;
                }
                column.values.resize(start);
            }
            extend_column(&mut column.values, field.scalar, big_endian, values);
        };
        let to_rows = Rows {
            means: &mut to.means[start..end],
            rotations: &mut to.rotations[start..end],
            log_scales: &mut to.log_scales[start..end],
            opacity_logits: &mut to.opacity_logits[start..end],
            sh: &mut to.sh[start * values..end * values],
        };
        if end - start <= ROWS_PER_TASK {
            turn(rows, to_rows);
            plan.extra.iter().zip(&mut to.extra).for_each(extend);
        } else {
            let tasks = rows.par_chunks(ROWS_PER_TASK * plan.row_bytes);
            tasks.zip(to_rows.par_tasks(values)).for_each(|(rows, to)| turn(rows, to));
            plan.extra.par_iter().zip(&mut to.extra).for_each(extend);
        }
        self.rows = end;
    }

    /// All that was read. Normals that are all zero are dropped: 3DGS writes them, but never sets them. A file with
    /// some of the three is treated like one with all: the writer adds what is missing.
    pub(super) fn finish(self) -> Gaussians {
        let Self { mut gaussians, rows, .. } = self;
        let never_set = |values: &ColumnValues| {
            matches!(values, ColumnValues::F32(_) | ColumnValues::F64(_)) && values.is_empty()
        };
        let mut normals = gaussians.extra.iter().filter(|column| is_normal(&column.name));
        if normals.all(|column| never_set(&column.values)) {
            gaussians.extra.retain(|column| !is_normal(&column.name));
        }
        gaussians.extra.iter_mut().for_each(|column| column.values.resize(rows));
        gaussians
    }
}

fn is_normal(name: &str) -> bool {
    ["nx", "ny", "nz"].contains(&name)
}

/// Where the values of some rows go.
struct Rows<'a> {
    means: &'a mut [[f32; 3]],
    rotations: &'a mut [[f32; 4]],
    log_scales: &'a mut [[f32; 3]],
    opacity_logits: &'a mut [f32],
    sh: &'a mut [f32],
}

impl<'a> Rows<'a> {
    /// Of [`ROWS_PER_TASK`] rows each; `values` coefficients per row.
    fn par_tasks(self, values: usize) -> impl IndexedParallelIterator<Item = Rows<'a>> {
        let tasks = (
            self.means.par_chunks_mut(ROWS_PER_TASK),
            self.rotations.par_chunks_mut(ROWS_PER_TASK),
            self.log_scales.par_chunks_mut(ROWS_PER_TASK),
            self.opacity_logits.par_chunks_mut(ROWS_PER_TASK),
            self.sh.par_chunks_mut(ROWS_PER_TASK * values),
        );
        tasks.into_par_iter().map(|(means, rotations, log_scales, opacity_logits, sh)| Rows {
            means,
            rotations,
            log_scales,
            opacity_logits,
            sh,
        })
    }
}

/// Fills rows with values from `value`; all bands of spherical harmonics but the first come from `bands`.
fn fill(
    plan: &Plan,
    rows: &[u8],
    to: Rows<'_>,
    value: impl Fn(&[u8], Field) -> f32,
    bands: impl Fn(&[u8], &mut [f32]),
) {
    let values = plan.sh.len();
    for (i, row) in rows.chunks_exact(plan.row_bytes).enumerate() {
        to.means[i] = plan.means.map(|field| value(row, field));
        to.rotations[i] = plan.rotations.map(|field| value(row, field));
        let [a, b] = plan.log_scales.map(|field| value(row, field));
        let third = plan.third_log_scale;
        let third = third.map_or_else(|| a.min(b) + FLAT_LOG_RATIO, |field| value(row, field));
        to.log_scales[i] = [a, b, third];
        to.opacity_logits[i] = value(row, plan.opacity_logit);
        let (first, others) = to.sh[i * values..(i + 1) * values].split_at_mut(3);
        gather(&plan.sh[..3], first, |field| value(row, field));
        if let Some(scale) = plan.color_scale {
            for color in first {
                *color = (*color * scale - 0.5) / SH_C0;
            }
        }
        bands(row, others);
    }
}

fn gather(fields: &[Field], to: &mut [f32], value: impl Fn(Field) -> f32) {
    for (to, field) in to.iter_mut().zip(fields) {
        *to = value(*field);
    }
}

fn f32_of(row: &[u8], field: Field) -> f32 {
    f32_at(&row[field.offset..field.offset + 4])
}

/// Of four little-endian bytes.
fn f32_at(bytes: &[u8]) -> f32 {
    let mut array = [0; 4];
    array.copy_from_slice(bytes);
    f32::from_le_bytes(array)
}

/// All of red, then green, then blue, as little-endian bytes, to RGB by coefficient.
fn interleave(channels: &[u8], sh: &mut [f32]) {
    let (red, others) = channels.split_at(channels.len() / 3);
    let (green, blue) = others.split_at(red.len());
    let channels = red.chunks_exact(4).zip(green.chunks_exact(4)).zip(blue.chunks_exact(4));
    for (rgb, ((red, green), blue)) in sh.chunks_exact_mut(3).zip(channels) {
        rgb.copy_from_slice(&[f32_at(red), f32_at(green), f32_at(blue)]);
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

#[cfg(test)]
mod tests;
