//! Lossless WebP images whose pixels are numbers.

use std::io::Cursor;
use std::path::Path;

use image_webp::{ColorType, WebPDecoder, WebPEncoder};

use super::fault;
use motes_formats::error::Result;

/// Pixels per Gaussian that an image may have: rows are padded, but not without bound.
const MOST_PADDING: u64 = 4;
/// Every image may have this many pixels.
const FREE_PIXELS: u64 = 1 << 16;

/// Pixels of four bytes.
pub(super) struct Pixels {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rgba: Vec<u8>,
}

impl Pixels {
    /// Width and height, multiples of four, for a number of pixels.
    pub(super) fn size_for(count: usize) -> (usize, usize) {
        let width = (((count as f64).sqrt() / 4.0).ceil() as usize).max(1) * 4;
        (width, count.div_ceil(width).div_ceil(4).max(1) * 4)
    }

    pub(super) fn pixel(&self, i: usize) -> [u8; 4] {
        let at = 4 * i;
        [self.rgba[at], self.rgba[at + 1], self.rgba[at + 2], self.rgba[at + 3]]
    }
}

/// Decodes an image of at least `count` pixels, and not of many more.
pub(super) fn decode(bytes: &[u8], count: u64, path: &Path, name: &str) -> Result<Pixels> {
    let bad = |error: image_webp::DecodingError| {
        fault(path, name, format!("not a WebP image that can be read: {error}"))
    };
    let mut decoder = WebPDecoder::new(Cursor::new(bytes)).map_err(bad)?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    if pixels < count {
        let cause = format!("the image has {width} x {height} pixels for {count} values");
        return Err(fault(path, name, cause));
    }
    if pixels > count.saturating_mul(MOST_PADDING).max(FREE_PIXELS) {
        let cause =
            format!("the image has {width} x {height} pixels, far more than {count} values");
        return Err(fault(path, name, cause));
    }
    let channels = if decoder.has_alpha() { 4 } else { 3 };
    let mut data = vec![0; pixels as usize * channels];
    decoder.read_image(&mut data).map_err(bad)?;
    let rgba = if channels == 4 {
        data
    } else {
        data.chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 255]).collect()
    };
    Ok(Pixels { width: width as usize, height: height as usize, rgba })
}

/// Encodes without loss, alpha only where there is some.
pub(super) fn encode(pixels: &Pixels) -> std::io::Result<Vec<u8>> {
    let (width, height) = (pixels.width as u32, pixels.height as u32);
    let opaque = pixels.rgba.chunks_exact(4).all(|pixel| pixel[3] == 255);
    let mut bytes = Vec::new();
    let encoder = WebPEncoder::new(&mut bytes);
    let done = if opaque {
        let rgb: Vec<u8> = pixels.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        encoder.encode(&rgb, width, height, ColorType::Rgb8)
    } else {
        encoder.encode(&pixels.rgba, width, height, ColorType::Rgba8)
    };
    done.map_err(std::io::Error::other)?;
    Ok(bytes)
}
