//! Triangle meshes of a glTF document.

use std::path::Path;

use glam::{DVec3, Mat3, Mat4, Vec3};
use motes_formats::budget;
use motes_formats::error::{FormatError, Result};
use motes_scene::Surface;

use super::EXTENSION;
use super::accessor::Values;
use super::document::{Gltf, Primitive, TextureInfo};
use super::opened::{Opened, placed_meshes, resource};
use super::read::unpacked_bytes;
use crate::mesh::{
    Affine, GRAY, ImageCache, Look, Mesh, ROUGHNESS, TextureUse, Wrap, add_flat_normals,
    finite_vertices,
};

/// Extensions whose meaning is known, or that may be passed over.
const KNOWN: [&str; 5] = [
    EXTENSION,
    "KHR_texture_transform",
    "KHR_mesh_quantization",
    "KHR_materials_unlit",
    "EXT_texture_webp",
];
/// Bytes of a triangle as it is kept: three vertices of its own at most.
const TRIANGLE_BYTES: u64 = 3 * 60;

/// Reads the triangles of a document; `None` when it has Gaussians.
///
/// # Errors
/// The document or one of its files is broken or elsewhere than beside it, or it has no triangles.
pub(crate) fn read_mesh(path: &Path) -> Result<Option<Mesh>> {
    let data = std::fs::read(path).map_err(|error| FormatError::io(path, error))?;
    let opened = Opened::new(&data, path, &KNOWN)?;
    let mut primitives = opened.gltf.meshes.iter().flat_map(|mesh| &mesh.primitives);
    if primitives.any(|primitive| primitive.extensions.contains_key(EXTENSION)) {
        return Ok(None);
    }
    let mut reader = Reader {
        opened: &opened,
        path,
        images: ImageCache::new(path),
        looks: vec![None; opened.gltf.materials.len()],
        mesh: Mesh::plain(Surface::default(), DVec3::Y),
    };
    let mut unpacked = 0u64;
    for (mesh, world) in placed_meshes(&opened.gltf, path)? {
        for primitive in &opened.gltf.meshes[mesh].primitives {
            // One mesh may stand in many places, and one accessor for many attributes.
            let bytes = unpacked_bytes(&opened.gltf, primitive, opened.packed);
            unpacked = unpacked.saturating_add(bytes).saturating_add(corners(&opened, primitive));
            budget::rows(path, "meshes", "the triangles of all nodes", unpacked, opened.packed)?;
            reader.add(primitive, world)?;
        }
    }
    if reader.mesh.surface.triangles.is_empty() {
        return Err(FormatError::invalid(path, "meshes", "the scene has no triangles"));
    }
    finite_vertices(&reader.mesh.surface, path)?;
    Ok(Some(reader.mesh))
}

/// Bytes that the triangles of a primitive take.
fn corners(opened: &Opened, primitive: &Primitive) -> u64 {
    let index = primitive.indices.or(primitive.attributes.get("POSITION").copied());
    let count = index.and_then(|i| opened.gltf.accessors.get(i)).map_or(0, |a| a.count);
    if count > opened.packed { 0 } else { count.saturating_mul(TRIANGLE_BYTES / 3) }
}

struct Reader<'a> {
    opened: &'a Opened,
    path: &'a Path,
    images: ImageCache<'a>,
    /// Number of the look of a material, once it was read.
    looks: Vec<Option<u32>>,
    mesh: Mesh,
}

/// Factors of a material.
struct Factors {
    base: [f32; 3],
    roughness: f32,
    metallic: f32,
}

impl Reader<'_> {
    fn values(&self, primitive: &Primitive, name: &str, shape: &str) -> Result<Option<Values<'_>>> {
        let Some(index) = primitive.attributes.get(name) else { return Ok(None) };
        Values::find(&self.opened.gltf, &self.opened.buffers, *index, shape, self.path).map(Some)
    }

    /// Appends a primitive that stands at `world`.
    fn add(&mut self, primitive: &Primitive, world: Mat4) -> Result<()> {
        let Some(positions) = self.values(primitive, "POSITION", "VEC3")? else { return Ok(()) };
        let count = positions.count;
        let indices = match primitive.indices {
            None => None,
            Some(index) => {
                let (gltf, buffers) = (&self.opened.gltf, &self.opened.buffers);
                Some(Values::find(gltf, buffers, index, "SCALAR", self.path)?)
            }
        };
        let triangles = triangles(primitive.mode, indices.as_ref(), count, self.path)?;
        if triangles.is_empty() {
            return Ok(());
        }
        let linear = Mat3::from_mat4(world);
        let mirrored = linear.determinant() < 0.0;
        let turn = |[a, b, c]: [u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
        let mut part = Surface {
            vertices: (0..count)
                .map(|i| world.transform_point3(positions.vector(i).into()).to_array())
                .collect(),
            triangles: triangles.into_iter().map(turn).collect(),
            ..Surface::default()
        };
        if let Some(normals) =
            self.values(primitive, "NORMAL", "VEC3")?.filter(|n| n.count == count)
        {
            // Cofactors: the inverse transpose but for a factor, also where a scale is 0.
            let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
            let sign = if mirrored { -1.0 } else { 1.0 };
            let cofactors = Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
            let unit = |i| (cofactors * Vec3::from(normals.vector(i))).normalize_or(Vec3::Z);
            part.normals = (0..count).map(|i| unit(i).to_array()).collect();
        }
        let mut uvs = [self.uvs(primitive, 0, count)?, self.uvs(primitive, 1, count)?];
        let (look, factors) = self.material(primitive.material)?;
        part.base_color_linear = self.vertex_colors(primitive, &factors, count)?;
        part.roughness = vec![factors.roughness; count];
        part.metallic = vec![factors.metallic; count];
        if part.normals.is_empty() {
            // The specification: flat where none are given.
            add_flat_normals(&mut part, &mut uvs);
        }
        self.append(part, uvs, look);
        Ok(())
    }

    fn uvs(&self, primitive: &Primitive, set: usize, count: usize) -> Result<Vec<[f32; 2]>> {
        let values = self.values(primitive, &format!("TEXCOORD_{set}"), "VEC2")?;
        Ok(match values.filter(|v| v.count == count) {
            Some(values) => (0..count).map(|i| values.vector(i)).collect(),
            None => Vec::new(),
        })
    }

    /// The base color factor times the colors of the vertices, which are linear.
    fn vertex_colors(
        &self,
        primitive: &Primitive,
        factors: &Factors,
        count: usize,
    ) -> Result<Vec<[f32; 3]>> {
        let shape = primitive
            .attributes
            .get("COLOR_0")
            .and_then(|index| self.opened.gltf.accessors.get(*index))
            .map_or("VEC3", |accessor| if accessor.shape == "VEC4" { "VEC4" } else { "VEC3" });
        let colors = self.values(primitive, "COLOR_0", shape)?.filter(|c| c.count == count);
        let base = Vec3::from(factors.base);
        let color = |i: usize| match &colors {
            Some(colors) => (base * Vec3::from(colors.vector::<3>(i))).clamp(Vec3::ZERO, Vec3::ONE),
            None => base,
        };
        Ok((0..count).map(|i| color(i).to_array()).collect())
    }

    fn append(&mut self, part: Surface, uvs: [Vec<[f32; 2]>; 2], look: u32) {
        let Mesh { surface, uvs: all, look_of, .. } = &mut self.mesh;
        let first = surface.vertices.len();
        let n = part.vertices.len();
        surface.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first as u32)));
        look_of.resize(surface.triangles.len(), look);
        surface.vertices.extend(part.vertices);
        surface.normals.extend(part.normals);
        surface.base_color_linear.extend(part.base_color_linear);
        surface.roughness.extend(part.roughness);
        surface.metallic.extend(part.metallic);
        for (all, set) in all.iter_mut().zip(uvs) {
            if !set.is_empty() || !all.is_empty() {
                all.resize(first, [0.0; 2]);
                all.extend(set);
                all.resize(first + n, [0.0; 2]);
            }
        }
    }

    /// Number of the look and the factors of a material.
    fn material(&mut self, index: Option<usize>) -> Result<(u32, Factors)> {
        let Some(index) = index else {
            return Ok((0, Factors { base: GRAY, roughness: ROUGHNESS, metallic: 0.0 }));
        };
        let gltf: &Gltf = &self.opened.gltf;
        let material = gltf.materials.get(index).ok_or_else(|| {
            FormatError::invalid(self.path, format!("materials[{index}]"), "it does not exist")
        })?;
        let pbr = &material.pbr_metallic_roughness;
        let [r, g, b, a] = pbr.base_color_factor.unwrap_or([1.0; 4]).map(|v| v.clamp(0.0, 1.0));
        let factors = Factors {
            base: [r, g, b],
            roughness: pbr.roughness_factor.unwrap_or(1.0).clamp(0.0, 1.0),
            metallic: pbr.metallic_factor.unwrap_or(1.0).clamp(0.0, 1.0),
        };
        if let Some(look) = self.looks[index] {
            return Ok((look, factors));
        }
        let look = Look {
            base_color: self.texture(pbr.base_color_texture.as_ref())?,
            metallic_roughness: self.texture(pbr.metallic_roughness_texture.as_ref())?,
            transparency: 1.0 - a,
            cutoff: (material.alpha_mode == "MASK").then(|| material.alpha_cutoff.unwrap_or(0.5)),
            opaque: !["MASK", "BLEND"].contains(&material.alpha_mode.as_str()),
            ..Look::default()
        };
        self.mesh.looks.push(look);
        let number = self.mesh.looks.len() as u32 - 1;
        self.looks[index] = Some(number);
        Ok((number, factors))
    }

    fn texture(&mut self, info: Option<&TextureInfo>) -> Result<Option<TextureUse>> {
        let Some(info) = info else { return Ok(None) };
        let Opened { gltf, buffers, .. } = self.opened;
        let path = self.path;
        let missing = |place: String| FormatError::invalid(path, place, "it does not exist");
        let texture = gltf.textures.get(info.index);
        let texture = texture.ok_or_else(|| missing(format!("textures[{}]", info.index)))?;
        let webp = texture.extensions.get("EXT_texture_webp").and_then(|e| e["source"].as_u64());
        let place = format!("textures[{}]/source", info.index);
        let source = texture.source.or(webp.map(|i| i as usize)).ok_or_else(|| {
            FormatError::not_supported(
                path,
                place.clone(),
                "the texture has no image that is known",
            )
            .with_remedy("save the textures as PNG, JPEG or WebP")
        })?;
        let image = gltf.images.get(source).ok_or_else(|| missing(place))?;
        let place = format!("images[{source}]");
        let texture = self.images.get(&source.to_string(), || {
            if let Some(uri) = &image.uri {
                return resource(uri, path, &place).map(|(bytes, file)| (bytes.into(), file));
            }
            let view = image.buffer_view.and_then(|view| gltf.buffer_views.get(view));
            let bytes = view.and_then(|view| {
                let buffer = buffers.get(view.buffer)?;
                let end = view.byte_offset.checked_add(view.byte_length)?;
                buffer.get(usize::try_from(view.byte_offset).ok()?..usize::try_from(end).ok()?)
            });
            let bytes = bytes.ok_or_else(|| missing(format!("{place}/bufferView")))?;
            Ok((bytes.into(), path.to_owned()))
        })?;
        let transform = info.extensions.transform.as_ref();
        let sampler = gltf.textures[info.index].sampler.and_then(|s| gltf.samplers.get(s));
        let wrap = |mode: Option<u32>| match mode {
            Some(33071) => Wrap::Clamp,
            Some(33648) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        Ok(Some(TextureUse {
            texture,
            set: transform.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord),
            transform: transform.map_or(Affine::IDENTITY, |t| {
                let ([sx, sy], [ox, oy]) = (t.scale.unwrap_or([1.0; 2]), t.offset);
                let (sin, cos) = t.rotation.sin_cos();
                Affine([[cos * sx, sin * sy, ox], [-sin * sx, cos * sy, oy]])
            }),
            wrap: sampler.map_or([Wrap::Repeat; 2], |s| [wrap(s.wrap_s), wrap(s.wrap_t)]),
        }))
    }
}

/// Triangles of a list, a strip or a fan; none of points and lines.
fn triangles(
    mode: u32,
    indices: Option<&Values<'_>>,
    vertices: usize,
    path: &Path,
) -> Result<Vec<[u32; 3]>> {
    let count = indices.map_or(vertices, |values| values.count);
    let vertex = |i: usize| -> Result<u32> {
        let index = indices.map_or(i as u64, |values| u64::from(values.index(i)));
        if index >= vertices as u64 {
            let cause = format!("index {index} names a vertex of {vertices}");
            return Err(FormatError::invalid(path, "meshes", cause));
        }
        Ok(index as u32)
    };
    let corners: Box<dyn Iterator<Item = [usize; 3]>> = match mode {
        4 => Box::new((0..count / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2])),
        5 => Box::new((2..count).map(|t| [t - 2, t - 1 + t % 2, t - t % 2])),
        6 => Box::new((2..count).map(|t| [0, t - 1, t])),
        _ => Box::new(std::iter::empty()),
    };
    corners.map(|[a, b, c]| Ok([vertex(a)?, vertex(b)?, vertex(c)?])).collect()
}
