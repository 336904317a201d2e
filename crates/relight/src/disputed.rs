//! Triangles of the surface that the photos speak against.
//!
//! Confidence is low for two reasons: few photos saw a place, or many did and the model shows something else there. A side that no photo
//! saw is most likely where it should be, since something must close the shape. What photos saw and deny is not, and
//! its shadow is as ragged as it is itself.

use std::num::NonZero;

use motes_math::knn::of_nearest;
use motes_math::sigmoid::sigmoid;
use motes_scene::{Gaussians, Surface, photos_share};
use motes_shading::tracing::{BuildQuality, MeshTracer, TriangleMesh};
use rayon::prelude::*;

/// Gaussians that speak for a vertex.
const NEIGHBORS: NonZero<usize> = NonZero::new(8).unwrap();
/// Photos that must have seen a Gaussian to speak against it.
const PHOTOS: u16 = 3;
/// What the photos that saw a place confirm of it, as a mean, below which they speak against it.
const DENIED: f32 = 0.02;

/// The rest of `mesh`, the triangles of `surface`; none where nothing is disputed.
pub(crate) fn without_disputed(
    mesh: &TriangleMesh,
    gaussians: &Gaussians,
    confidence: &[f32],
    observations: &[u16],
    surface: &Surface,
) -> Option<MeshTracer> {
    let disputed = disputed_triangles(gaussians, confidence, observations, surface);
    let rest = |t: u32| !disputed[t as usize];
    let some = disputed.contains(&true);
    some.then(|| MeshTracer::of_some(mesh, BuildQuality::Fast, rest).ok()).flatten()
}

/// Whether the photos speak against each triangle, from the confidence of the Gaussians around it and from how many photos saw those.
fn disputed_triangles(
    gaussians: &Gaussians,
    confidence: &[f32],
    observations: &[u16],
    surface: &Surface,
) -> Vec<bool> {
    let confirmed = |i: usize| match observations[i] {
        n if n < PHOTOS => 1.0,
        n => confidence[i] / photos_share(u32::from(n)),
    };
    let around = |_, found: &[(u32, f32)]| {
        let (mut sum, mut weights) = (0.0, 0.0);
        for &(i, _) in found {
            let weight = sigmoid(gaussians.opacity_logits[i as usize]);
            sum += weight * confirmed(i as usize);
            weights += weight;
        }
        if weights > 0.0 { sum / weights } else { 1.0 }
    };
    let vertices = of_nearest(&surface.vertices, &gaussians.means, NEIGHBORS, around);
    let at = |v: u32| vertices[v as usize].unwrap_or(1.0);
    // A lamp outshines what a photo can hold, which says nothing about where it is.
    let shines = |t: &[u32; 3]| t.iter().all(|&v| surface.emission(v as usize).is_some());
    let is_denied =
        |t: &[u32; 3]| t.iter().map(|&v| at(v)).sum::<f32>() < 3.0 * DENIED && !shines(t);
    surface.triangles.par_iter().map(is_denied).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs of triangles a unit apart, a Gaussian on each vertex.
    fn pairs(count: u32) -> (Gaussians, Surface) {
        let corner = |i: u32| [(i / 4) as f32, (i % 2) as f32 * 0.1, (i / 2 % 2) as f32 * 0.1];
        let vertices: Vec<[f32; 3]> = (0..4 * count).map(corner).collect();
        let pair = |i: u32| [[4 * i, 4 * i + 1, 4 * i + 2], [4 * i + 1, 4 * i + 3, 4 * i + 2]];
        let surface = Surface {
            normals: vec![[1.0, 0.0, 0.0]; vertices.len()],
            triangles: (0..count).flat_map(pair).collect(),
            vertices: vertices.clone(),
            ..Surface::default()
        };
        let opacity_logits = vec![2.0; vertices.len()];
        (Gaussians { means: vertices, opacity_logits, ..Gaussians::empty(0) }, surface)
    }

    #[test]
    fn what_many_photos_saw_and_none_confirms_is_disputed_and_what_few_saw_is_not() {
        let (gaussians, surface) = pairs(60);
        // In turn: confirmed, denied, hardly seen; twenty pairs of each, so that neighbors agree.
        let of = |i: usize| [(0.9, 20), (0.001, 20), (0.0, 1)][i / 80];
        let (confidence, observations): (Vec<f32>, Vec<u16>) = (0..240).map(of).unzip();
        let disputed = disputed_triangles(&gaussians, &confidence, &observations, &surface);
        for (t, disputed) in disputed.iter().enumerate() {
            // Two pairs at either end hear the other kind.
            if (4..36).contains(&(t % 40)) {
                assert_eq!(*disputed, t / 40 == 1, "triangle {t}");
            }
        }
    }

    #[test]
    fn nothing_is_disputed_where_nothing_is_known() {
        let (mut gaussians, mut surface) = pairs(2);
        surface.vertices[0] = [f32::NAN; 3];
        let seen = disputed_triangles(&gaussians, &[0.0; 8], &[9; 8], &surface);
        assert_eq!(seen, [false, true, true, true]);
        surface.emission_linear = vec![[9.0; 3]; 4];
        let lamp = disputed_triangles(&gaussians, &[0.0; 8], &[9; 8], &surface);
        assert_eq!(lamp, [false, false, true, true]);
        gaussians.opacity_logits.fill(f32::NEG_INFINITY);
        assert_eq!(disputed_triangles(&gaussians, &[0.0; 8], &[9; 8], &surface), [false; 4]);
        let none = Gaussians::empty(0);
        assert_eq!(disputed_triangles(&none, &[], &[], &surface), [false; 4]);
    }
}
