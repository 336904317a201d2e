use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageFormat};
use motes_scene::ImageU8;

use super::*;

fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn gradient() -> ImageU8 {
    let data = (0..8 * 6 * 3).map(|i| (i * 37 % 256) as u8).collect();
    ImageU8::from_data(8, 6, 3, data)
}

fn save(bytes: &[u8], name: &str) -> (tempfile::TempDir, std::path::PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (dir, path)
}

#[test]
fn lossless_images_survive_whatever_their_name() {
    let image = gradient();
    let rgb = image::RgbImage::from_raw(8, 6, image.data.clone()).unwrap();
    for format in [ImageFormat::Png, ImageFormat::Tiff, ImageFormat::Bmp, ImageFormat::Pnm] {
        let (_dir, path) = save(&encoded(&rgb.clone().into(), format), "wrong suffix é 写真.jpg");
        assert_eq!(read_image(&path).unwrap(), image, "{format:?}");
        assert_eq!(image_dimensions(&path).unwrap(), (8, 6));
    }
    let (_dir, path) = save(&[], "x.png");
    write_png(&path, &image).unwrap();
    assert_eq!(read_image(&path).unwrap(), image);
}

#[test]
fn every_pixel_type_becomes_eight_bits() {
    let gray = DynamicImage::ImageLuma8(image::GrayImage::from_raw(1, 1, vec![77]).unwrap());
    let deep = image::ImageBuffer::from_raw(1, 1, vec![65535u16, 257, 0]).unwrap();
    let clear = image::ImageBuffer::from_raw(1, 1, vec![100u8, 128]).unwrap();
    for (image, expected) in [
        (gray, vec![77, 77, 77]),
        (DynamicImage::ImageRgb16(deep), vec![255, 1, 0]),
        (DynamicImage::ImageLumaA8(clear), vec![100, 100, 100, 128]),
    ] {
        let png = encoded(&image, ImageFormat::Png);
        let read = read_image_from(&png, Path::new("x")).unwrap();
        assert_eq!((read.channels, &read.data), (expected.len(), &expected));
    }
    // Linear 0.214 is middle gray in sRGB; the format has 8 bits of mantissa.
    let linear = image::ImageBuffer::from_raw(1, 1, vec![0.214f32, 2.0, 0.0]).unwrap();
    let hdr = encoded(&DynamicImage::ImageRgb32F(linear), ImageFormat::Hdr);
    let read = read_image_from(&hdr, Path::new("x")).unwrap();
    assert_eq!(read.data[1..], [255, 0]);
    assert!((123..=131).contains(&read.data[0]), "{}", read.data[0]);
}

#[test]
fn palettes_are_looked_up() {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 4, 1);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Two);
    encoder.set_palette(vec![0, 0, 0, 255, 0, 0, 0, 255, 0, 9, 8, 7]);
    encoder.write_header().unwrap().write_image_data(&[0b0001_1011]).unwrap();
    let image = read_image_from(&bytes, Path::new("x")).unwrap();
    assert_eq!(image.data, [0, 0, 0, 255, 0, 0, 0, 255, 0, 9, 8, 7]);
}

#[test]
fn masks_are_luminance_times_alpha() {
    let rgba = image::RgbaImage::from_raw(
        3,
        1,
        vec![255, 255, 255, 100, 0, 0, 0, 255, 255, 255, 255, 255],
    );
    let (_dir, path) = save(&encoded(&rgba.unwrap().into(), ImageFormat::Png), "m.png");
    assert_eq!(read_mask(&path).unwrap().data, [100, 0, 255]);
    let gray = image::GrayImage::from_raw(2, 1, vec![0, 200]).unwrap();
    let (_dir, path) = save(&encoded(&gray.into(), ImageFormat::Png), "m.png");
    let mask = read_mask(&path).unwrap();
    assert_eq!((mask.channels, mask.data), (1, vec![0, 200]));
}

/// A JPEG with an APP1 segment that holds only an orientation.
fn jpeg_with_orientation(orientation: u8) -> Vec<u8> {
    let mut image = gradient();
    // A red column at the left survives compression.
    for y in 0..image.height {
        for x in 0..image.width {
            let left = x < 4;
            image.pixel_mut(x, y).copy_from_slice(if left {
                &[230, 20, 20]
            } else {
                &[20, 20, 230]
            });
        }
    }
    let jpeg = encode_jpeg(&image, 95);
    let mut exif = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".to_vec();
    exif.extend([orientation, 0, 0, 0, 0, 0, 0, 0]);
    let mut bytes = vec![0xff, 0xd8, 0xff, 0xe1];
    bytes.extend((exif.len() as u16 + 2).to_be_bytes());
    bytes.extend(exif);
    bytes.extend(&jpeg[2..]);
    bytes
}

#[test]
fn exif_orientation_turns_the_image() {
    // 6: the camera was turned, the stored image must be rotated by 90 degrees clockwise.
    let (_dir, path) = save(&jpeg_with_orientation(6), "x.jpg");
    let stored = read_image(&path).unwrap();
    let upright = read_image_upright(&path).unwrap();
    assert_eq!((stored.width, stored.height), (8, 6));
    assert_eq!((upright.width, upright.height), (6, 8));
    assert_eq!(image_dimensions(&path).unwrap(), (8, 6));
    assert_eq!(image_dimensions_upright(&path).unwrap(), (6, 8));
    assert!(stored.pixel(0, 5)[0] > 150 && stored.pixel(7, 0)[2] > 150);
    assert!(upright.pixel(5, 0)[0] > 150 && upright.pixel(0, 7)[2] > 150, "left is now the top");
    let (_dir, path) = save(&jpeg_with_orientation(1), "x.jpg");
    assert_eq!(read_image_upright(&path).unwrap(), read_image(&path).unwrap());
}

#[test]
fn an_incomplete_jpeg_is_not_filled_with_gray() {
    let whole = jpeg_with_orientation(1);
    for kept in [whole.len() - 2, whole.len() / 2, 3] {
        assert!(read_image_from(&whole[..kept], Path::new("x")).is_err(), "{kept} bytes");
    }
    // Cameras append previews behind the end marker.
    let longer = [whole.as_slice(), &[0; 100]].concat();
    assert!(read_image_from(&longer, Path::new("x")).is_ok());
}

#[test]
fn a_header_cannot_promise_what_the_file_does_not_hold() {
    let mut png = encode_png(&gradient());
    png[16..24].copy_from_slice(&[0, 0, 0x75, 0x30, 0, 0, 0x75, 0x30]); // 30000 x 30000
    let crc = crc32(&png[12..29]);
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    let error = read_image_from(&png, Path::new("x.png")).unwrap_err().to_string();
    assert!(error.contains("30000 x 30000 pixels are more than the 500 megapixels"), "{error}");
    png[16..24].copy_from_slice(&[0, 0, 0x27, 0x10, 0, 0, 0x27, 0x10]); // 10000 x 10000
    let crc = crc32(&png[12..29]);
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    let error = read_image_from(&png, Path::new("x.png")).unwrap_err().to_string();
    assert!(error.contains("10000 x 10000 pixels, which"), "{error}");
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| {
            if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 }
        })
    })
}

#[test]
fn what_is_no_image_is_said_so() {
    let phone = b"\0\0\0\x20ftypheic\0\0\0\0mif1heic";
    let said = read_image_from(phone, Path::new("o'clock.HEIC")).unwrap_err().to_string();
    for words in [
        r"heif-convert -q 95 'o'\''clock.HEIC' 'o'\''clock.jpg'",
        "sips -s format jpeg",
        "magick 'o",
    ] {
        assert!(said.contains(words), "{said}");
    }
    let said = read_image_from(phone, Path::new("a/p.jpg")).unwrap_err().to_string();
    assert!(said.contains("'a/p.jpg' 'a/p.converted.jpg'"), "onto itself: {said}");
    for bytes in [&b""[..], b"hello, this is text"] {
        let error = read_image_from(bytes, Path::new("x.jpg")).unwrap_err().to_string();
        assert!(error.contains("x.jpg") && error.contains("byte 0"), "{error}");
    }
    assert!(read_image(Path::new(".")).unwrap_err().to_string().contains("a folder"));
}

/// A PNG of one color, as few bits a pixel as there can be.
fn flat_png(width: u32, height: u32, color: png::ColorType) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::One);
    encoder.set_compression(png::Compression::High);
    if color == png::ColorType::Indexed {
        encoder.set_palette(vec![10, 20, 30, 200, 210, 220]);
    }
    let row = width.div_ceil(8) as usize;
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&vec![0; row * height as usize]).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn large_pictures_of_one_color_are_read() {
    let palette = flat_png(6000, 4000, png::ColorType::Indexed);
    let black = flat_png(6000, 4000, png::ColorType::Grayscale);
    let mut white = Vec::new();
    image::codecs::webp::WebPEncoder::new_lossless(&mut white)
        .encode(&vec![255; 3 * 6000 * 4000], 6000, 4000, image::ExtendedColorType::Rgb8)
        .unwrap();
    for (bytes, color) in [(palette, [10, 20, 30]), (black, [0; 3]), (white, [255; 3])] {
        assert!(bytes.len() < 60_000, "{}", bytes.len());
        let image = read_image_from(&bytes, Path::new("x")).unwrap();
        assert_eq!((image.width, image.height, image.pixel(5999, 3999)), (6000, 4000, &color[..]));
    }
    // Fifty times as many are not a photo.
    let many = flat_png(22_000, 22_000, png::ColorType::Grayscale);
    assert!(read_image_from(&many, Path::new("x")).is_err());
}
