//! Where a set of Gaussians is and how large it looks.

use glam::DVec3;
use motes_math::sh::SH_C0;
use motes_math::sigmoid::sigmoid;
use motes_math::srgb;
use motes_scene::Gaussians;

/// Share of the opacity beyond the bounds on either side: stray Gaussians must not decide how tall a chair is.
const TAIL: f64 = 0.005;

/// Size and place of a set of Gaussians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Smallest coordinates of the centers, world.
    pub min: DVec3,
    /// Largest coordinates.
    pub max: DVec3,
    /// Mean of the centers, weighted by opacity.
    pub centroid: DVec3,
    /// Lowest height along up, but for half a percent of the opacity.
    pub bottom: f64,
    /// Highest height along up, but for half a percent.
    pub top: f64,
    /// Up, unit.
    pub up: DVec3,
}

/// What an [`Extent`] says that needs no sorting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates of the centers, world.
    pub min: DVec3,
    /// Largest coordinates.
    pub max: DVec3,
    /// Mean of the centers, weighted by opacity.
    pub centroid: DVec3,
    /// Sum of the weights.
    weights: f64,
}

impl Bounds {
    /// Of the Gaussians of `rows`; `None` when none of them has a finite center.
    pub fn of(gaussians: &Gaussians, rows: impl IntoIterator<Item = u32>) -> Option<Self> {
        Self::of_centers(rows.into_iter().filter_map(|row| center_of(gaussians, row)))
    }

    fn of_centers(centers: impl Iterator<Item = (DVec3, f64)>) -> Option<Self> {
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        for (p, weight) in centers {
            (min, max) = (min.min(p), max.max(p));
            sum += p * weight;
            weights += weight;
        }
        (weights > 0.0).then(|| Self { min, max, centroid: sum / weights, weights })
    }
}

/// A finite center and its weight.
pub(super) fn center_of(gaussians: &Gaussians, row: u32) -> Option<(DVec3, f64)> {
    let row = row as usize;
    let p = DVec3::from_array(gaussians.means[row].map(f64::from));
    if !p.is_finite() {
        return None;
    }
    // Never 0, so that invisible Gaussians have a place, too.
    let weight = f64::from(sigmoid(gaussians.opacity_logits[row])).max(1e-6);
    (!weight.is_nan()).then_some((p, weight))
}

impl Extent {
    /// Of the Gaussians of `rows`; `None` when none of them has a finite center.
    pub fn of(gaussians: &Gaussians, rows: &[u32], up: DVec3) -> Option<Self> {
        let mut heights = Vec::with_capacity(rows.len());
        let centers = rows.iter().filter_map(|row| center_of(gaussians, *row));
        let centers = centers.inspect(|(p, weight)| heights.push((p.dot(up), *weight)));
        let Bounds { min, max, centroid, weights } = Bounds::of_centers(centers)?;
        heights.sort_by(|a, b| a.0.total_cmp(&b.0));
        let quantile = |share: f64| {
            let mut left = share * weights;
            for (height, weight) in &heights {
                left -= weight;
                if left <= 0.0 {
                    return *height;
                }
            }
            heights[heights.len() - 1].0
        };
        let (bottom, top) = (quantile(TAIL), quantile(1.0 - TAIL));
        Some(Self { min, max, centroid, bottom, top, up })
    }

    /// Below the centroid, at the bottom: where it stands.
    pub fn base(&self) -> DVec3 {
        self.centroid + self.up * (self.bottom - self.centroid.dot(self.up))
    }

    /// From bottom to top, world units.
    pub fn height(&self) -> f64 {
        self.top - self.bottom
    }

    /// The larger side of the box across up, world units.
    pub fn footprint(&self) -> f64 {
        let size = self.max - self.min;
        let level = size - self.up * size.dot(self.up);
        level.abs().max_element()
    }
}

/// Mean shown color of the Gaussians of `rows`, linear Rec. 709, weighted by opacity; `None` for none.
pub fn mean_color_linear(gaussians: &Gaussians, rows: &[u32]) -> Option<[f64; 3]> {
    let (mut sum, mut weights) = ([0.0; 3], 0.0);
    for row in rows.iter().map(|r| *r as usize) {
        let weight = f64::from(sigmoid(gaussians.opacity_logits[row]));
        let sh = gaussians.sh_of(row);
        let color: [f64; 3] = [0, 1, 2].map(|c| {
            let shown = 0.5 + f64::from(sh[c]) * SH_C0;
            f64::from(srgb::decode(shown.clamp(0.0, 1.0) as f32))
        });
        if weight > 0.0 && color.iter().all(|v| v.is_finite()) {
            (0..3).for_each(|c| sum[c] += weight * color[c]);
            weights += weight;
        }
    }
    (weights > 0.0).then(|| sum.map(|s| s / weights))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_stands_on_its_base() {
        let mut gaussians = motes_testkit::random_gaussians(1, 1000, 0);
        for (i, mean) in gaussians.means.iter_mut().enumerate() {
            *mean = [2.0, -1.0, 1.0 + i as f32 / 999.0];
            gaussians.opacity_logits[i] = 3.0;
        }
        // One stray does not make it taller.
        gaussians.means[0][2] = -50.0;
        let rows: Vec<u32> = (0..1000).collect();
        let extent = Extent::of(&gaussians, &rows, DVec3::Z).unwrap();
        assert!((extent.height() - 0.99).abs() < 0.02, "{extent:?}");
        assert!((extent.base() - DVec3::new(2.0, -1.0, 1.0)).length() < 0.02, "{extent:?}");
        assert_eq!(extent.min.z, -50.0);
        gaussians.means = vec![[f32::NAN; 3]; 1000];
        assert_eq!(Extent::of(&gaussians, &rows, DVec3::Z), None);
    }
}
