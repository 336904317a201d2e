//! Wavefront OBJ: polygons with texture coordinates and normals, materials in a library beside it.
//!
//! Read line by line here, so that an error names its line and no file ends the program: the crate that is usual for this
//! panics on a color of two numbers.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec3, Vec3};
use motes_formats::budget;
use motes_formats::capture::checked_relative_path;
use motes_formats::error::{FormatError, Result, quoted};
use motes_math::srgb;
use motes_scene::Surface;

use super::creases::add_creased_normals;
use super::model::{Mesh, finite_vertices};
use super::mtl::{self, Named};
use super::texture::ImageCache;
use super::words::{floats, key_of};

/// Libraries of one file; more are taken for damage.
const MOST_LIBRARIES: usize = 64;
/// Bytes of a vertex as it is kept, and of a triangle.
const KEPT_BYTES: u64 = 120;

/// What a corner names: position, texture coordinates, normal, material. 0 is none.
type Corner = [u32; 4];

struct Reader<'p> {
    path: &'p Path,
    positions: Vec<[f32; 3]>,
    colors: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    materials: Vec<Named>,
    numbers: HashMap<Corner, u32>,
    corners: Vec<Corner>,
    triangles: Vec<[u32; 3]>,
    material_of: Vec<u32>,
    flat: Vec<bool>,
    material: u32,
    is_flat: bool,
}

/// Reads an OBJ file with the libraries that it names.
///
/// # Errors
/// It is malformed, has no faces, or a library or texture is missing or elsewhere than beside it.
pub(crate) fn read(path: &Path) -> Result<Mesh> {
    let bytes = std::fs::read(path).map_err(|error| FormatError::io(path, error))?;
    // Names of groups may have any encoding; numbers are ASCII.
    let text = String::from_utf8_lossy(&bytes);
    let mut reader = Reader {
        path,
        positions: Vec::new(),
        colors: Vec::new(),
        uvs: Vec::new(),
        normals: Vec::new(),
        materials: vec![Named::new("")],
        numbers: HashMap::new(),
        corners: Vec::new(),
        triangles: Vec::new(),
        material_of: Vec::new(),
        flat: Vec::new(),
        material: 0,
        is_flat: false,
    };
    let mut images = ImageCache::new(path);
    let mut libraries: Vec<String> = Vec::new();
    let mut joined = String::new();
    for (number, line) in text.lines().enumerate() {
        // A backslash at the end goes on in the next line.
        if let Some(start) = line.trim_end().strip_suffix('\\') {
            joined.push_str(start);
            joined.push(' ');
            continue;
        }
        let whole = std::mem::take(&mut joined) + line;
        let (key, rest) = key_of(&whole);
        match key {
            "mtllib" => reader.library(rest, number, &mut libraries, &mut images)?,
            _ => reader.line(key, rest, number)?,
        }
    }
    let rows = (reader.corners.len() + reader.triangles.len()) as u64;
    budget::rows(path, "faces", "the triangles", rows * KEPT_BYTES, bytes.len() as u64)?;
    reader.mesh()
}

impl Reader<'_> {
    fn fault(&self, line: usize, cause: impl Into<String>) -> FormatError {
        FormatError::invalid(self.path, format!("line {}", line + 1), cause)
    }

    fn library(
        &mut self,
        name: &str,
        line: usize,
        seen: &mut Vec<String>,
        images: &mut ImageCache<'_>,
    ) -> Result<()> {
        let name = name.trim().replace('\\', "/");
        if seen.contains(&name) {
            return Ok(());
        }
        if seen.len() == MOST_LIBRARIES {
            return Err(self.fault(line, format!("more than {MOST_LIBRARIES} material libraries")));
        }
        let place = format!("line {}", line + 1);
        let relative = checked_relative_path(self.path, &place, &name)?;
        let file = self.path.parent().unwrap_or(Path::new("")).join(relative);
        let text = std::fs::read(&file).map_err(|error| {
            let cause = format!("the material library {} cannot be read: {error}", quoted(&name));
            self.fault(line, cause).with_remedy("copy it beside the mesh, or take the line out")
        })?;
        mtl::read(&String::from_utf8_lossy(&text), &file, images, &mut self.materials)?;
        seen.push(name);
        Ok(())
    }

    fn line(&mut self, key: &str, rest: &str, number: usize) -> Result<()> {
        let values = || floats(rest, self.path, number);
        match key {
            "v" => {
                let v = values()?;
                let [x, y, z, ref more @ ..] = v[..] else {
                    return Err(self.fault(number, "a vertex needs three numbers"));
                };
                self.positions.push([x, y, z]);
                // Colors behind the position are sRGB-encoded; one number more is a weight.
                if let [r, g, b, ..] = *more {
                    self.colors.resize(self.positions.len() - 1, [1.0; 3]);
                    self.colors.push([r, g, b].map(|c| srgb::decode(c.clamp(0.0, 1.0))));
                }
            }
            "vt" => {
                let v = values()?;
                // The origin of OBJ is at the bottom.
                self.uvs.push([
                    v.first().copied().unwrap_or(0.0),
                    1.0 - v.get(1).copied().unwrap_or(0.0),
                ]);
            }
            "vn" => {
                let [x, y, z, ..] = values()?[..] else {
                    return Err(self.fault(number, "a normal needs three numbers"));
                };
                self.normals.push([x, y, z]);
            }
            "f" => self.face(rest, number)?,
            "usemtl" => {
                let found = self.materials.iter().rposition(|m| m.name == rest.trim());
                self.material = found.unwrap_or(0) as u32;
            }
            "s" => self.is_flat = ["off", "0"].contains(&rest.trim()),
            _ => {}
        }
        Ok(())
    }

    /// A number of a corner: 1 is the first, -1 the last, none is 0.
    fn index(&self, word: &str, count: usize, what: &str, line: usize) -> Result<u32> {
        if word.is_empty() {
            return Ok(0);
        }
        let number: i64 = word.parse().map_err(|_| {
            self.fault(line, format!("{} is not the number of a {what}", quoted(word)))
        })?;
        let index = if number < 0 { number + count as i64 + 1 } else { number };
        if !(1..=count as i64).contains(&index) {
            let cause = format!("{number} names a {what} of {count}");
            return Err(self.fault(line, cause));
        }
        u32::try_from(index).map_err(|_| self.fault(line, format!("too many {what}s")))
    }

    fn face(&mut self, rest: &str, line: usize) -> Result<()> {
        let mut fan: Vec<u32> = Vec::new();
        for word in rest.split_whitespace() {
            let mut parts = word.split('/');
            let mut next = || parts.next().unwrap_or("");
            let v = self.index(next(), self.positions.len(), "vertex", line)?;
            if v == 0 {
                return Err(self.fault(line, format!("the corner {} has no vertex", quoted(word))));
            }
            let vt = self.index(next(), self.uvs.len(), "texture coordinate", line)?;
            let vn = self.index(next(), self.normals.len(), "normal", line)?;
            let corner = [v, vt, vn, self.material];
            let corners = &mut self.corners;
            fan.push(*self.numbers.entry(corner).or_insert_with(|| {
                corners.push(corner);
                corners.len() as u32 - 1
            }));
        }
        // Points and lines have no area.
        for k in 2..fan.len() {
            self.triangles.push([fan[0], fan[k - 1], fan[k]]);
            self.material_of.push(self.material);
            self.flat.push(self.is_flat);
        }
        Ok(())
    }

    fn mesh(self) -> Result<Mesh> {
        if self.triangles.is_empty() {
            return Err(FormatError::invalid(self.path, "", "the mesh has no faces"));
        }
        let material = |c: &Corner| &self.materials[c[3] as usize];
        let color = |c: &Corner| {
            let own = Vec3::from(material(c).base_color_linear);
            let vertex = self.colors.get(c[0] as usize - 1);
            // A mesh of colored vertices without a material shows them as they are.
            let base = if vertex.is_some() && c[3] == 0 { Vec3::ONE } else { own };
            (base * vertex.map_or(Vec3::ONE, |v| Vec3::from(*v))).to_array()
        };
        let given = self.corners.iter().all(|c| c[2] > 0);
        let normal = |c: &Corner| self.normals[c[2] as usize - 1];
        let unit = |n: [f32; 3]| Vec3::from(n).normalize_or(Vec3::Z).to_array();
        let mut surface = Surface {
            vertices: self.corners.iter().map(|c| self.positions[c[0] as usize - 1]).collect(),
            normals: if given {
                self.corners.iter().map(|c| unit(normal(c))).collect()
            } else {
                Vec::new()
            },
            base_color_linear: self.corners.iter().map(color).collect(),
            roughness: self.corners.iter().map(|c| material(c).roughness).collect(),
            metallic: self.corners.iter().map(|c| material(c).metallic).collect(),
            triangles: self.triangles,
            emission_linear: Vec::new(),
        };
        finite_vertices(&surface, self.path)?;
        let uv = |c: &Corner| match c[1] {
            0 => [0.0; 2],
            vt => self.uvs[vt as usize - 1],
        };
        let mut uvs = [self.corners.iter().map(uv).collect(), Vec::new()];
        if !given {
            add_creased_normals(&mut surface, &mut uvs, &self.flat);
        }
        let looks = self.materials.into_iter().map(|m| m.look).collect();
        Ok(Mesh { surface, uvs, look_of: self.material_of, looks, up: DVec3::Y })
    }
}
