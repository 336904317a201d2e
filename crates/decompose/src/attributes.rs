//! What vertices and Gaussians take over from points and photos.

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use motes_math::srgb;
use motes_scene::{Gaussians, Surface};
use motes_shading::frame::Frame;
use motes_shading::sampling::{PointSet, unit_f32};
use motes_shading::tracing::{Ray, Tracer, offset_origin};
use rayon::prelude::*;

use crate::TracedSurface;
use crate::materials::find::{FoundMaterials, PartMaterial};
use crate::materials::profile::Kind;
use crate::pixels::VertexMaterials;
use crate::samples::{Sample, SeenView, fill};
use crate::splat_colors::ColorTarget;

/// Material of every vertex: that of the nearest sample.
pub(crate) fn vertex_materials(
    scene: &TracedSurface,
    samples: &[Sample],
    found: &FoundMaterials,
) -> VertexMaterials {
    // Points of planes and of things that stand on them are looked up apart, so that no table runs up a vase.
    let flat: Vec<bool> = samples.iter().map(|s| s.sheet != 0).collect();
    let positions = |want: bool| -> (Vec<[f32; 3]>, Vec<u32>) {
        (0..samples.len())
            .filter(|&p| flat[p] == want)
            .map(|p| (samples[p].position.to_array(), found.of_sample[p]))
            .unzip()
    };
    let trees = [false, true].map(|want| {
        let (positions, parts) = positions(want);
        (ImmutableKdTree::<f32, 3>::new_from_slice(&positions).ok(), parts)
    });
    let mut of_piece = vec![false; scene.surface.vertices.len()];
    for (t, sheet) in scene.surface.triangles.iter().zip(&scene.sheets) {
        t.iter().for_each(|&v| of_piece[v as usize] = *sheet != 0);
    }
    let part_of: Vec<u32> = (0..scene.surface.vertices.len())
        .into_par_iter()
        .map(|v| {
            let own = usize::from(of_piece[v]);
            [own, 1 - own]
                .into_iter()
                .find_map(|k| {
                    let (tree, parts) = &trees[k];
                    let found = tree
                        .as_ref()?
                        .query(&scene.surface.vertices[v])
                        .nearest_one::<SquaredEuclidean<f32>>()
                        .execute();
                    parts.get(found.item as usize)
                })
                .copied()
                .unwrap_or(0)
        })
        .collect();
    let parts: Vec<PartMaterial> = part_of.iter().map(|&p| found.parts[p as usize]).collect();
    VertexMaterials {
        roughness: parts.iter().map(|p| p.roughness).collect(),
        metallic: parts.iter().map(|p| f32::from(u8::from(p.kind == Kind::Metal))).collect(),
        part_color_linear: parts
            .iter()
            .map(|p| p.metal_color_linear.unwrap_or(Vec3::ZERO))
            .collect(),
        is_uniform: parts
            .iter()
            .map(|p| f32::from(u8::from(p.metal_color_linear.is_some())))
            .collect(),
        specular: parts.iter().map(|p| f32::from(u8::from(p.kind != Kind::Matte))).collect(),
        part: part_of,
    }
}

/// Mean of the photos' base colours at every vertex, linear.
pub(crate) fn vertex_base_color(
    scene: &TracedSurface,
    views: &[SeenView<'_>],
    targets: &[ColorTarget],
    found: &FoundMaterials,
) -> Vec<Vec3> {
    let surface = &scene.surface;
    let mut out: Vec<Option<Vec3>> = (0..surface.vertices.len())
        .into_par_iter()
        .map(|v| {
            let (p, n) = (Vec3::from(surface.vertices[v]), Vec3::from(surface.normals[v]));
            let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
            for (k, (view, target)) in views.iter().zip(targets).enumerate() {
                let Some(seen) = view.observe(k, p, n) else { continue };
                let Some(i) = view.pixel_at(p) else { continue };
                let weight = target.weight.data[i] * seen.weight;
                let color = Vec3::from_slice(&target.color.data[3 * i..3 * i + 3]);
                sum += color.map(srgb::decode) * weight;
                weights += weight;
            }
            (weights > 0.0).then(|| sum / weights)
        })
        .collect();
    fill(&surface.triangles, &mut out);
    let all = &found.base_color_linear;
    let mean = all.iter().sum::<Vec3>() / all.len().max(1) as f32;
    out.into_iter().map(|c| c.unwrap_or(mean)).collect()
}

pub(crate) fn nearest_vertices(surface: &Surface, gaussians: &Gaussians) -> Vec<Option<usize>> {
    let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&surface.vertices).ok();
    let nearest = |mean: &[f32; 3]| {
        let finite = mean.iter().all(|v| v.is_finite());
        let tree = tree.as_ref().filter(|_| finite)?;
        Some(tree.query(mean).nearest_one::<SquaredEuclidean<f32>>().execute().item as usize)
    };
    gaussians.means.par_iter().map(nearest).collect()
}

pub(crate) fn per_gaussian<T: Copy>(
    nearest: &[Option<usize>],
    of: impl Fn(usize) -> T,
    otherwise: T,
) -> Vec<T> {
    nearest.iter().map(|v| v.map_or(otherwise, &of)).collect()
}

/// Cosine-weighted share of the hemisphere over every vertex that is open.
pub(crate) fn vertex_visibility(scene: &TracedSurface, bias: f32, seed: u64) -> Vec<f32> {
    const RAYS: u32 = 32;
    const PURPOSE: u32 = 43;
    let surface = &scene.surface;
    (0..surface.vertices.len())
        .into_par_iter()
        .map(|v| {
            let n = Vec3::from(surface.normals[v]);
            let (frame, points) =
                (Frame::from_normal(n), PointSet::new(seed, v as u64, PURPOSE, RAYS));
            let open = (0..RAYS).filter(|&k| {
                let u = points.point(k).map(unit_f32);
                let (r, phi) = (u[1].sqrt(), std::f32::consts::TAU * u[2]);
                let w = frame.world_from_local(Vec3::new(
                    r * phi.cos(),
                    r * phi.sin(),
                    (1.0 - u[1]).sqrt(),
                ));
                let origin = offset_origin(Vec3::from(surface.vertices[v]), n, w, bias);
                !scene.tracer.occluded(&Ray::new(origin, w))
            });
            open.count() as f32 / RAYS as f32
        })
        .collect()
}
