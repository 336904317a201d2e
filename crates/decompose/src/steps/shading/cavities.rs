//! Metals that are darker than what they mirror.
//!
//! A gap round a lid, a seam, a scratch or paint on a metal is dark from everywhere. No normal explains that, the mesh does not have
//! gaps finer than a few pixels, and a part of metal has one base color. So a metal is darkened where nearly all photos show less than
//! the part would send: by the upper quartile over the photos of (seen / expected). Where a normal is wrong, some photos show more.

use glam::Vec3;
use rayon::prelude::*;

use crate::appearance::{PixelShading, VertexMaterials};
use crate::observation::samples::luminance;
use crate::observation::{SeenView, TracedSurface};

/// Photos that have to tell.
const LEAST_PHOTOS: usize = 4;
/// Share of them that have to be darker.
const QUANTILE: f32 = 0.75;
/// Up to the first, what is darker is taken for dark; from the second on for an error of the normals.
const DARK: [f32; 2] = [0.5, 0.75];

/// Factor on the base color of every vertex, 0 to 1; 1 off metals and where photos do not say so.
pub(crate) fn darkening(
    scene: &TracedSurface,
    views: &[SeenView<'_>],
    shadings: &[PixelShading],
    materials: &VertexMaterials,
) -> Vec<f32> {
    let surface = &scene.surface;
    let of = |v: usize| {
        if !(materials.is_uniform[v] > 0.0) {
            return 1.0;
        }
        let (p, n) = (Vec3::from(surface.vertices[v]), Vec3::from(surface.normals[v]));
        let color = materials.part_color_linear[v];
        let ratio = |(k, (view, shading)): (usize, (&SeenView<'_>, &PixelShading))| {
            let seen = view.observe(k, p, n)?;
            let i = view.pixel_at(p)?;
            let expected = luminance(shading.slope(i) * color + shading.offset(i));
            let ratio = luminance(seen.radiance) / expected;
            (expected > 0.0 && ratio.is_finite()).then_some(ratio)
        };
        let ratios: Vec<f32> = views.iter().zip(shadings).enumerate().filter_map(ratio).collect();
        factor(ratios)
    };
    (0..surface.vertices.len()).into_par_iter().with_min_len(64).map(of).collect()
}

/// What (seen / expected) of all photos says.
fn factor(mut ratios: Vec<f32>) -> f32 {
    if ratios.len() < LEAST_PHOTOS {
        return 1.0;
    }
    let at = (QUANTILE * (ratios.len() - 1) as f32).round() as usize;
    let upper = ratios.select_nth_unstable_by(at, f32::total_cmp).1.max(0.0);
    let sure = ((DARK[1] - upper) / (DARK[1] - DARK[0])).clamp(0.0, 1.0);
    1.0 + (upper.min(1.0) - 1.0) * sure
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_dark_from_everywhere_is_dark_and_what_is_bright_from_somewhere_is_not() {
        assert!((factor(vec![0.1, 0.15, 0.12, 0.1, 0.2, 0.1]) - 0.15).abs() < 1e-6);
        // A highlight in one photo of six does not make a gap bright.
        assert!((factor(vec![0.1, 0.1, 0.12, 0.1, 5.0, 0.1]) - 0.12).abs() < 1e-6);
        // A wrong normal: dark in most photos, and what is missing there is seen elsewhere.
        assert!(factor(vec![0.1, 0.1, 0.2, 3.0, 5.0]) == 1.0);
        assert!(factor(vec![0.9; 8]) == 1.0 && factor(vec![0.1; 3]) == 1.0);
        let near = factor(vec![0.6; 8]);
        assert!(near > 0.6 && near < 1.0, "no step between the two: {near}");
    }
}
