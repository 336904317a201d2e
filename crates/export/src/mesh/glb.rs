//! A mesh as binary glTF 2.0: one file with textures in it.

use std::io::{self, Write};

use motes_formats::images::encode_png;
use motes_scene::ImageU8;
use serde_json::{Value, json};

use super::target::GltfFrame;
use super::{Look, MeshPart, PbrMesh, Textures};

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Bytes and what refers to them.
#[derive(Default)]
pub(crate) struct GlbBuilder {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl GlbBuilder {
    /// Adds bytes at a multiple of 4; the index of their view.
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view =
            json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    /// Adds vectors of floats; `with_bounds` as positions need them.
    pub(crate) fn floats<const N: usize>(
        &mut self,
        values: &[[f32; N]],
        with_bounds: bool,
    ) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let mut accessor = json!({
            "bufferView": view, "componentType": FLOAT, "count": values.len(), "type": kind,
        });
        if with_bounds {
            let bound = |start: f32, pick: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..N).map(|k| values.iter().map(|v| v[k]).fold(start, pick)).collect()
            };
            accessor["min"] = json!(bound(f32::INFINITY, f32::min));
            accessor["max"] = json!(bound(f32::NEG_INFINITY, f32::max));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds corners of triangles.
    pub(crate) fn triangles(&mut self, triangles: &[[u32; 3]]) -> usize {
        let bytes: Vec<u8> = triangles.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        self.accessors.push(json!({
            "bufferView": view, "componentType": UNSIGNED_INT, "count": 3 * triangles.len(),
            "type": "SCALAR",
        }));
        self.accessors.len() - 1
    }

    /// Adds a picture as PNG; its entry of `images`.
    pub(crate) fn image(&mut self, name: &str, image: &ImageU8) -> Value {
        let view = self.view(&encode_png(image), None);
        json!({ "name": name, "bufferView": view, "mimeType": "image/png" })
    }

    /// Writes the file around `document`, which has everything but the buffers.
    pub(crate) fn finish(self, mut document: Value, writer: &mut dyn Write) -> io::Result<()> {
        document["asset"]["version"] = json!("2.0");
        document["asset"]["generator"] = json!(concat!("motes ", env!("CARGO_PKG_VERSION")));
        document["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        document["bufferViews"] = Value::Array(self.views);
        document["accessors"] = Value::Array(self.accessors);
        let mut text = serde_json::to_vec(&document)?;
        text.resize(text.len().next_multiple_of(4), b' ');
        let padded = self.bytes.len().next_multiple_of(4);
        let total = u32::try_from(12 + 8 + text.len() + 8 + padded)
            .map_err(|_| io::Error::other("a .glb file cannot be larger than 4 GiB"))?;
        for word in [0x4654_6c67, 2, total, text.len() as u32, 0x4e4f_534a] {
            writer.write_all(&word.to_le_bytes())?;
        }
        writer.write_all(&text)?;
        for word in [padded as u32, 0x004e_4942] {
            writer.write_all(&word.to_le_bytes())?;
        }
        writer.write_all(&self.bytes)?;
        writer.write_all(&[0; 3][..padded - self.bytes.len()])
    }
}

/// Writes a mesh in the axes and units of `frame`.
///
/// # Errors
/// What the writer refuses, and a file above 4 GiB.
pub fn write_glb(mesh: &PbrMesh, frame: &GltfFrame, writer: &mut dyn Write) -> io::Result<()> {
    let mut builder = GlbBuilder::default();
    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|p| frame.point(*p)).collect();
    let unit =
        |v: [f32; 3]| glam::Vec3::from(frame.direction(v)).normalize_or(glam::Vec3::Y).to_array();
    let normals: Vec<[f32; 3]> = mesh.normals.iter().map(|n| unit(*n)).collect();
    let mut attributes = json!({
        "POSITION": builder.floats(&positions, true),
        "NORMAL": builder.floats(&normals, false),
    });
    let mut document = json!({
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{
            "mesh": 0, "name": "surface",
            "extras": { "gltf_from_world": frame.matrix_rows(), "metres_per_world_unit": frame.scale },
        }],
    });
    match &mesh.look {
        Look::Vertices { base_color_linear, roughness, metallic } => {
            let scalar = |values: &[f32]| values.iter().map(|v| [*v]).collect::<Vec<_>>();
            attributes["COLOR_0"] = json!(builder.floats(base_color_linear, false));
            attributes["_ROUGHNESS"] = json!(builder.floats(&scalar(roughness), false));
            attributes["_METALLIC"] = json!(builder.floats(&scalar(metallic), false));
        }
        Look::Textures(textures) => {
            let tangents: Vec<[f32; 4]> = textures
                .tangents
                .iter()
                .map(|[x, y, z, w]| {
                    let [x, y, z] = unit([*x, *y, *z]);
                    [x, y, z, *w]
                })
                .collect();
            attributes["TANGENT"] = json!(builder.floats(&tangents, false));
            attributes["TEXCOORD_0"] = json!(builder.floats(&textures.uvs, false));
            add_textures(&mut builder, textures, &mut document);
        }
    }
    let primitives: Vec<Value> = mesh
        .parts
        .iter()
        .enumerate()
        .map(|(i, part)| {
            json!({
                "attributes": attributes, "indices": builder.triangles(&part.triangles),
                "material": i, "mode": 4,
            })
        })
        .collect();
    let materials: Vec<Value> = mesh.parts.iter().map(|part| material(mesh, part)).collect();
    document["meshes"] = json!([{ "name": "surface", "primitives": primitives }]);
    document["materials"] = json!(materials);
    if mesh.is_lambert {
        document["extensionsUsed"] = json!(["KHR_materials_specular"]);
    }
    builder.finish(document, writer)
}

fn add_textures(builder: &mut GlbBuilder, textures: &Textures, document: &mut Value) {
    document["images"] = json!([
        builder.image("base_color", &textures.base_color),
        builder.image("occlusion_roughness_metallic", &textures.orm),
        builder.image("normal", &textures.normal),
    ]);
    // Linear with mip maps; clamped, for an atlas has no neighbors beyond its edge.
    document["samplers"] =
        json!([{ "magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071 }]);
    document["textures"] = json!([
        { "sampler": 0, "source": 0 }, { "sampler": 0, "source": 1 }, { "sampler": 0, "source": 2 },
    ]);
}

fn material(mesh: &PbrMesh, part: &MeshPart) -> Value {
    let mut pbr = json!({
        "baseColorFactor": [1.0, 1.0, 1.0, 1.0],
        "roughnessFactor": part.roughness, "metallicFactor": part.metallic,
    });
    let mut material = json!({ "name": "matter", "doubleSided": true });
    if let Look::Textures(_) = &mesh.look {
        pbr["baseColorTexture"] = json!({ "index": 0 });
        pbr["metallicRoughnessTexture"] = json!({ "index": 1 });
        material["occlusionTexture"] = json!({ "index": 1 });
        material["normalTexture"] = json!({ "index": 2 });
    }
    material["pbrMetallicRoughness"] = pbr;
    if mesh.is_lambert {
        material["extensions"] = json!({ "KHR_materials_specular": { "specularFactor": 0.0 } });
    }
    material
}
