//! A glTF document with its buffers, and where its meshes stand.

use std::path::{Path, PathBuf};

use base64::Engine as _;
use glam::{Mat4, Quat, Vec3};
use motes_formats::capture::checked_relative_path;
use motes_formats::error::{FormatError, Result, quoted};

use super::document::{Gltf, Node};
use super::{glb, is_glb};

/// A document and what its buffers hold.
pub(super) struct Opened {
    pub(super) gltf: Gltf,
    pub(super) buffers: Vec<Vec<u8>>,
    /// Bytes of all files.
    pub(super) packed: u64,
}

impl Opened {
    /// Reads a document whose required extensions are all among `known`.
    pub(super) fn new(data: &[u8], path: &Path, known: &[&str]) -> Result<Self> {
        let (json, binary) = if is_glb(data) { glb::split(data, path)? } else { (data, &[][..]) };
        let gltf: Gltf = serde_json::from_slice(json).map_err(|error| {
            FormatError::invalid(path, "glTF JSON", format!("not a glTF document: {error}"))
        })?;
        let unknown = |name: &&String| !known.contains(&name.as_str());
        if let Some(name) = gltf.extensions_required.iter().find(unknown) {
            let cause = format!("the file requires the extension {}", quoted(name));
            return Err(FormatError::not_supported(path, "extensionsRequired", cause)
                .with_remedy("export it without compression"));
        }
        let buffers = buffers(&gltf, binary, path)?;
        let packed = data.len() as u64 + buffers.iter().map(|b| b.len() as u64).sum::<u64>();
        Ok(Self { gltf, buffers, packed })
    }
}

/// The bytes that a URI stands for, and the name of their file: data in the document, or a file beside it.
pub(super) fn resource(uri: &str, path: &Path, place: &str) -> Result<(Vec<u8>, PathBuf)> {
    if uri.starts_with("data:") {
        let text = uri.split_once(";base64,").map_or("", |(_, text)| text);
        let bytes = base64::engine::general_purpose::STANDARD.decode(text);
        let bytes =
            bytes.map_err(|error| FormatError::invalid(path, place, format!("base64: {error}")))?;
        return Ok((bytes, path.to_owned()));
    }
    // A scheme has two letters or more; one is a drive, which is refused below.
    let scheme = uri.split_once(':').map_or("", |(scheme, _)| scheme);
    if scheme.len() > 1 && scheme.bytes().all(|b| b.is_ascii_alphanumeric()) {
        let cause = format!("{} is elsewhere: nothing is fetched", quoted(uri));
        return Err(FormatError::not_supported(path, place, cause)
            .with_remedy("put the file beside the document, or save it as .glb"));
    }
    let name = checked_relative_path(path, place, &percent_decoded(uri))?;
    let file = path.parent().unwrap_or(Path::new("")).join(name);
    let bytes = std::fs::read(&file).map_err(|error| FormatError::io(&file, error))?;
    Ok((bytes, file))
}

/// `%20` as a space. What is no two hexadecimal digits stays.
fn percent_decoded(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let digits = after.get(..2).and_then(|d| std::str::from_utf8(d).ok());
        let byte = digits
            .filter(|d| d.bytes().all(|b| b.is_ascii_hexdigit()))
            .and_then(|digits| u8::from_str_radix(digits, 16).ok())
            .filter(|_| first == b'%');
        bytes.push(byte.unwrap_or(first));
        rest = if byte.is_some() { &after[2..] } else { after };
    }
    String::from_utf8(bytes).unwrap_or_else(|_| uri.to_owned())
}

fn buffers(gltf: &Gltf, binary: &[u8], path: &Path) -> Result<Vec<Vec<u8>>> {
    let read = |(i, buffer): (usize, &super::document::Buffer)| -> Result<Vec<u8>> {
        let place = format!("buffers[{i}]");
        let bytes = match &buffer.uri {
            None if i == 0 => binary.to_vec(),
            None => return Err(FormatError::invalid(path, place, "the buffer has no data")),
            Some(uri) => resource(uri, path, &place)?.0,
        };
        if (bytes.len() as u64) < buffer.byte_length {
            let cause = format!("{} bytes instead of {}", bytes.len(), buffer.byte_length);
            return Err(FormatError::invalid(path, place, cause));
        }
        Ok(bytes)
    };
    gltf.buffers.iter().enumerate().map(read).collect()
}

/// Meshes of the scene and where they stand; all meshes when there is no scene.
pub(super) fn placed_meshes(gltf: &Gltf, path: &Path) -> Result<Vec<(usize, Mat4)>> {
    let scene = gltf.scenes.get(gltf.scene.unwrap_or(0));
    let Some(scene) = scene else {
        return Ok((0..gltf.meshes.len()).map(|mesh| (mesh, Mat4::IDENTITY)).collect());
    };
    let mut found = Vec::new();
    let mut visited = vec![false; gltf.nodes.len()];
    let mut open: Vec<(usize, Mat4)> =
        scene.nodes.iter().rev().map(|node| (*node, Mat4::IDENTITY)).collect();
    while let Some((index, parent)) = open.pop() {
        let place = format!("nodes[{index}]");
        let Some(node) = gltf.nodes.get(index) else {
            return Err(FormatError::invalid(path, place, "the node does not exist"));
        };
        if std::mem::replace(&mut visited[index], true) {
            let cause =
                "two nodes have this child, or it is named twice: the nodes do not form a tree";
            return Err(FormatError::invalid(path, place, cause));
        }
        let world = parent * local(node);
        if let Some(mesh) = node.mesh {
            if mesh >= gltf.meshes.len() {
                return Err(FormatError::invalid(path, place, format!("there is no mesh {mesh}")));
            }
            found.push((mesh, world));
        }
        open.extend(node.children.iter().rev().map(|child| (*child, world)));
    }
    Ok(found)
}

fn local(node: &Node) -> Mat4 {
    match &node.matrix {
        Some(matrix) => Mat4::from_cols_array(matrix),
        None => Mat4::from_scale_rotation_translation(
            node.scale.map_or(Vec3::ONE, Vec3::from_array),
            node.rotation.map_or(Quat::IDENTITY, Quat::from_array),
            node.translation.map_or(Vec3::ZERO, Vec3::from_array),
        ),
    }
}
