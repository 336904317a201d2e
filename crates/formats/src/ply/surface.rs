//! Surfaces: triangle meshes with normals and a material at the vertices.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;

use motes_scene::Surface;

use super::faces::{CORNERS, check_corners, vertex_number};
use super::header::{self, Element, Header, Property, PropertyKind};
use super::rows::{Body, Field, fields, packed_row_bytes};
use super::scalar::Encoding;
use super::{open, reserved_rows};
use crate::atomic::{write_checked, write_error};
use crate::error::{FormatError, Result, quoted};
use crate::finite;

const POSITION: [&str; 3] = ["x", "y", "z"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
const MATERIAL: [&str; 5] =
    ["base_color_0", "base_color_1", "base_color_2", "roughness", "metallic"];
const EMISSION: [&str; 3] = ["emission_0", "emission_1", "emission_2"];
/// Bytes of a face as [`write_surface`] writes it: the number 3 and three indices.
const FACE_BYTES: usize = 13;

/// Reads a surface: a binary PLY with the vertex columns `x y z nx ny nz`, optionally all of
/// `base_color_0..2 roughness metallic`, optionally all of `emission_0..2`, and faces of three corners. Other columns are passed over.
///
/// # Errors
/// The file cannot be read, is not a binary PLY file or ends early; a position, normal or only a part
/// of the material or of the emission is missing; a value is not finite, an emission below 0; a face has not three corners or names a
/// vertex that does not exist.
pub fn read_surface(path: &Path) -> Result<Surface> {
    let (mut reader, bytes) = open(path)?;
    read_file(&mut reader, path, bytes)
}

/// Reads a surface from a stream; `name` stands for the file in errors.
///
/// # Errors
/// As [`read_surface`].
pub fn read_surface_from(reader: impl Read, name: &Path) -> Result<Surface> {
    read_file(&mut BufReader::with_capacity(1 << 18, reader), name, None)
}

fn read_file(reader: &mut dyn BufRead, path: &Path, bytes: Option<u64>) -> Result<Surface> {
    let header = header::parse(reader, path)?;
    if header.encoding == Encoding::Ascii {
        let cause = "surfaces are read from binary PLY files only";
        return Err(FormatError::not_supported(path, "ply header", cause)
            .with_remedy("save the mesh as binary PLY"));
    }
    let element = |name: &str| {
        let found = header.elements.iter().find(|element| element.name == name);
        let missing = || {
            let cause = format!("there is no element {name}");
            FormatError::invalid(path, "ply header", cause)
        };
        let found = found.ok_or_else(missing)?;
        if found.count > u64::from(u32::MAX) {
            let place = format!("ply header line {}", found.line);
            let cause = format!("{} rows are more than the 2^32 - 1 that fit", found.count);
            return Err(FormatError::invalid(path, place, cause));
        }
        Ok(found)
    };
    let columns = Columns::new(element("vertex")?, path)?;
    let corners = corners_of(element("face")?, path)?;
    let mut body = Body::new(reader, path, &header, bytes)?;
    let mut surface = Surface::default();
    read_elements(&mut body, &header, &columns, corners, bytes, path, &mut surface)?;
    body.end()?;
    check_corners(&surface.triangles, surface.vertices.len(), path)?;
    Ok(surface)
}

fn read_elements(
    body: &mut Body<'_>,
    header: &Header,
    columns: &Columns,
    corners: &Property,
    bytes: Option<u64>,
    path: &Path,
    surface: &mut Surface,
) -> Result<()> {
    let big_endian = body.is_big_endian();
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => {
                columns.reserve(surface, reserved_rows(element, bytes));
                body.read(element, &mut |rows| columns.append(surface, rows, big_endian, path))?;
            }
            "face" => {
                surface.triangles.reserve(reserved_rows(element, bytes));
                for row in 0..element.count {
                    surface.triangles.push(read_face(body, element, corners, row, path)?);
                }
            }
            _ => body.skip(element)?,
        }
    }
    Ok(())
}

/// Where the values of a vertex are in its row.
struct Columns {
    row_bytes: usize,
    position: [Field; 3],
    normal: [Field; 3],
    material: Option<[Field; 5]>,
    emission: Option<[Field; 3]>,
}

impl Columns {
    fn new(vertex: &Element, path: &Path) -> Result<Self> {
        let all: Vec<(&str, Field)> = fields(vertex).collect();
        let find = |name: &str| all.iter().find(|(n, _)| *n == name).map(|(_, f)| *f);
        let require = |name: &str| {
            find(name).ok_or_else(|| {
                let place = format!("ply header line {}", vertex.line);
                let cause = format!("property {} of the vertices is missing", quoted(name));
                FormatError::invalid(path, place, cause)
            })
        };
        let [x, y, z] = POSITION.map(require);
        let [nx, ny, nz] = NORMAL.map(require);
        let material = if MATERIAL.iter().any(|name| find(name).is_some()) {
            let [r, g, b, roughness, metallic] = MATERIAL.map(require);
            Some([r?, g?, b?, roughness?, metallic?])
        } else {
            None
        };
        let emission = if EMISSION.iter().any(|name| find(name).is_some()) {
            let [r, g, b] = EMISSION.map(require);
            Some([r?, g?, b?])
        } else {
            None
        };
        let (position, normal) = ([x?, y?, z?], [nx?, ny?, nz?]);
        Ok(Self { row_bytes: packed_row_bytes(vertex), position, normal, material, emission })
    }

    fn reserve(&self, surface: &mut Surface, rows: usize) {
        surface.vertices.reserve(rows);
        surface.normals.reserve(rows);
        if self.material.is_some() {
            surface.base_color_linear.reserve(rows);
            surface.roughness.reserve(rows);
            surface.metallic.reserve(rows);
        }
        if self.emission.is_some() {
            surface.emission_linear.reserve(rows);
        }
    }

    fn append(&self, to: &mut Surface, rows: &[u8], big_endian: bool, path: &Path) -> Result<()> {
        for row in rows.chunks_exact(self.row_bytes) {
            let value = |f: Field| f.scalar.decode(&row[f.offset..], big_endian) as f32;
            let finite = |what: &str, values: &[f32]| {
                if values.iter().all(|v| v.is_finite()) {
                    return Ok(());
                }
                let place = format!("row {} of vertex", to.vertices.len());
                Err(FormatError::invalid(path, place, format!("the {what} is {values:?}")))
            };
            let (position, normal) = (self.position.map(value), self.normal.map(value));
            finite("position", &position)?;
            finite("normal", &normal)?;
            let material = self.material.map(|m| m.map(value));
            if let Some(material) = material {
                finite("material", &material)?;
                let [r, g, b, roughness, metallic] = material;
                to.base_color_linear.push([r, g, b]);
                to.roughness.push(roughness);
                to.metallic.push(metallic);
            }
            let emission = self.emission.map(|e| e.map(value));
            if let Some(emission) = emission {
                finite("emission", &emission)?;
                if emission.iter().any(|e| *e < 0.0) {
                    let place = format!("row {} of vertex", to.vertices.len());
                    let cause = format!("the emission is {emission:?}: nothing sends less than 0");
                    return Err(FormatError::invalid(path, place, cause));
                }
                to.emission_linear.push(emission);
            }
            to.vertices.push(position);
            to.normals.push(normal);
        }
        Ok(())
    }
}

fn corners_of<'e>(face: &'e Element, path: &Path) -> Result<&'e Property> {
    let is_list = |p: &&Property| match p.kind {
        PropertyKind::List { item, .. } => item.is_integer() && CORNERS.contains(&p.name.as_str()),
        PropertyKind::Scalar(_) => false,
    };
    face.properties.iter().find(is_list).ok_or_else(|| {
        let place = format!("ply header line {}", face.line);
        let cause = "the faces have no list vertex_indices of whole numbers";
        FormatError::invalid(path, place, cause)
    })
}

fn read_face(
    body: &mut Body<'_>,
    face: &Element,
    corners: &Property,
    row: u64,
    path: &Path,
) -> Result<[u32; 3]> {
    let big_endian = body.is_big_endian();
    let mut triangle = [0; 3];
    // Three corners of at most eight bytes.
    let mut bytes = [0; 24];
    for property in &face.properties {
        let (count, item) = match property.kind {
            PropertyKind::Scalar(scalar) => {
                body.pass_over(scalar.size() as u128, face, row)?;
                continue;
            }
            PropertyKind::List { count, item } => (count, item),
        };
        let place = format_args!("byte {}", body.position()).to_string();
        body.exact(&mut bytes[..count.size()], face, row)?;
        let length = count.decode(&bytes, big_endian);
        if property.name != corners.name {
            if length < 0.0 {
                let cause = format!("list {} has {length} items", quoted(&property.name));
                return Err(FormatError::invalid(path, place, cause));
            }
            body.pass_over(length as u128 * item.size() as u128, face, row)?;
            continue;
        }
        if length != 3.0 {
            let cause = format!("face {row} has {length} corners");
            return Err(FormatError::invalid(path, place, cause)
                .with_remedy("surfaces consist of triangles: triangulate the mesh"));
        }
        let bytes = &mut bytes[..3 * item.size()];
        body.exact(bytes, face, row)?;
        for (corner, bytes) in triangle.iter_mut().zip(bytes.chunks_exact(item.size())) {
            *corner = vertex_number(item.decode(bytes, big_endian)).ok_or_else(|| {
                let cause = format!("face {row} has the corner {}", item.decode(bytes, big_endian));
                FormatError::invalid(path, place.as_str(), cause)
            })?;
        }
    }
    Ok(triangle)
}

/// Writes a surface as a binary little-endian PLY; the material columns when it has materials, those of the emission when any
/// vertex shines.
///
/// # Errors
/// Writing fails.
///
/// # Panics
/// When the arrays are not [consistent](Surface::is_consistent).
pub fn write_surface(path: &Path, surface: &Surface) -> Result<()> {
    let s = surface;
    finite::columns(
        path,
        [
            ("position", s.vertices.as_flattened(), 3),
            ("normal", s.normals.as_flattened(), 3),
            ("base color", s.base_color_linear.as_flattened(), 3),
            ("roughness", &s.roughness, 1),
            ("metallic", &s.metallic, 1),
            ("emission", s.emission_linear.as_flattened(), 3),
        ],
    )?;
    write_checked(path, |writer| write_surface_to(writer, surface, path))
}

/// Writes a surface to a stream; `name` stands for the file in errors.
///
/// # Errors
/// As [`write_surface`].
///
/// # Panics
/// As [`write_surface`].
pub fn write_surface_to(mut writer: impl Write, surface: &Surface, name: &Path) -> Result<()> {
    assert!(surface.is_consistent(), "arrays of different lengths or corners without a vertex");
    let refused = |error| write_error(name, error);
    let mut text = String::from("ply\nformat binary_little_endian 1.0\n");
    // Readers of 1.0 understand a surface on which nothing shines.
    let shines = surface.shines();
    let comment = "comment motes format motes/surface 1.1\n";
    text.push_str(&if shines { comment.to_owned() } else { comment.replace("1.1", "1.0") });
    text.push_str(&format!("element vertex {}\n", surface.vertices.len()));
    let material = surface.has_materials();
    let material_columns = if material { &MATERIAL[..] } else { &[] };
    let emission_columns = if shines { &EMISSION[..] } else { &[] };
    for column in POSITION.iter().chain(&NORMAL).chain(material_columns).chain(emission_columns) {
        text.push_str(&format!("property float {column}\n"));
    }
    text.push_str(&format!("element face {}\n", surface.triangles.len()));
    text.push_str("property list uchar int vertex_indices\nend_header\n");
    writer.write_all(text.as_bytes()).map_err(refused)?;
    let columns = 6 + material_columns.len() + emission_columns.len();
    let mut bytes = Vec::with_capacity(surface.vertices.len() * 4 * columns);
    let mut append = |values: &[f32]| values.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    for i in 0..surface.vertices.len() {
        append(&surface.vertices[i]);
        append(&surface.normals[i]);
        if material {
            append(&surface.base_color_linear[i]);
            append(&[surface.roughness[i], surface.metallic[i]]);
        }
        if shines {
            append(&surface.emission(i).unwrap_or_default());
        }
    }
    writer.write_all(&bytes).map_err(refused)?;
    let mut bytes = Vec::with_capacity(surface.triangles.len() * FACE_BYTES);
    for triangle in &surface.triangles {
        bytes.push(3);
        triangle.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    }
    writer.write_all(&bytes).map_err(refused)
}
