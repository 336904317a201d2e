//! Normals that other tools predicted, brought onto the surface.

use glam::Vec3;
use motes_scene::ImageF32;
use rayon::prelude::*;

use crate::observation::{Photo, SeenView, TracedSurface};

/// Predictions shorter than this predict nothing.
const LEAST_LENGTH: f32 = 0.5;
/// Cosine of the angle from the surface's own normal beyond which a prediction is of something else (60 degrees).
const SAME: f32 = 0.5;

/// Normals of the vertices, turned toward what the photos' predictions say on average; none without predictions.
///
/// `priors`: per photo `[h, w, 3]`, unit vectors in world. `n <- normalize(n + weight (m - n))`, `m` the mean of the predictions
/// in all photos that see the vertex, each weighted by the cosine of its view; so predictions that contradict each
/// other count little. Flat pieces keep their exact normal.
pub(super) fn normals(
    scene: &TracedSurface,
    photos: &[Photo],
    priors: &[Option<ImageF32>],
    weight: f32,
) -> Option<Vec<[f32; 3]>> {
    let weight = weight.clamp(0.0, 1.0);
    if !(weight > 0.0) || priors.iter().all(Option::is_none) {
        return None;
    }
    let views: Vec<SeenView<'_>> = photos.iter().map(|p| SeenView::new(p, scene)).collect();
    let surface = &scene.surface;
    let mut of_sheet = vec![false; surface.vertices.len()];
    for (t, sheet) in surface.triangles.iter().zip(&scene.sheets) {
        t.iter().for_each(|&v| of_sheet[v as usize] |= *sheet != 0);
    }
    let of = |v: usize| -> [f32; 3] {
        let (own, position) = (Vec3::from(surface.normals[v]), Vec3::from(surface.vertices[v]));
        if of_sheet[v] {
            return surface.normals[v];
        }
        let (mut sum, mut total) = (Vec3::ZERO, 0.0f32);
        for (index, (view, prior)) in views.iter().zip(priors).enumerate() {
            let Some(prior) = prior else { continue };
            let Some(seen) = view.observe(index, position, own) else { continue };
            let Some((x, y, _)) = view.rays.project(position) else { continue };
            let pixel =
                prior.pixel((x as usize).min(prior.width - 1), (y as usize).min(prior.height - 1));
            let n = Vec3::from_slice(pixel);
            if !(n.length() > LEAST_LENGTH) {
                continue;
            }
            let n = n.normalize_or_zero();
            if n.dot(own) > SAME {
                let w = own.dot(seen.to_viewer).max(0.0);
                sum += n * w;
                total += w;
            }
        }
        if !(total > 0.0) {
            return surface.normals[v];
        }
        (own + (sum / total - own) * weight).normalize_or(own).to_array()
    };
    Some((0..surface.vertices.len()).into_par_iter().with_min_len(256).map(of).collect())
}
