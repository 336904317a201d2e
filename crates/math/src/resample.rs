//! Image resampling with a filter that widens with the downscale factor.
//!
//! An output pixel at source position `c` (pixel centers at +0.5) is the weighted mean of source
//! pixels `i` with weights `f((i + 0.5 - c) / s)`, where `s >= 1` is the number of source pixels
//! per output pixel: the filter is as wide as the coarser of the two grids, so a downscale does
//! not alias and an upscale interpolates. Weights are renormalized at the border. This is the
//! convention of Pillow.

use std::sync::LazyLock;

/// Reconstruction filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// Box of one pixel: area averaging.
    Box,
    /// Triangle of two pixels: bilinear interpolation when it does not downscale.
    Triangle,
    /// Windowed sinc with three lobes (Turkowski 1990); may overshoot the range of its input.
    Lanczos3,
}

/// Samples of the Lanczos filter per unit; linear interpolation errs by less than 2e-7.
const TABLE_STEPS: usize = 4096;

static LANCZOS3: LazyLock<Vec<f32>> = LazyLock::new(|| {
    (0..=3 * TABLE_STEPS + 1).map(|i| lanczos3(i as f64 / TABLE_STEPS as f64) as f32).collect()
});

fn lanczos3(x: f64) -> f64 {
    if x >= 3.0 {
        return 0.0;
    }
    let sinc = |x: f64| {
        let a = std::f64::consts::PI * x;
        if a < 1e-9 { 1.0 } else { a.sin() / a }
    };
    sinc(x) * sinc(x / 3.0)
}

impl Filter {
    /// Half width in pixels of the coarser grid.
    pub fn radius(self) -> f64 {
        match self {
            Self::Box => 0.5,
            Self::Triangle => 1.0,
            Self::Lanczos3 => 3.0,
        }
    }

    /// Value at a distance from the center.
    fn value(self, x: f32) -> f32 {
        let x = x.abs();
        match self {
            Self::Box => f32::from(u8::from(x <= 0.5)),
            Self::Triangle => (1.0 - x).max(0.0),
            Self::Lanczos3 => {
                let position = x.min(3.0) * TABLE_STEPS as f32;
                let i = position as usize;
                let (a, b) = (LANCZOS3[i], LANCZOS3[i + 1]);
                a + (b - a) * (position - i as f32)
            }
        }
    }

    /// Weights of the source pixels around a position along one axis.
    ///
    /// `center` is in source pixels, `step` is source pixels per output pixel (less than 1 counts
    /// as 1), `length` the number of source pixels. Fills `weights`, which sum to 1, and returns
    /// the index of the first source pixel. Positions outside the image take the border pixel.
    pub fn taps(self, center: f64, step: f64, length: usize, weights: &mut Vec<f32>) -> usize {
        weights.clear();
        let step = step.max(1.0);
        let reach = self.radius() * step;
        let first = (center - reach + 0.5).floor().clamp(0.0, (length - 1) as f64) as usize;
        let end = ((center + reach + 0.5).floor().max(0.0) as usize).clamp(first + 1, length);
        let scale = (1.0 / step) as f32;
        let offset = (first as f64 + 0.5 - center) as f32;
        weights.extend((0..end - first).map(|i| self.value((i as f32 + offset) * scale)));
        let sum: f32 = weights.iter().sum();
        if sum.abs() > 1e-6 {
            weights.iter_mut().for_each(|w| *w /= sum);
        } else {
            // The position lies outside by more than the filter's width.
            weights.fill(0.0);
            let nearest = if center < 0.0 { 0 } else { weights.len() - 1 };
            weights[nearest] = 1.0;
        }
        first
    }
}

/// Resizes an interleaved image whose rows come from `load_row(y, row)`, `width * channels`
/// values each; rows are asked for once, in order. Returns `new_height * new_width * channels`
/// values.
///
/// # Panics
/// When a size is zero.
pub fn resize_rows(
    (width, height, channels): (usize, usize, usize),
    (new_width, new_height): (usize, usize),
    filter: Filter,
    mut load_row: impl FnMut(usize, &mut [f32]),
) -> Vec<f32> {
    assert!(width * height * channels * new_width * new_height > 0, "an image side is zero");
    let step_x = width as f64 / new_width as f64;
    let step_y = height as f64 / new_height as f64;
    let columns: Vec<(usize, Vec<f32>)> = (0..new_width)
        .map(|x| {
            let mut weights = Vec::new();
            let first = filter.taps((x as f64 + 0.5) * step_x, step_x, width, &mut weights);
            (first, weights)
        })
        .collect();
    let mut row = vec![0.0; width * channels];
    let mut narrow = vec![0.0f32; height * new_width * channels];
    for (y, out) in narrow.chunks_exact_mut(new_width * channels).enumerate() {
        load_row(y, &mut row);
        for (pixel, (first, weights)) in out.chunks_exact_mut(channels).zip(&columns) {
            let taps = row[first * channels..].chunks_exact(channels);
            for (tap, &weight) in taps.zip(weights) {
                for (sum, &value) in pixel.iter_mut().zip(tap) {
                    *sum += weight * value;
                }
            }
        }
    }
    let stride = new_width * channels;
    let mut out = vec![0.0f32; new_height * stride];
    let mut weights = Vec::new();
    for (y, target) in out.chunks_exact_mut(stride).enumerate() {
        let first = filter.taps((y as f64 + 0.5) * step_y, step_y, height, &mut weights);
        for (source, &weight) in narrow[first * stride..].chunks_exact(stride).zip(&weights) {
            for (sum, &value) in target.iter_mut().zip(source) {
                *sum += weight * value;
            }
        }
    }
    out
}

/// Resizes an interleaved image; see [`resize_rows`].
///
/// # Panics
/// When a size is zero or `data` is not `width * height * channels` long.
pub fn resize(
    data: &[f32],
    size: (usize, usize, usize),
    new_size: (usize, usize),
    filter: Filter,
) -> Vec<f32> {
    let (width, height, channels) = size;
    assert_eq!(data.len(), width * height * channels, "{width}x{height}x{channels} image");
    let stride = width * channels;
    resize_rows(size, new_size, filter, |y, row| {
        row.copy_from_slice(&data[y * stride..(y + 1) * stride]);
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILTERS: [Filter; 3] = [Filter::Box, Filter::Triangle, Filter::Lanczos3];

    #[test]
    fn the_same_size_changes_nothing() {
        let data: Vec<f32> = (0..7 * 5 * 2).map(|v| (v * v % 13) as f32).collect();
        for filter in FILTERS {
            let same = resize(&data, (7, 5, 2), (7, 5), filter);
            let worst = same.iter().zip(&data).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 1e-5, "{filter:?}: {worst}");
        }
    }

    #[test]
    fn a_constant_stays_constant_in_any_size() {
        for filter in FILTERS {
            for (w, h) in [(3, 4), (10, 9), (40, 1)] {
                let out = resize(&vec![0.7; 10 * 9], (10, 9, 1), (w, h), filter);
                assert_eq!(out.len(), w * h);
                assert!(out.iter().all(|v| (v - 0.7).abs() < 1e-5), "{filter:?} {w}x{h}");
            }
        }
    }

    #[test]
    fn halving_with_a_box_averages_blocks() {
        let data = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        assert_eq!(resize(&data, (4, 2, 1), (2, 1), Filter::Box), [2.5, 4.5]);
    }

    #[test]
    fn a_ramp_keeps_its_positions() {
        // Linear in the pixel center, so a symmetric filter reproduces it away from the border.
        let data: Vec<f32> = (0..60).map(|x| x as f32 + 0.5).collect();
        for filter in FILTERS {
            let out = resize(&data, (60, 1, 1), (20, 1), filter);
            for (x, value) in out.iter().enumerate().take(16).skip(4) {
                let expected = (x as f32 + 0.5) * 3.0;
                assert!((value - expected).abs() < 1e-3, "{filter:?} {x}: {value} {expected}");
            }
        }
    }

    #[test]
    fn lanczos_matches_pillow() {
        // Image.fromarray(float32 row).resize((3, 1), LANCZOS) of Pillow.
        let data = [1.0, 5.0, 2.0, 8.0, 3.0, 0.0, 7.0, 4.0];
        let out = resize(&data, (8, 1, 1), (3, 1), Filter::Lanczos3);
        for (a, b) in out.iter().zip(PILLOW) {
            assert!((a - b).abs() < 1e-4, "{out:?}");
        }
    }

    const PILLOW: [f32; 3] = [3.375_749, 4.118_966, 3.884_724];

    #[test]
    fn far_outside_takes_the_border_pixel() {
        let mut weights = Vec::new();
        assert_eq!(Filter::Triangle.taps(-40.0, 1.0, 9, &mut weights), 0);
        assert_eq!(weights, [1.0]);
        assert_eq!(Filter::Lanczos3.taps(60.0, 2.0, 9, &mut weights), 8);
        assert_eq!(weights, [1.0]);
    }
}
