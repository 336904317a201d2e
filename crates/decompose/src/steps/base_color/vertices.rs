//! Base color of the vertices, and the vertices nearest to the Gaussians.

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use motes_math::srgb;
use motes_scene::{Gaussians, Surface};
use rayon::prelude::*;

use super::gaussian_colors::ColorTarget;
use crate::appearance::FoundMaterials;
use crate::observation::samples::fill;
use crate::observation::{SeenView, TracedSurface};

/// Mean of the photos' base colors at every vertex, linear.
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
                let weight = target.weight[i].to_f32() * seen.weight;
                sum += target.color.at(i).map(srgb::decode) * weight;
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

/// Nearest vertex of every Gaussian; none for one whose mean is not finite, or without vertices.
pub(crate) fn nearest_vertices(surface: &Surface, gaussians: &Gaussians) -> Vec<Option<usize>> {
    let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&surface.vertices).ok();
    let nearest = |mean: &[f32; 3]| {
        let finite = mean.iter().all(|v| v.is_finite());
        let tree = tree.as_ref().filter(|_| finite)?;
        Some(tree.query(mean).nearest_one::<SquaredEuclidean<f32>>().execute().item as usize)
    };
    gaussians.means.par_iter().map(nearest).collect()
}
