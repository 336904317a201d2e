//! Drawing on an 8-bit RGB image: rectangles, pictures, text.
//!
//! Text is Noto Sans Mono from pre-rasterized glyphs with 256 levels of coverage; a character
//! outside Latin-1 is drawn as `?`.

use motes_scene::ImageU8;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

/// Size of text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextSize {
    /// 16 pixels high.
    Small,
    /// 20 pixels high.
    Medium,
    /// 24 pixels high, bold.
    Title,
}

impl TextSize {
    fn raster(self) -> (FontWeight, RasterHeight) {
        match self {
            Self::Small => (FontWeight::Regular, RasterHeight::Size16),
            Self::Medium => (FontWeight::Regular, RasterHeight::Size20),
            Self::Title => (FontWeight::Bold, RasterHeight::Size24),
        }
    }

    /// Height of a line, pixels.
    pub fn height(self) -> usize {
        self.raster().1.val()
    }

    /// Width of a text, pixels: every character is as wide as every other.
    pub fn width_of(self, text: &str) -> usize {
        let (weight, height) = self.raster();
        text.chars().count() * get_raster_width(weight, height)
    }
}

/// An RGB picture being drawn.
#[derive(Clone, Debug)]
pub struct Canvas {
    image: ImageU8,
}

impl Canvas {
    /// A picture of one color.
    pub fn new(width: usize, height: usize, color: [u8; 3]) -> Self {
        let data = color.iter().copied().cycle().take(width * height * 3).collect();
        Self { image: ImageU8::from_data(width, height, 3, data) }
    }

    /// The finished picture, 3 channels.
    pub fn into_image(self) -> ImageU8 {
        self.image
    }

    /// Copies a picture with 1, 3 or 4 channels to (`left`, `top`), cut at the edges. The fourth
    /// channel blends with what is there.
    pub fn blit(&mut self, picture: &ImageU8, left: usize, top: usize) {
        let width = picture.width.min(self.image.width.saturating_sub(left));
        let height = picture.height.min(self.image.height.saturating_sub(top));
        for y in 0..height {
            for x in 0..width {
                let from = picture.pixel(x, y);
                let (rgb, alpha) = match *from {
                    [v] => ([v; 3], 255),
                    [r, g, b, a] => ([r, g, b], a),
                    _ => ([from[0], from[1], from[2]], 255),
                };
                self.mix(left + x, top + y, rgb, alpha);
            }
        }
    }

    /// Fills a rectangle, cut at the edges.
    pub fn fill(&mut self, left: usize, top: usize, width: usize, height: usize, color: [u8; 3]) {
        for y in top..(top + height).min(self.image.height) {
            for x in left..(left + width).min(self.image.width) {
                self.image.pixel_mut(x, y).copy_from_slice(&color);
            }
        }
    }

    /// Writes one line with its top left corner at (`left`, `top`), cut at the edges.
    pub fn text(&mut self, left: usize, top: usize, size: TextSize, color: [u8; 3], text: &str) {
        let (weight, height) = size.raster();
        let advance = get_raster_width(weight, height);
        for (i, character) in text.chars().enumerate() {
            let glyph =
                get_raster(character, weight, height).or_else(|| get_raster('?', weight, height));
            let Some(glyph) = glyph else { continue };
            for (y, row) in glyph.rows().enumerate() {
                for (x, &coverage) in row.iter().enumerate() {
                    let (px, py) = (left + i * advance + x, top + y);
                    if px < self.image.width && py < self.image.height {
                        self.mix(px, py, color, coverage);
                    }
                }
            }
        }
    }

    fn mix(&mut self, x: usize, y: usize, color: [u8; 3], coverage: u8) {
        let alpha = u32::from(coverage);
        for (under, over) in self.image.pixel_mut(x, y).iter_mut().zip(color) {
            let mixed = u32::from(over) * alpha + u32::from(*under) * (255 - alpha);
            *under = ((mixed + 127) / 255) as u8;
        }
    }
}

/// Shortens a text to `max` characters, keeping its end (file names differ there).
pub fn ellipsize(text: &str, max: usize) -> String {
    let length = text.chars().count();
    if length <= max {
        return text.to_owned();
    }
    let tail: String = text.chars().skip(length + 2 - max.max(2)).collect();
    format!("..{tail}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_leaves_ink_inside_its_box_only() {
        let mut canvas = Canvas::new(80, 40, [255; 3]);
        canvas.text(10, 8, TextSize::Small, [0; 3], "24.1");
        let image = canvas.into_image();
        let (right, bottom) = (10 + TextSize::Small.width_of("24.1"), 8 + 16);
        let mut ink = 0;
        for y in 0..40 {
            for x in 0..80 {
                let dark = image.pixel(x, y)[0] < 128;
                ink += usize::from(dark);
                let inside = (10..right).contains(&x) && (8..bottom).contains(&y);
                assert!(!dark || inside, "ink at {x},{y}");
            }
        }
        assert!((40..300).contains(&ink), "{ink} dark pixels");
    }

    #[test]
    fn drawing_over_the_edge_is_cut() {
        let mut canvas = Canvas::new(10, 10, [9; 3]);
        canvas.text(5, 5, TextSize::Title, [0; 3], "W\u{4e2d}");
        canvas.fill(8, 8, 100, 100, [1, 2, 3]);
        canvas.blit(&ImageU8::filled(20, 20, 1, 7), 9, 0);
        let image = canvas.into_image();
        assert_eq!(image.pixel(9, 0), [7; 3]);
        assert_eq!(image.pixel(8, 9), [1, 2, 3]);
        assert_eq!(image.pixel(0, 0), [9; 3]);
    }

    #[test]
    fn transparent_pixels_blend() {
        let mut canvas = Canvas::new(1, 1, [100; 3]);
        canvas.blit(&ImageU8::from_data(1, 1, 4, vec![200, 200, 200, 51]), 0, 0);
        assert_eq!(canvas.into_image().data, [120; 3]);
    }

    #[test]
    fn long_names_keep_their_end() {
        assert_eq!(ellipsize("short.jpg", 12), "short.jpg");
        assert_eq!(ellipsize("a-very-long-name-0017.jpg", 12), "..e-0017.jpg");
    }
}
