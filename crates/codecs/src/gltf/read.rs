//! Reading glTF and GLB.

use std::path::Path;

use glam::{Affine3A, Mat3A, Mat4, Quat, Vec3};
use motes_math::sh_rotation::ShRotation;
use motes_scene::Gaussians;

use super::super::axes::Flip;
use super::super::merge::merge_gaussians;
use super::super::quantize::{dc_of_color, unit};
use super::super::rows::with_room;
use super::accessor::Values;
use super::document::{Gltf, Primitive};
use super::opened::{Opened, placed_meshes};
use super::{EXTENSION, MAX_DEGREE, columns, harmonic_names};
use motes_formats::budget;
use motes_formats::error::{FormatError, Result};
use motes_formats::ply::{GaussianFile, RenderMode, SH_C0};

/// Scales of a transform may differ by this share before it counts as a distortion.
const UNIFORM_TOLERANCE: f32 = 1e-4;

pub(in super::super) fn read(data: &[u8], path: &Path) -> Result<GaussianFile> {
    let Opened { gltf, buffers, packed } = Opened::new(data, path, &[EXTENSION])?;
    let (mut sets, mut unpacked) = (Vec::new(), 0u64);
    let mut render_mode = None;
    for (mesh, world) in placed_meshes(&gltf, path)? {
        for primitive in &gltf.meshes[mesh].primitives {
            let Some(extension) = primitive.extensions.get(EXTENSION) else { continue };
            // One mesh may stand in many places, and one accessor for many attributes.
            unpacked = unpacked.saturating_add(unpacked_bytes(&gltf, primitive, packed));
            budget::rows(path, "meshes", "the Gaussians of all nodes", unpacked, packed)?;
            let mut gaussians = read_primitive(&gltf, &buffers, primitive, path)?;
            if extension["colorSpace"] == "lin_rec709_display" {
                encode_colors(&mut gaussians);
            }
            if extension["extras"]["renderMode"] == "mip" {
                render_mode = Some(RenderMode::Mip);
            }
            place(&mut gaussians, world, path)?;
            flip(&mut gaussians);
            sets.push(gaussians);
        }
    }
    if sets.is_empty() {
        return Err(FormatError::invalid(path, "meshes", "the scene has no Gaussian splats")
            .with_remedy("this looks like a mesh, not like Gaussians"));
    }
    Ok(GaussianFile { render_mode, ..GaussianFile::new(merge_gaussians(sets), Vec::new()) })
}

/// What a primitive becomes in memory, at most: each of its attributes as floats.
pub(super) fn unpacked_bytes(gltf: &Gltf, primitive: &Primitive, packed: u64) -> u64 {
    let bytes = |index: &usize| {
        // What claims more values than there are bytes is refused by its own number when it is read.
        let accessor = gltf.accessors.get(*index).filter(|a| a.count <= packed)?;
        let width = if accessor.shape == "SCALAR" { 1 } else { 4 };
        Some(accessor.count.saturating_mul(4 * width))
    };
    primitive.attributes.values().filter_map(bytes).fold(0, u64::saturating_add)
}

fn read_primitive(
    gltf: &Gltf,
    buffers: &[Vec<u8>],
    primitive: &Primitive,
    path: &Path,
) -> Result<Gaussians> {
    let find = |name: &str, shape: &str| -> Result<Option<Values<'_>>> {
        let Some(index) = primitive.attributes.get(name) else { return Ok(None) };
        Values::find(gltf, buffers, *index, shape, path).map(Some)
    };
    let require = |name: String, shape: &str| {
        find(&name, shape)?.ok_or_else(|| {
            FormatError::invalid(path, "splat primitive", format!("attribute {name} is missing"))
        })
    };
    let own = |name: &str| format!("{EXTENSION}:{name}");
    let positions = require("POSITION".into(), "VEC3")?;
    let rotations = require(own("ROTATION"), "VEC4")?;
    let scales = require(own("SCALE"), "VEC3")?;
    let opacities = require(own("OPACITY"), "SCALAR")?;
    let degree = (1..=MAX_DEGREE)
        .take_while(|l| primitive.attributes.contains_key(&own(&format!("SH_DEGREE_{l}_COEF_0"))))
        .last()
        .unwrap_or(0);
    let harmonics: Vec<Values<'_>> =
        harmonic_names(degree).map(|name| require(name, "VEC3")).collect::<Result<_>>()?;
    let mut extra = Vec::new();
    for (name, index) in primitive.attributes.iter().filter(|(name, _)| name.starts_with('_')) {
        if gltf.accessors.get(*index).is_some_and(|accessor| accessor.shape == "SCALAR") {
            extra.push((name, *index, Values::find(gltf, buffers, *index, "SCALAR", path)?));
        }
    }
    let count = positions.count;
    let all = [&rotations, &scales, &opacities].into_iter().chain(&harmonics);
    if let Some(other) = all.chain(extra.iter().map(|(.., v)| v)).find(|v| v.count != count) {
        let cause = format!("{} positions, but {} values of another attribute", count, other.count);
        return Err(FormatError::invalid(path, "splat primitive", cause));
    }
    // Drafts of the extension stored logarithms; the ratified text has no negative scale.
    let logarithmic = (0..count).any(|i| scales.vector::<3>(i).iter().any(|s| *s < 0.0));
    let mut gaussians = with_room(count, degree);
    for i in 0..count {
        let [x, y, z, w] = rotations.vector(i);
        gaussians.means.push(positions.vector(i));
        gaussians.rotations.push([w, x, y, z]);
        let scale: [f32; 3] = scales.vector(i);
        gaussians.log_scales.push(if logarithmic { scale } else { scale.map(f32::ln) });
        let opacity = opacities.get(i, 0);
        gaussians.opacity_logits.push((opacity / (1.0 - opacity)).ln());
        harmonics.iter().for_each(|values| gaussians.sh.extend(values.vector::<3>(i)));
    }
    gaussians.extra = extra
        .into_iter()
        .map(|(name, index, values)| {
            let extras = gltf.accessors[index].extras.as_ref();
            columns::column(name, extras, (0..count).map(|i| values.get(i, 0)).collect())
        })
        .collect();
    Ok(gaussians)
}

/// Linear colors as sRGB-encoded ones: exact for the color of degree 0, to first order around it for the others.
fn encode_colors(gaussians: &mut Gaussians) {
    let stride = 3 * gaussians.sh_coefficients();
    for sh in gaussians.sh.chunks_exact_mut(stride) {
        for channel in 0..3 {
            let linear = (0.5 + SH_C0 * sh[channel]).max(0.0);
            let encode = motes_math::srgb::encode;
            let step = 1e-3;
            let slope = (encode(linear + step) - encode((linear - step).max(0.0)))
                / (linear + step - (linear - step).max(0.0));
            sh[channel] = dc_of_color(encode(linear));
            sh.iter_mut().skip(channel + 3).step_by(3).for_each(|v| *v *= slope);
        }
    }
}

/// Moves Gaussians by the transform of their node.
fn place(gaussians: &mut Gaussians, world: Mat4, path: &Path) -> Result<()> {
    if world == Mat4::IDENTITY {
        return Ok(());
    }
    let world = Affine3A::from_mat4(world);
    let lengths =
        [world.matrix3.x_axis, world.matrix3.y_axis, world.matrix3.z_axis].map(|a| a.length());
    let scale = lengths[0];
    let rotation = world.matrix3 * Mat3A::from_diagonal(Vec3::splat(scale.recip()));
    let drift = (rotation * rotation.transpose() - Mat3A::IDENTITY).to_cols_array();
    let similar = scale > 0.0
        && drift.iter().all(|v| v.abs() < UNIFORM_TOLERANCE)
        && rotation.determinant() > 0.0;
    if !similar {
        let cause = "the node of the splats is sheared, mirrored or scaled unevenly";
        return Err(FormatError::not_supported(path, "nodes", cause));
    }
    let turn = Quat::from_mat3a(&rotation);
    let rows = rotation.transpose().to_cols_array_2d().map(|row| row.map(f64::from));
    let harmonics = ShRotation::new(rows);
    let stride = 3 * gaussians.sh_coefficients();
    for (i, sh) in gaussians.sh.chunks_exact_mut(stride).enumerate() {
        harmonics.apply(sh);
        let mean = &mut gaussians.means[i];
        *mean = world.transform_point3(Vec3::from_array(*mean)).to_array();
        let [w, x, y, z] = unit(gaussians.rotations[i]);
        let turned = turn * Quat::from_xyzw(x, y, z, w);
        gaussians.rotations[i] = [turned.w, turned.x, turned.y, turned.z];
        gaussians.log_scales[i] = gaussians.log_scales[i].map(|s| s + scale.ln());
    }
    Ok(())
}

/// To the axes of a PLY.
fn flip(gaussians: &mut Gaussians) {
    let flip = Flip::ABOUT_Z;
    gaussians.means.iter_mut().for_each(|mean| *mean = flip.point(*mean));
    gaussians.rotations.iter_mut().for_each(|rotation| *rotation = flip.rotation(*rotation));
    let stride = 3 * gaussians.sh_coefficients();
    for sh in gaussians.sh.chunks_exact_mut(stride) {
        for (k, rgb) in sh.chunks_exact_mut(3).enumerate() {
            rgb.iter_mut().for_each(|v| *v *= flip.sh_sign(k));
        }
    }
}
