//! Normals that other tools predicted, brought onto the surface.

use glam::Vec3;
use motes_math::median::median;
use motes_scene::ImageF32;
use rayon::prelude::*;

use crate::observation::{Photo, SeenView, TracedSurface};

/// Predictions shorter than this predict nothing.
const LEAST_LENGTH: f32 = 0.5;
/// Cosine of the angle from the surface's own normal beyond which a prediction is of something else (60 degrees).
const SAME: f32 = 0.5;
/// Median angle between predictions of a photo and the surface, degrees, up to which they count in full and from which they do
/// not count.
const TRUSTED: [f64; 2] = [20.0, 40.0];
/// Vertices on flat pieces, whose normals are the surest, that judge a photo alone; with fewer all vertices do.
const ENOUGH_FLAT: usize = 100;

/// Normals of the vertices, turned toward what the photos' predictions say on average; none without predictions.
///
/// `priors`: per photo `[h, w, 3]`, unit vectors in world. `n <- normalize(n + weight t (m - n))`, `m` the mean of the predictions
/// in all photos that see the vertex, each weighted by the cosine of its view and the trust in its photo, `t` their mean
/// trust; so predictions that contradict each other or the surface count little. Flat pieces keep their exact normal.
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
    let predicted = |v: usize, index: usize| -> Option<(Vec3, f32)> {
        let (own, position) = (Vec3::from(surface.normals[v]), Vec3::from(surface.vertices[v]));
        let (view, prior) = (&views[index], priors[index].as_ref()?);
        let seen = view.observe(index, position, own)?;
        let (x, y, _) = view.rays.project(position)?;
        let pixel =
            prior.pixel((x as usize).min(prior.width - 1), (y as usize).min(prior.height - 1));
        let n = Vec3::from_slice(pixel);
        // NaN predicts nothing, too.
        (n.length() > LEAST_LENGTH)
            .then(|| (n.normalize_or_zero(), own.dot(seen.to_viewer).max(0.0)))
    };
    let trust: Vec<f32> = (0..priors.len())
        .into_par_iter()
        .map(|index| {
            let angle = |v: usize| {
                let (n, _) = predicted(v, index)?;
                Some((
                    of_sheet[v],
                    f64::from(n.dot(Vec3::from(surface.normals[v])).clamp(-1.0, 1.0)).acos(),
                ))
            };
            trust_of((0..surface.vertices.len()).filter_map(angle).collect())
        })
        .collect();
    let of = |v: usize| -> [f32; 3] {
        let own = Vec3::from(surface.normals[v]);
        if of_sheet[v] {
            return surface.normals[v];
        }
        let (mut sum, mut trusted, mut total) = (Vec3::ZERO, 0.0f32, 0.0f32);
        for (index, trust) in trust.iter().enumerate() {
            let Some((n, w)) = predicted(v, index) else { continue };
            if n.dot(own) > SAME {
                sum += n * (w * trust);
                trusted += w * trust;
                total += w;
            }
        }
        if !(trusted > 0.0) {
            return surface.normals[v];
        }
        let share = weight * trusted / total;
        (own + (sum / trusted - own) * share).normalize_or(own).to_array()
    };
    Some((0..surface.vertices.len()).into_par_iter().with_min_len(256).map(of).collect())
}

/// Trust in a photo's predictions, 0 to 1, from their angles with the surface, radians, each with whether the place is flat.
fn trust_of(angles: Vec<(bool, f64)>) -> f32 {
    let flat = || angles.iter().filter(|(flat, _)| *flat).map(|(_, angle)| *angle);
    let middle = match flat().count() >= ENOUGH_FLAT {
        true => median(flat()),
        false => median(angles.iter().map(|(_, angle)| *angle)),
    };
    let [full, none] = TRUSTED.map(f64::to_radians);
    middle.map_or(0.0, |angle| ((none - angle) / (none - full)).clamp(0.0, 1.0) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_photo_is_trusted_as_far_as_it_agrees_with_what_is_flat() {
        let all = |degrees: f64, flat: bool, n: usize| vec![(flat, degrees.to_radians()); n];
        assert_eq!(trust_of(Vec::new()), 0.0);
        assert_eq!(trust_of(all(8.0, false, 30)), 1.0);
        assert!((trust_of(all(30.0, false, 30)) - 0.5).abs() < 1e-6);
        assert_eq!(trust_of(all(55.0, true, 500)), 0.0);
        // Curved places, where the surface itself is in doubt, do not outvote the flat ones.
        assert_eq!(trust_of([all(5.0, true, 200), all(60.0, false, 900)].concat()), 1.0);
        assert_eq!(trust_of([all(5.0, true, 20), all(60.0, false, 900)].concat()), 0.0);
    }
}
