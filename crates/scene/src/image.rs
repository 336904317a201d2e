//! Interleaved raster images.

/// An interleaved image: `data[(y * width + x) * channels + c]`, row 0 at the top.
///
/// The value space (sRGB-encoded, linear, depth in world units) is said where an image is used.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Values per pixel.
    pub channels: usize,
    /// `height * width * channels` values.
    pub data: Vec<T>,
}

/// 8-bit image, normally sRGB-encoded.
pub type ImageU8 = Image<u8>;
/// Floating-point image.
pub type ImageF32 = Image<f32>;

impl<T: Copy> Image<T> {
    /// An image of one value everywhere.
    pub fn filled(width: usize, height: usize, channels: usize, value: T) -> Self {
        Self { width, height, channels, data: vec![value; width * height * channels] }
    }

    /// Wraps existing values.
    ///
    /// # Panics
    /// When the number of values is not `width * height * channels`.
    pub fn from_data(width: usize, height: usize, channels: usize, data: Vec<T>) -> Self {
        assert_eq!(data.len(), width * height * channels, "{width}x{height}x{channels} image");
        Self { width, height, channels, data }
    }

    /// The channels of one pixel.
    pub fn pixel(&self, x: usize, y: usize) -> &[T] {
        let start = (y * self.width + x) * self.channels;
        &self.data[start..start + self.channels]
    }

    /// The channels of one pixel, for writing.
    pub fn pixel_mut(&mut self, x: usize, y: usize) -> &mut [T] {
        let start = (y * self.width + x) * self.channels;
        &mut self.data[start..start + self.channels]
    }

    /// Number of pixels.
    pub fn pixel_count(&self) -> usize {
        self.width * self.height
    }
}

impl ImageU8 {
    /// Values divided by 255, same encoding.
    pub fn to_f32(&self) -> ImageF32 {
        let data = self.data.iter().map(|&v| f32::from(v) / 255.0).collect();
        ImageF32 { width: self.width, height: self.height, channels: self.channels, data }
    }
}

impl ImageF32 {
    /// All values times `factor`.
    pub fn scaled(mut self, factor: f32) -> Self {
        if factor != 1.0 {
            self.data.iter_mut().for_each(|value| *value *= factor);
        }
        self
    }

    /// Values clamped to [0, 1] and rounded to 8 bits, same encoding; NaN becomes 0.
    pub fn to_u8(&self) -> ImageU8 {
        // `max` first: it turns NaN into 0, `clamp` would keep it.
        let data =
            self.data.iter().map(|&v| (v.max(0.0).clamp(0.0, 1.0) * 255.0).round() as u8).collect();
        ImageU8 { width: self.width, height: self.height, channels: self.channels, data }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_bits_survive_the_round_trip() {
        let image = ImageU8::from_data(16, 16, 1, (0..=255).collect());
        assert_eq!(image.to_f32().to_u8(), image);
    }

    #[test]
    fn out_of_range_values_are_clamped() {
        let image = ImageF32::from_data(5, 1, 1, vec![f32::NAN, -1.0, 2.0, f32::INFINITY, 0.5]);
        assert_eq!(image.to_u8().data, [0, 0, 255, 255, 128]);
    }
}
