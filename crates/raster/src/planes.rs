//! Planar images in whole tiles, as the tile kernels read and write them.

use motes_scene::ImageF32;

use crate::options::TILE;

/// `C` planes of `[height, width]` values, each padded to whole tiles.
///
/// Rows of one tile row are contiguous across planes: value `(c, x, y)` lies in band `y / TILE` at
/// `(c * TILE + y % TILE) * stride + x`. So a band is one mutable slice and bands can be filled in
/// parallel without sharing.
#[derive(Clone, Debug)]
pub struct Planes {
    /// Image width, pixels.
    pub width: usize,
    /// Image height, pixels.
    pub height: usize,
    /// Number of planes.
    pub channels: usize,
    /// Padded row length.
    pub stride: usize,
    /// `bands * channels * TILE * stride` values.
    pub data: Vec<f32>,
}

impl Planes {
    /// Zeros.
    pub fn new(width: usize, height: usize, channels: usize) -> Self {
        let stride = width.div_ceil(TILE) * TILE;
        let bands = height.div_ceil(TILE);
        Self { width, height, channels, stride, data: vec![0.0; bands * channels * TILE * stride] }
    }

    /// Values per band of `TILE` rows.
    pub fn band_len(&self) -> usize {
        self.channels * TILE * self.stride
    }

    /// Start of row `y` of plane `c`.
    #[inline]
    pub fn row_start(&self, c: usize, y: usize) -> usize {
        (y / TILE) * self.band_len() + (c * TILE + y % TILE) * self.stride
    }

    /// Row `y` of plane `c`, without padding.
    #[inline]
    pub fn row(&self, c: usize, y: usize) -> &[f32] {
        let start = self.row_start(c, y);
        &self.data[start..start + self.width]
    }

    /// Row `y` of plane `c`, without padding.
    #[inline]
    pub fn row_mut(&mut self, c: usize, y: usize) -> &mut [f32] {
        let start = self.row_start(c, y);
        &mut self.data[start..start + self.width]
    }

    /// Copies `count` planes from `first` on into an interleaved image.
    pub fn to_image(&self, first: usize, count: usize) -> ImageF32 {
        let mut image = ImageF32::filled(self.width, self.height, count, 0.0);
        for y in 0..self.height {
            for c in 0..count {
                let row = self.row(first + c, y);
                let out = &mut image.data[y * self.width * count..(y + 1) * self.width * count];
                for (pixel, value) in out.chunks_exact_mut(count).zip(row) {
                    pixel[c] = *value;
                }
            }
        }
        image
    }

    /// Fills plane `to` from channel `from` of an interleaved image of the same size.
    pub fn set_plane(&mut self, to: usize, image: &ImageF32, from: usize) {
        assert_eq!((self.width, self.height), (image.width, image.height), "plane size");
        for y in 0..self.height {
            let start = y * image.width * image.channels;
            let source = image.data[start..].chunks_exact(image.channels);
            for (value, pixel) in self.row_mut(to, y).iter_mut().zip(source) {
                *value = pixel[from];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_survive_the_layout() {
        let image = ImageF32::from_data(19, 35, 2, (0..19 * 35 * 2).map(|v| v as f32).collect());
        let mut planes = Planes::new(19, 35, 3);
        planes.set_plane(1, &image, 0);
        planes.set_plane(2, &image, 1);
        assert_eq!(planes.to_image(1, 2), image);
        assert!(planes.to_image(0, 1).data.iter().all(|&v| v == 0.0));
    }
}
