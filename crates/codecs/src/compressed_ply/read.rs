//! Reading a compressed PLY.

use std::io::BufRead;
use std::path::Path;

use motes_scene::Gaussians;

use super::super::quantize::{dc_of_color, from_smallest_three, from_unorm, logit_of_byte};
use super::super::rows::with_room;
use super::{BOUNDS, CHUNK, PACKED, SH_RANGE};
use motes_formats::error::{FormatError, Result, quoted};
use motes_formats::ply::header::{Element, Header};
use motes_formats::ply::rows::{Body, Field, fields, packed_row_bytes};

/// Whether the header is that of a compressed PLY.
pub(crate) fn is_compressed(header: &Header) -> bool {
    let vertex = header.elements.iter().find(|element| element.name == "vertex");
    vertex.is_some_and(|vertex| vertex.property(PACKED[0]).is_some())
}

/// The rows of one element as f64, packed row after row of the wanted columns.
struct Table {
    element: Element,
    fields: Vec<Field>,
    bytes: Vec<u8>,
}

impl Table {
    fn row(&self, i: usize, big_endian: bool) -> impl Iterator<Item = f64> + '_ {
        let size = packed_row_bytes(&self.element);
        let row = &self.bytes[i * size..(i + 1) * size];
        self.fields.iter().map(move |f| f.scalar.decode(&row[f.offset..], big_endian))
    }

    fn rows(&self) -> usize {
        self.element.count as usize
    }
}

/// Reads what follows the header of a compressed PLY.
pub(crate) fn read_compressed(
    header: &Header,
    reader: &mut dyn BufRead,
    path: &Path,
    file_bytes: Option<u64>,
) -> Result<Gaussians> {
    let mut body = Body::new(reader, path, header, file_bytes)?;
    let big_endian = body.is_big_endian();
    let (mut chunks, mut vertices, mut harmonics) = (None, None, None);
    for element in &header.elements {
        if element.count > u64::from(u32::MAX) {
            let place = format!("ply header line {}", element.line);
            let cause = format!("{} rows are more than the 2^32 - 1 that fit", element.count);
            return Err(FormatError::invalid(path, place, cause));
        }
        let (table, names): (_, Vec<&str>) = match element.name.as_str() {
            "chunk" => {
                // Files of the first version have no color bounds.
                let count = if element.property("min_r").is_some() { 18 } else { 12 };
                (&mut chunks, BOUNDS[..count].to_vec())
            }
            "vertex" => (&mut vertices, PACKED.to_vec()),
            "sh" => (&mut harmonics, element.properties.iter().map(|p| p.name.as_str()).collect()),
            _ => {
                body.skip(element)?;
                continue;
            }
        };
        let fields = columns(element, &names, path)?;
        let mut bytes = Vec::new();
        body.read(element, &mut |rows| {
            bytes.extend_from_slice(rows);
            Ok(())
        })?;
        *table = Some(Table { element: element.clone(), fields, bytes });
    }
    body.end()?;
    let missing =
        |name| FormatError::invalid(path, "ply header", format!("there is no element {name}"));
    let (chunks, vertices) =
        (chunks.ok_or_else(|| missing("chunk"))?, vertices.ok_or_else(|| missing("vertex"))?);
    check_counts(&chunks, &vertices, harmonics.as_ref(), path)?;
    let degree = harmonics.as_ref().map_or(Ok(0), |table| degree_of(table, path))?;
    let mut gaussians = with_room(vertices.rows(), degree);
    for i in 0..vertices.rows() {
        let bounds: Vec<f32> =
            chunks.row(i / CHUNK, big_endian).map(|value| value as f32).collect();
        let mut packed = vertices.row(i, big_endian).map(|value| value as u32);
        let mut next = || packed.next().unwrap_or_default();
        append(&mut gaussians, &bounds, [next(), next(), next(), next()]);
        if let Some(table) = &harmonics {
            let bytes: Vec<f32> = table.row(i, big_endian).map(|b| coefficient(b as u8)).collect();
            let per_channel = bytes.len() / 3;
            for k in 0..per_channel {
                gaussians.sh.extend((0..3).map(|channel| bytes[channel * per_channel + k]));
            }
        }
    }
    Ok(gaussians)
}

fn columns(element: &Element, names: &[&str], path: &Path) -> Result<Vec<Field>> {
    let found = |name: &&str| {
        let field = fields(element).find(|(column, _)| column == name).map(|(_, field)| field);
        field.ok_or_else(|| {
            let place = format!("ply header line {}", element.line);
            let cause = format!("property {} is missing", quoted(name));
            FormatError::invalid(path, place, cause)
        })
    };
    names.iter().map(found).collect()
}

fn check_counts(
    chunks: &Table,
    vertices: &Table,
    harmonics: Option<&Table>,
    path: &Path,
) -> Result<()> {
    let needed = vertices.rows().div_ceil(CHUNK);
    if chunks.rows() < needed {
        let cause = format!(
            "{} Gaussians need {needed} chunks, there are {}",
            vertices.rows(),
            chunks.rows()
        );
        let place = format!("ply header line {}", chunks.element.line);
        return Err(FormatError::invalid(path, place, cause));
    }
    if let Some(table) = harmonics.filter(|table| table.rows() != vertices.rows()) {
        let cause = format!("{} rows of harmonics for {} Gaussians", table.rows(), vertices.rows());
        let place = format!("ply header line {}", table.element.line);
        return Err(FormatError::invalid(path, place, cause));
    }
    Ok(())
}

fn degree_of(table: &Table, path: &Path) -> Result<u8> {
    let count = table.fields.len();
    let place = format!("ply header line {}", table.element.line);
    let degree = [(9, 1), (24, 2), (45, 3), (72, 4)].into_iter().find(|(n, _)| *n == count);
    let Some((_, degree)) = degree else {
        let cause = format!("{count} harmonics belong to no SH degree (9, 24, 45 and 72 do)");
        return Err(FormatError::invalid(path, place, cause));
    };
    let in_order =
        table.element.properties.iter().zip(0..).all(|(p, i)| p.name == format!("f_rest_{i}"));
    if !in_order {
        return Err(FormatError::invalid(
            path,
            place,
            "the harmonics are not f_rest_0, f_rest_1, …",
        ));
    }
    Ok(degree)
}

fn append(to: &mut Gaussians, bounds: &[f32], [position, rotation, scale, color]: [u32; 4]) {
    let between = |first: usize, t: [f32; 3]| -> [f32; 3] {
        std::array::from_fn(|i| {
            let (low, high) = (bounds[first + i], bounds[first + 3 + i]);
            low * (1.0 - t[i]) + high * t[i]
        })
    };
    let of_11_10_11 =
        |p: u32| [from_unorm(p >> 21, 11), from_unorm(p >> 11, 10), from_unorm(p, 11)];
    to.means.push(between(0, of_11_10_11(position)));
    to.log_scales.push(between(6, of_11_10_11(scale)));
    let others = [20, 10, 0]
        .map(|shift| (from_unorm(rotation >> shift, 10) - 0.5) * std::f32::consts::SQRT_2);
    to.rotations.push(from_smallest_three(rotation as usize >> 30, others));
    let rgb = [24, 16, 8].map(|shift| from_unorm(color >> shift, 8));
    let rgb = if bounds.len() > 12 { between(12, rgb) } else { rgb };
    to.sh.extend(rgb.map(dc_of_color));
    to.opacity_logits.push(logit_of_byte(color as u8));
}

fn coefficient(byte: u8) -> f32 {
    let n = match byte {
        0 => 0.0,
        255 => 1.0,
        _ => (f32::from(byte) + 0.5) / 256.0,
    };
    (n - 0.5) * SH_RANGE
}
