//! Triangle meshes of other programs: text or binary, polygons of any size, with or without normals and colors.
//!
//! [`super::read_surface`] reads what motes wrote and takes nothing else; this reads what people have.

use std::io::Read as _;
use std::path::Path;

use glam::Vec3;
use motes_math::srgb;
use motes_scene::Surface;

use super::faces::{CORNERS, check_corners, vertex_number};
use super::header::{self, Element, PropertyKind};
use super::scalar::{Encoding, Scalar};
use super::{open, plan::full_scale};
use crate::error::{FormatError, Result, quoted};

/// Corners of a face; more are taken for damage.
const MAX_CORNERS: u64 = 1 << 16;

/// Whether a PLY file has faces: a mesh, not a splat.
///
/// # Errors
/// The file cannot be read or its header is broken.
pub fn has_faces(path: &Path) -> Result<bool> {
    let (mut reader, _) = open(path)?;
    let header = header::parse(&mut reader, path)?;
    Ok(header.elements.iter().any(|e| e.name == "face" && e.count > 0))
}

/// Reads a mesh. Polygons are cut into fans of triangles. A surface without normals is
/// one of a file without them. Base color comes from `base_color_0..2`, else from `red green blue` (sRGB-encoded); roughness and
/// metallic from their columns, else 0.6 and 0. Without any of them the surface has no material.
///
/// # Errors
/// The file cannot be read, is not a PLY file or ends early; there are no vertices or faces; a position is not
/// finite; a face names a vertex that does not exist.
pub fn read_mesh(path: &Path) -> Result<Surface> {
    let (mut reader, bytes) = open(path)?;
    let header = header::parse(&mut reader, path)?;
    let mut body = Vec::new();
    reader.read_to_end(&mut body).map_err(|error| FormatError::io(path, error))?;
    for element in &header.elements {
        let least = element.count.saturating_mul(element.least_row_bytes(header.encoding).max(1));
        if least > body.len() as u64 + 1 {
            let (name, count) = (quoted(&element.name), element.count);
            let cause = format!("the header promises {count} rows of {name}, the file ends before");
            let place = format!("ply header line {}", element.line);
            return Err(FormatError::invalid(path, place, cause));
        }
    }
    debug_assert!(bytes.is_none_or(|size| size >= body.len() as u64), "the header has bytes, too");
    let mut values = Values { body: &body, at: 0, encoding: header.encoding, path };
    let mut mesh = Mesh::default();
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => mesh.read_vertices(&mut values, element)?,
            "face" => mesh.read_faces(&mut values, element)?,
            _ => values.skip(element)?,
        }
    }
    mesh.surface(path)
}

/// The numbers of a body, one after another.
struct Values<'a> {
    body: &'a [u8],
    at: usize,
    encoding: Encoding,
    path: &'a Path,
}

impl Values<'_> {
    fn next(&mut self, scalar: Scalar) -> Result<f64> {
        let end = || {
            FormatError::invalid(
                self.path,
                "end of file",
                "the file ends in the middle of its data",
            )
        };
        if self.encoding == Encoding::Ascii {
            let rest = &self.body[self.at..];
            let start = rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or_else(end)?;
            let length = rest[start..].iter().position(u8::is_ascii_whitespace);
            let word = &rest[start..length.map_or(rest.len(), |l| start + l)];
            let value = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
            let place = format!("byte {} of the body", self.at + start);
            self.at += start + word.len();
            return value.ok_or_else(|| {
                FormatError::invalid(self.path, place, format!("{} is not a number", quoted(word)))
            });
        }
        let bytes = self.body.get(self.at..self.at + scalar.size()).ok_or_else(end)?;
        self.at += scalar.size();
        Ok(scalar.decode(bytes, self.encoding == Encoding::BigEndian))
    }

    /// Length of a list.
    fn length(&mut self, count: Scalar) -> Result<u64> {
        let place = format!("byte {} of the body", self.at);
        let length = self.next(count)?;
        if !(0.0..=MAX_CORNERS as f64).contains(&length) {
            let cause = format!("a list of {length} items");
            return Err(FormatError::invalid(self.path, place, cause));
        }
        Ok(length as u64)
    }

    fn skip(&mut self, element: &Element) -> Result<()> {
        for _ in 0..element.count {
            for property in &element.properties {
                match property.kind {
                    PropertyKind::Scalar(scalar) => {
                        self.next(scalar)?;
                    }
                    PropertyKind::List { count, item } => {
                        for _ in 0..self.length(count)? {
                            self.next(item)?;
                        }
                    }
                }
            }
        }
        Ok(())
    }
}

#[derive(Default)]
struct Mesh {
    vertices: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    base_color_linear: Vec<[f32; 3]>,
    roughness: Vec<f32>,
    metallic: Vec<f32>,
    triangles: Vec<[u32; 3]>,
}

/// Columns of a vertex that are understood.
const COLUMNS: [&str; 14] = [
    "x",
    "y",
    "z",
    "nx",
    "ny",
    "nz",
    "red",
    "green",
    "blue",
    "base_color_0",
    "base_color_1",
    "base_color_2",
    "roughness",
    "metallic",
];

impl Mesh {
    fn read_vertices(&mut self, values: &mut Values<'_>, element: &Element) -> Result<()> {
        let has = |names: &[&str]| names.iter().all(|name| element.property(name).is_some());
        if !has(&COLUMNS[..3]) {
            let place = format!("ply header line {}", element.line);
            return Err(FormatError::invalid(
                values.path,
                place,
                "the vertices have no x, y and z",
            ));
        }
        let (normals, rgb, base) = (has(&COLUMNS[3..6]), has(&COLUMNS[6..9]), has(&COLUMNS[9..12]));
        for row in 0..element.count {
            let mut found = [0.0; COLUMNS.len()];
            (found[12], found[13]) = (0.6, 0.0);
            for property in &element.properties {
                match property.kind {
                    PropertyKind::Scalar(scalar) => {
                        let value = values.next(scalar)?;
                        if let Some(i) = COLUMNS.iter().position(|name| *name == property.name) {
                            let is_8_bit = (6..9).contains(&i);
                            found[i] = if is_8_bit {
                                value / f64::from(full_scale(scalar))
                            } else {
                                value
                            };
                        }
                    }
                    PropertyKind::List { count, item } => {
                        for _ in 0..values.length(count)? {
                            values.next(item)?;
                        }
                    }
                }
            }
            let triple = |i: usize| [found[i] as f32, found[i + 1] as f32, found[i + 2] as f32];
            if !triple(0).iter().all(|v| v.is_finite()) {
                let cause = format!("the position is {:?}", triple(0));
                return Err(FormatError::invalid(
                    values.path,
                    format!("row {row} of vertex"),
                    cause,
                ));
            }
            self.vertices.push(triple(0));
            if normals {
                self.normals.push(triple(3));
            }
            if base || rgb {
                let color = if base { triple(9) } else { triple(6).map(srgb::decode) };
                self.base_color_linear.push(color.map(|v| v.max(0.0).clamp(0.0, 1.0)));
                self.roughness.push((found[12] as f32).max(0.0).clamp(0.0, 1.0));
                self.metallic.push((found[13] as f32).max(0.0).clamp(0.0, 1.0));
            }
        }
        Ok(())
    }

    fn read_faces(&mut self, values: &mut Values<'_>, element: &Element) -> Result<()> {
        for row in 0..element.count {
            for property in &element.properties {
                let PropertyKind::List { count, item } = property.kind else {
                    if let PropertyKind::Scalar(scalar) = property.kind {
                        values.next(scalar)?;
                    }
                    continue;
                };
                let is_corners = CORNERS.contains(&property.name.as_str());
                let length = values.length(count)?;
                let mut corners = [0u32; 2];
                for k in 0..length {
                    let value = values.next(item)?;
                    if !is_corners {
                        continue;
                    }
                    let index = vertex_number(value).ok_or_else(|| {
                        let cause = format!("face {row} has the corner {value}");
                        FormatError::invalid(values.path, format!("row {row} of face"), cause)
                    })?;
                    match k {
                        0 | 1 => corners[k as usize] = index,
                        _ => {
                            self.triangles.push([corners[0], corners[1], index]);
                            corners[1] = index;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn surface(self, path: &Path) -> Result<Surface> {
        let n = self.vertices.len();
        if n == 0 || self.triangles.is_empty() {
            return Err(FormatError::invalid(path, "", "the mesh has no vertices or no faces"));
        }
        check_corners(&self.triangles, n, path)?;
        let units: Vec<Vec3> =
            self.normals.iter().map(|n| Vec3::from(*n).normalize_or_zero()).collect();
        // Normals of a file that has some of length 0 are no normals.
        let whole = units.len() == n && units.iter().all(|u| u.is_finite() && *u != Vec3::ZERO);
        Ok(Surface {
            normals: if whole { units.iter().map(Vec3::to_array).collect() } else { Vec::new() },
            vertices: self.vertices,
            triangles: self.triangles,
            base_color_linear: self.base_color_linear,
            roughness: self.roughness,
            metallic: self.metallic,
            emission_linear: Vec::new(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &[u8]) -> Result<Surface> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.ply");
        std::fs::write(&path, text).unwrap();
        assert!(has_faces(&path)?);
        read_mesh(&path)
    }

    const HEADER: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n\
        property float y\nproperty float z\nproperty uchar red\nproperty uchar green\n\
        property uchar blue\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";

    #[test]
    fn a_square_of_text_becomes_two_triangles() {
        let body = "0 0 1 255 0 0\n1 0 1 255 0 0\n1 1 1 0 255 0\n0 1 1 0 0 0\n4 0 1 2 3\n";
        let surface = read(format!("{HEADER}{body}").as_bytes()).unwrap();
        assert!(surface.has_materials());
        assert_eq!(surface.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert!(surface.normals.is_empty(), "it has none of its own");
        assert_eq!(surface.base_color_linear[0], [1.0, 0.0, 0.0]);
    }

    #[test]
    fn broken_meshes_are_refused() {
        let body = "0 0 1 255 0 0\n1 0 1 255 0 0\n1 1 1 0 255 0\n0 1 1 0 0 0\n";
        for (tail, says) in [
            ("4 0 1 2 9\n", "names a vertex"),
            ("4 0 1 2\n", "ends in the middle"),
            ("3 0 1 x\n", "is not a number"),
            ("3 0 1 -1\n", "has the corner"),
            ("2 0 1\n", "no faces"),
        ] {
            let error = read(format!("{HEADER}{body}{tail}").as_bytes()).unwrap_err().to_string();
            assert!(error.contains(says), "{tail:?}: {error}");
        }
    }
}
