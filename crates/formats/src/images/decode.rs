//! Reading image files without trusting their headers.

use std::io::Cursor;
use std::path::Path;

use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};
use motes_scene::{ImageF32, ImageU8};

use super::convert::{to_mask, to_rgb_or_rgba};
use super::tiff_tags::tag_beyond_file;
use crate::budget;
use crate::error::{FormatError, Result};

/// Larger images are refused: 500 megapixels are 2 GB when decoded.
const MAX_PIXELS: u64 = 500_000_000;
/// What a decoder may hold: the largest allowed image with 16 bits a channel.
const MAX_DECODER_BYTES: u64 = 8 * MAX_PIXELS;
/// What a decoder may hold before the size of the image is known, and more per byte of the file.
const GRANTED_BYTES: u64 = 320 << 20;
const MAX_COMPRESSION: u64 = 8800;

/// Reads an image as stored: 3 channels, or 4 when the file has alpha. Gray and palette images
/// become RGB.
///
/// # Errors
/// The file cannot be read, is of no known format or damaged, has more than 500 megapixels, or
/// promises far more pixels than its length can hold.
pub fn read_image(path: &Path) -> Result<ImageU8> {
    decode(path, false).map(to_rgb_or_rgba)
}

/// [`read_image`], turned and mirrored as the EXIF orientation says.
///
/// # Errors
/// As [`read_image`].
pub fn read_image_upright(path: &Path) -> Result<ImageU8> {
    decode(path, true).map(to_rgb_or_rgba)
}

/// Decodes an image that is in memory, as stored; `name` stands for the file in errors.
///
/// # Errors
/// As [`read_image`].
pub fn read_image_from(bytes: &[u8], name: &Path) -> Result<ImageU8> {
    decode_bytes(bytes, name, false).map(to_rgb_or_rgba)
}

/// Reads a mask as stored: 1 channel, 0 = ignore. Colors become luminance, which alpha
/// multiplies.
///
/// # Errors
/// As [`read_image`].
pub fn read_mask(path: &Path) -> Result<ImageU8> {
    decode(path, false).map(to_mask)
}

/// Decodes a Radiance file to linear values, `[h, w, 3]`.
pub(crate) fn decode_radiance(bytes: &[u8], path: &Path) -> Result<ImageF32> {
    let image = decode_bytes(bytes, path, false)?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let DynamicImage::ImageRgb32F(linear) = image else {
        return Err(FormatError::invalid(path, "byte 0", "not a Radiance file"));
    };
    Ok(ImageF32::from_data(width, height, 3, linear.into_raw()))
}

/// Width and height as stored, without decoding the pixels.
///
/// # Errors
/// As [`read_image`], as far as the header tells.
pub fn image_dimensions(path: &Path) -> Result<(usize, usize)> {
    let bytes = read_bytes(path)?;
    let (width, height) = decoder(&bytes, path)?.dimensions();
    Ok((width as usize, height as usize))
}

/// Width and height after the EXIF orientation.
///
/// # Errors
/// As [`image_dimensions`].
pub fn image_dimensions_upright(path: &Path) -> Result<(usize, usize)> {
    let bytes = read_bytes(path)?;
    let mut decoder = decoder(&bytes, path)?;
    let (width, height) = decoder.dimensions();
    let turned = matches!(
        orientation(&mut decoder),
        Orientation::Rotate90
            | Orientation::Rotate270
            | Orientation::Rotate90FlipH
            | Orientation::Rotate270FlipH
    );
    let (width, height) = (width as usize, height as usize);
    Ok(if turned { (height, width) } else { (width, height) })
}

fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    if path.is_dir() {
        return Err(FormatError::invalid(path, "", "this is a folder, not an image"));
    }
    std::fs::read(path).map_err(|error| FormatError::io(path, error))
}

fn decode(path: &Path, upright: bool) -> Result<DynamicImage> {
    decode_bytes(&read_bytes(path)?, path, upright)
}

fn decode_bytes(bytes: &[u8], path: &Path, upright: bool) -> Result<DynamicImage> {
    let mut decoder = decoder(bytes, path)?;
    let orientation = orientation(&mut decoder);
    let mut image =
        DynamicImage::from_decoder(decoder).map_err(|error| image_error(path, error))?;
    if upright {
        image.apply_orientation(orientation);
    }
    Ok(image)
}

/// Damaged EXIF data is no reason to refuse a photo: other programs show it as stored.
fn orientation(decoder: &mut impl ImageDecoder) -> Orientation {
    decoder.orientation().unwrap_or(Orientation::NoTransforms)
}

/// A decoder whose header passed the checks.
fn decoder<'b>(bytes: &'b [u8], path: &Path) -> Result<impl ImageDecoder + 'b> {
    if bytes.is_empty() {
        return Err(FormatError::invalid(path, "byte 0", "the file is empty"));
    }
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| FormatError::io(path, error))?;
    if is_heif(bytes) {
        return Err(heif(path));
    }
    let is_webp = reader.format() == Some(ImageFormat::WebP);
    match reader.format() {
        Some(ImageFormat::Jpeg) if !jpeg_has_end(bytes) => {
            return Err(FormatError::invalid(path, "end of file", "the JPEG file ends early")
                .with_remedy("the file is incomplete: copy it again"));
        }
        Some(ImageFormat::Tiff) => {
            if let Some(tag) = tag_beyond_file(bytes) {
                let cause = format!("tag {tag} has more values than the file can hold");
                return Err(FormatError::invalid(path, "TIFF directory", cause));
            }
        }
        // Recognized by chance in arbitrary bytes, and no camera writes it.
        Some(ImageFormat::Tga) | None => {
            return Err(FormatError::invalid(path, "byte 0", "not an image of a known format")
                .with_remedy("PNG, JPEG, TIFF, WebP, BMP, PNM and HDR are read; raw files must be converted first"));
        }
        Some(_) => {}
    }
    let mut limits = Limits::no_limits();
    let plausible = GRANTED_BYTES + MAX_COMPRESSION * bytes.len() as u64;
    limits.max_alloc = Some(MAX_DECODER_BYTES.min(plausible));
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|error| image_error(path, error))?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    let size = format!("{width} x {height} pixels");
    if pixels == 0 {
        return Err(FormatError::invalid(path, "image header", format!("the image has {size}")));
    }
    if pixels > MAX_PIXELS {
        let cause =
            format!("{size} are more than the {} megapixels that are read", MAX_PIXELS / 1_000_000);
        return Err(FormatError::not_supported(path, "image header", cause)
            .with_remedy("make the image smaller first"));
    }
    let decoded = decoder.total_bytes();
    let stored = stored_bits_of_png(bytes).map_or(decoded, |bits| pixels * bits / 8);
    // The image, and the same as RGB.
    let (unpacked, packed) = (decoded.max(3 * pixels), bytes.len() as u64);
    budget::picture(path, "image header", &size, stored, unpacked, packed, is_webp)?;
    Ok(decoder)
}

/// Whether a file is a HEIF container (HEIC of phones, AVIF): ISO/IEC 23008-12, box `ftyp` with one of its brands.
fn is_heif(bytes: &[u8]) -> bool {
    const BRANDS: [&[u8]; 8] =
        [b"heic", b"heix", b"hevc", b"heim", b"heis", b"mif1", b"msf1", b"avif"];
    bytes.get(4..8) == Some(b"ftyp") && bytes.get(8..12).is_some_and(|b| BRANDS.contains(&b))
}

/// No decoder of HEVC has a license that fits, so the user's own converts.
fn heif(path: &Path) -> FormatError {
    let quote = |path: &Path| format!("'{}'", path.display().to_string().replace('\'', "'\\''"));
    // What is called `.jpg` already would be converted onto itself.
    let target = match path.with_extension("jpg") {
        same if same == path => path.with_extension("converted.jpg"),
        other => other,
    };
    let (from, to) = (quote(path), quote(&target));
    FormatError::not_supported(path, "byte 4", "HEIC and AVIF pictures are not read").with_remedy(
        format!(
            "convert it: heif-convert -q 95 {from} {to} (Debian: libheif-examples); on macOS: \
             sips -s format jpeg -s formatOptions 95 {from} --out {to}; or: magick {from} -quality 95 {to}"
        ),
    )
}

/// Bits of a pixel as a PNG stores it; a picture of two colors has one.
fn stored_bits_of_png(bytes: &[u8]) -> Option<u64> {
    let header = bytes.strip_prefix(b"\x89PNG\r\n\x1a\n")?.get(..18)?;
    let channels = match header[17] {
        2 => 3,
        4 => 2,
        6 => 4,
        _ => 1,
    };
    Some(channels * u64::from(header[16]))
}

fn image_error(path: &Path, error: ImageError) -> FormatError {
    let text = error.to_string();
    match error {
        ImageError::Unsupported(_) => FormatError::not_supported(path, "image data", text)
            .with_remedy("convert the image to PNG or to an 8-bit RGB JPEG"),
        ImageError::Limits(_) => FormatError::not_supported(path, "image header", text)
            .with_remedy("make the image smaller first"),
        ImageError::IoError(source) => FormatError::io(path, source),
        _ => FormatError::invalid(path, "image data", text)
            .with_remedy("the file is damaged: copy it again"),
    }
}

/// Whether the image data of a JPEG file is closed by an end marker. The decoder fills what is
/// missing with gray and says nothing, and a fit would then learn the gray.
fn jpeg_has_end(bytes: &[u8]) -> bool {
    // Marker segments up to the first scan: a thumbnail inside them has end markers of its own.
    let mut at = 2;
    while let Some(&[0xff, marker, high, low]) = bytes.get(at..at + 4) {
        match marker {
            0xff => at += 1,
            0xda => {
                let scans = &bytes[at..];
                return scans.windows(2).any(|pair| pair == [0xff, 0xd9]);
            }
            _ => at += 2 + usize::from(u16::from_be_bytes([high, low])).max(2),
        }
    }
    // No scan at all: the decoder says what is wrong.
    true
}
