//! Logits of the model's grid to masks of the picture.

use motes_math::resample::Filter;

use crate::Frame;

/// The logit that a padded part is given where a stage says nothing about it: surely not the object.
const OUTSIDE: f32 = -10.0;
/// How far the threshold is moved for the stability score, as in the original code.
const STABILITY_OFFSET: f32 = 1.0;

/// Bilinear interpolation without a wider filter for smaller results, pixel centers at one half: what `interpolate` of PyTorch does
/// with `align_corners=False`. `part` is the size of the top left part of the source that the result covers.
pub(crate) fn interpolated(
    data: &[f32],
    (width, height): (usize, usize),
    part: (f64, f64),
    size: (usize, usize),
) -> Vec<f32> {
    let taps = |length: usize, part: f64, count: usize| -> Vec<(usize, Vec<f32>)> {
        let step = part / count as f64;
        let of = |i: usize| {
            let mut weights = Vec::new();
            let first = Filter::Triangle.taps((i as f64 + 0.5) * step, 1.0, length, &mut weights);
            (first, weights)
        };
        (0..count).map(of).collect()
    };
    let columns = taps(width, part.0, size.0);
    let mut out = Vec::with_capacity(size.0 * size.1);
    for (y, weights) in taps(height, part.1, size.1) {
        for (x, along) in &columns {
            let row = |k: usize| -> f32 {
                let from = (y + k) * width + x;
                data[from..].iter().zip(along).map(|(v, w)| v * w).sum()
            };
            out.push(weights.iter().enumerate().map(|(k, w)| w * row(k)).sum());
        }
    }
    out
}

impl Frame {
    /// Logits of the picture from those of a grid over the square: up to the square, the filled part of it, to the picture, as
    /// the original code does.
    pub fn to_picture(&self, logits: &[f32], grid: (usize, usize)) -> Vec<f32> {
        let whole = (grid.0 as f64, grid.1 as f64);
        if self.filled == (self.side, self.side) {
            return interpolated(logits, grid, whole, self.size);
        }
        let square = interpolated(logits, grid, whole, (self.side, self.side));
        let part = (self.filled.0 as f64, self.filled.1 as f64);
        let (w, h) = self.filled;
        let cropped: Vec<f32> =
            square.chunks_exact(self.side).take(h).flat_map(|row| &row[..w]).copied().collect();
        interpolated(&cropped, self.filled, part, self.size)
    }

    /// The part of a grid over the square that the picture fills, and its size.
    pub fn cropped(&self, logits: &[f32], grid: (usize, usize)) -> ((usize, usize), Vec<f32>) {
        let part = self.part(grid);
        let size = (part.0.round().max(1.0) as usize, part.1.round().max(1.0) as usize);
        (size, interpolated(logits, grid, part, size))
    }

    /// A grid over the square of logits that cover the picture.
    pub fn padded(&self, logits: &[f32], size: (usize, usize), grid: (usize, usize)) -> Vec<f32> {
        let part = self.part(grid);
        let count = |part: f64, most: usize| (part.round().max(1.0) as usize).min(most);
        let (w, h) = (count(part.0, grid.0), count(part.1, grid.1));
        // Each cell of the grid takes the place that it covers in the picture.
        let scale = (size.0 as f64 / part.0, size.1 as f64 / part.1);
        let covered = (w as f64 * scale.0, h as f64 * scale.1);
        let filled = interpolated(logits, size, covered, (w, h));
        let mut out = vec![OUTSIDE; grid.0 * grid.1];
        for (row, values) in out.chunks_exact_mut(grid.0).zip(filled.chunks_exact(w)) {
            row[..w].copy_from_slice(values);
        }
        out
    }

    /// Columns and rows of a grid over the square that the picture fills.
    fn part(&self, grid: (usize, usize)) -> (f64, f64) {
        let of = |grid: usize, filled: usize| grid as f64 * filled as f64 / self.side as f64;
        (of(grid.0, self.filled.0), of(grid.1, self.filled.1))
    }
}

/// Intersection over union of the masks at thresholds 1 above and 1 below: 1 for an edge that is sharp. 0 for an empty mask.
pub fn stability(logits: &[f32]) -> f64 {
    let above = |threshold: f32| logits.iter().filter(|v| **v > threshold).count() as f64;
    let union = above(-STABILITY_OFFSET);
    if union > 0.0 { above(STABILITY_OFFSET) / union } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Convention;

    #[test]
    fn interpolation_is_that_of_pytorch() {
        // torch.nn.functional.interpolate(torch.tensor([[[[0., 1.], [2., 3.]]]]), (4, 3), mode="bilinear", align_corners=False)
        let expected = [[0.0, 0.5, 1.0], [0.5, 1.0, 1.5], [1.5, 2.0, 2.5], [2.0, 2.5, 3.0]];
        let found = interpolated(&[0.0, 1.0, 2.0, 3.0], (2, 2), (2.0, 2.0), (3, 4));
        for (a, b) in found.iter().zip(expected.iter().flatten()) {
            assert!((a - b).abs() < 1e-6, "{found:?}");
        }
        // Smaller without a wider filter: the middle of four is the mean of the two inner ones.
        let found = interpolated(&[0.0, 1.0, 5.0, 100.0], (4, 1), (4.0, 1.0), (1, 1));
        assert!((found[0] - 3.0).abs() < 1e-6);
    }

    #[test]
    fn logits_survive_the_way_to_the_picture_and_back() {
        let frame = Frame::new(Convention::Meta, (64, 32), 64);
        let grid = (16, 16);
        // A half plane over the left part of the filled half.
        let logits: Vec<f32> = (0..256).map(|p| 4.0 - (p % 16) as f32).collect();
        let picture = frame.to_picture(&logits, grid);
        assert_eq!(picture.len(), 64 * 32);
        let left = |y: usize| picture[y * 64..][..64].iter().filter(|v| **v > 0.0).count();
        assert_eq!((left(0), left(31)), (18, 18));
        let (size, cropped) = frame.cropped(&logits, grid);
        assert_eq!(size, (16, 8));
        let again = frame.padded(&cropped, size, grid);
        assert_eq!(again[..128], logits[..128]);
        assert!(again[128..].iter().all(|v| *v == OUTSIDE));
    }

    #[test]
    fn a_sharp_edge_is_stable() {
        assert_eq!(stability(&[-9.0, -9.0, 9.0, 9.0]), 1.0);
        assert_eq!(stability(&[-9.0, 0.5, 0.5, 9.0]), 1.0 / 3.0);
        assert_eq!(stability(&[-9.0; 4]), 0.0);
    }
}
