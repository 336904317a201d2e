//! Writing 8-bit images.

use std::path::Path;

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use motes_scene::ImageU8;

use crate::atomic::write_atomic;
use crate::error::Result;

/// Writes a PNG of 1, 2, 3 or 4 channels, sRGB-encoded, straight alpha.
///
/// # Errors
/// Writing fails.
///
/// # Panics
/// As [`encode_png`].
pub fn write_png(path: &Path, image: &ImageU8) -> Result<()> {
    let bytes = encode_png(image);
    write_atomic(path, |writer| writer.write_all(&bytes))
}

/// The bytes of a PNG file.
///
/// # Panics
/// When the image is empty or has not 1 to 4 channels.
pub fn encode_png(image: &ImageU8) -> Vec<u8> {
    let color = match image.channels {
        1 => ExtendedColorType::L8,
        2 => ExtendedColorType::La8,
        3 => ExtendedColorType::Rgb8,
        4 => ExtendedColorType::Rgba8,
        n => panic!("a PNG has 1 to 4 channels, not {n}"),
    };
    let (width, height) = (image.width as u32, image.height as u32);
    let mut bytes = Vec::new();
    let outcome = PngEncoder::new(&mut bytes).write_image(&image.data, width, height, color);
    encoded(image, outcome, bytes)
}

/// The bytes of a JPEG file without chroma subsampling. `quality` is 1 to 100.
///
/// # Panics
/// When the image is empty or has neither 1 nor 3 channels.
pub fn encode_jpeg(image: &ImageU8, quality: u8) -> Vec<u8> {
    let color = match image.channels {
        1 => ExtendedColorType::L8,
        3 => ExtendedColorType::Rgb8,
        n => panic!("a JPEG has 1 or 3 channels, not {n}"),
    };
    let (width, height) = (image.width as u32, image.height as u32);
    let mut bytes = Vec::new();
    let outcome = JpegEncoder::new_with_quality(&mut bytes, quality.clamp(1, 100)).write_image(
        &image.data,
        width,
        height,
        color,
    );
    encoded(image, outcome, bytes)
}

/// The bytes of an encoder that ran. Into memory it can only fail on an image that no file can hold.
fn encoded(image: &ImageU8, outcome: image::ImageResult<()>, bytes: Vec<u8>) -> Vec<u8> {
    if let Err(error) = outcome {
        panic!("a {} x {} image cannot be encoded: {error}", image.width, image.height);
    }
    bytes
}
