//! Where a photo lies in the square that the model sees.

use motes_math::resample::{Filter, resize_rows};
use motes_scene::ImageU8;

use crate::Convention;

/// The part of the model's square that the picture fills, from the top left corner. What is right of it and below is padding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Columns and rows of the picture.
    pub size: (usize, usize),
    /// Columns and rows of the square that it fills.
    pub filled: (usize, usize),
    /// Side of the square.
    pub side: usize,
}

impl Frame {
    /// The frame of a picture. SAM 1 scales its longest side to that of the square, `floor(x s + 1/2)`; SAM 2 fills the square.
    pub fn new(convention: Convention, size: (usize, usize), side: usize) -> Self {
        if convention.stretches() {
            return Self { size, filled: (side, side), side };
        }
        let scale = side as f64 / size.0.max(size.1) as f64;
        let scaled =
            |length: usize| ((length as f64 * scale + 0.5).floor() as usize).clamp(1, side);
        Self { size, filled: (scaled(size.0), scaled(size.1)), side }
    }

    /// Where a pixel of the picture lies in the square.
    pub fn point(&self, [x, y]: [f64; 2]) -> [f32; 2] {
        let scale = |filled: usize, length: usize| filled as f64 / length as f64;
        let (sx, sy) = (scale(self.filled.0, self.size.0), scale(self.filled.1, self.size.1));
        [(x * sx) as f32, (y * sy) as f32]
    }

    /// The picture at its size in the square, 0 to 255, interleaved.
    pub fn resized(&self, picture: &ImageU8) -> Vec<f32> {
        let channels = picture.channels;
        let stride = self.size.0 * channels;
        resize_rows((self.size.0, self.size.1, 3), self.filled, Filter::Triangle, |y, row| {
            let pixels = picture.data[y * stride..][..stride].chunks_exact(channels);
            for (out, pixel) in row.chunks_exact_mut(3).zip(pixels) {
                (0..3).for_each(|k| out[k] = f32::from(pixel[k]));
            }
        })
    }

    /// The square as the model wants it, `[3, side, side]`: colors minus mean over deviation, 0 where the padding is.
    pub fn tensor(&self, convention: Convention, resized: &[f32]) -> Vec<f32> {
        let (mean, deviation) = convention.normalization();
        let plane = self.side * self.side;
        let mut out = vec![0.0; 3 * plane];
        for (y, row) in resized.chunks_exact(3 * self.filled.0).enumerate() {
            for (x, pixel) in row.chunks_exact(3).enumerate() {
                for k in 0..3 {
                    out[k * plane + y * self.side + x] = (pixel[k] - mean[k]) / deviation[k];
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_side_fills_the_square_and_the_rest_is_padding() {
        // Rounding as in the original: 1024 * 333 / 500 = 681.98.
        let frame = Frame::new(Convention::Meta, (500, 333), 1024);
        assert_eq!(frame.filled, (1024, 682));
        assert_eq!(frame.point([250.0, 333.0]), [512.0, 682.0]);
        assert_eq!(Frame::new(Convention::Meta, (333, 500), 1024).filled, (682, 1024));
        assert_eq!(Frame::new(Convention::Sam2, (500, 333), 1024).filled, (1024, 1024));
        assert_eq!(Frame::new(Convention::Meta, (30_000, 1), 1024).filled, (1024, 1));
        assert_eq!(Frame::new(Convention::Meta, (1, 1), 1024).filled, (1024, 1024));
    }

    #[test]
    fn colors_are_normalized_and_padding_is_zero() {
        let picture = ImageU8::from_data(2, 1, 4, vec![255, 0, 128, 9, 255, 0, 128, 9]);
        let frame = Frame::new(Convention::Meta, (2, 1), 4);
        let resized = frame.resized(&picture);
        assert_eq!((frame.filled, resized.len()), ((4, 2), 24));
        let tensor = frame.tensor(Convention::Meta, &resized);
        let red = (255.0 - 123.675) / 58.395;
        assert!((tensor[0] - red).abs() < 1e-5 && (tensor[7] - red).abs() < 1e-5);
        assert_eq!(tensor[8..16], [0.0; 8]);
        let blue = (128.0 - 103.53) / 57.375;
        assert!((tensor[32] - blue).abs() < 1e-5);
    }
}
