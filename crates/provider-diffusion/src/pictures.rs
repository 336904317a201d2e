//! Pictures as bytes, and the sizes that the networks work in.

use std::path::Path;

use candle_core::{Device, Tensor};
use motes_formats::exr_aov::open_exr;
use motes_formats::images::{read_image, read_mask};
use motes_math::resample::{Filter, resize};
use motes_math::srgb;
use motes_scene::ImageU8;

use crate::error::{DiffusionError, Result};

/// Sides that the networks halve six times at most.
const MULTIPLE: usize = 64;

/// R, G, B of a PNG, or of an OpenEXR file by the sRGB curve.
///
/// # Errors
/// It cannot be read.
pub fn read(path: &Path) -> Result<ImageU8> {
    if path.extension().is_some_and(|end| end.eq_ignore_ascii_case("exr")) {
        let image = open_exr(path)?;
        let plane = |name: &str| {
            let found = image.channel(name).map(|channel| channel.to_f32());
            found.ok_or_else(|| {
                let cause = format!("no channel {name}: {}", path.display());
                DiffusionError::picture(cause, "write linear R, G, B")
            })
        };
        let (r, g, b) = (plane("R")?, plane("G")?, plane("B")?);
        let byte = |v: &f32| (255.0 * srgb::encode(v.max(0.0).clamp(0.0, 1.0))).round() as u8;
        let pixels = r.iter().zip(&g).zip(&b).flat_map(|((r, g), b)| [byte(r), byte(g), byte(b)]);
        return Ok(ImageU8::from_data(image.width, image.height, 3, pixels.collect()));
    }
    let image = read_image(path)?;
    let rgb = |pixel: &[u8]| match pixel {
        [r, g, b, ..] => [*r, *g, *b],
        [v, ..] => [*v; 3],
        [] => [0; 3],
    };
    let pixels = image.data.chunks_exact(image.channels).flat_map(rgb).collect();
    Ok(ImageU8::from_data(image.width, image.height, 3, pixels))
}

/// A mask of the size of a picture, 0 to 1.
///
/// # Errors
/// It cannot be read, has another size, or nothing in it.
pub fn read_foreground(path: &Path, picture: &ImageU8) -> Result<Vec<f32>> {
    let mask = read_mask(path)?;
    if (mask.width, mask.height) != (picture.width, picture.height) {
        let (a, b) = (size(&mask), size(picture));
        let cause = format!("the foreground has {a} pixels, the picture {b}");
        return Err(DiffusionError::picture(cause, "send both alike"));
    }
    if mask.data.iter().all(|v| *v == 0) {
        let cause = "the foreground is empty: there is nothing to light";
        return Err(DiffusionError::picture(cause, "check the mask: white is the object"));
    }
    Ok(mask.data.iter().map(|v| f32::from(*v) / 255.0).collect())
}

/// `48x34`.
pub fn size(picture: &ImageU8) -> String {
    format!("{}x{}", picture.width, picture.height)
}

/// Width and height that a model works in: about this longer side, multiples of 64, the shape kept where that allows it.
pub fn working_size((width, height): (usize, usize), longer_side: usize) -> (usize, usize) {
    let scale = longer_side as f64 / width.max(height) as f64;
    (multiple(width as f64 * scale), multiple(height as f64 * scale))
}

/// The nearest multiple of 64, not zero.
pub fn multiple(side: f64) -> usize {
    ((side / MULTIPLE as f64).round_ties_even() as usize).max(1) * MULTIPLE
}

/// A picture in another size by Lanczos: first along rows, then along columns, to bytes after each, as Pillow does.
pub fn resized(picture: &ImageU8, (width, height): (usize, usize)) -> ImageU8 {
    let bytes =
        |values: Vec<f32>| values.iter().map(|v| v.round().clamp(0.0, 255.0) as u8).collect();
    let floats = |bytes: &[u8]| bytes.iter().map(|v| f32::from(*v)).collect::<Vec<f32>>();
    let mut made = picture.clone();
    if width != made.width {
        let from = (made.width, made.height, 3);
        let wide = resize(&floats(&made.data), from, (width, made.height), Filter::Lanczos3);
        made = ImageU8::from_data(width, made.height, 3, bytes(wide));
    }
    if height != made.height {
        let from = (width, made.height, 3);
        let high = resize(&floats(&made.data), from, (width, height), Filter::Lanczos3);
        made = ImageU8::from_data(width, height, 3, bytes(high));
    }
    made
}

/// Bytes as numbers around 0, `[1, 3, height, width]`; `middle` becomes 0.
///
/// # Errors
/// Memory ran out.
pub fn signed(picture: &ImageU8, middle: f32, device: &Device) -> Result<Tensor> {
    let count = picture.pixel_count();
    let value = |k: usize| f32::from(picture.data[k % count * 3 + k / count]) / middle - 1.0;
    let values: Vec<f32> = (0..3 * count).map(value).collect();
    Ok(Tensor::from_vec(values, (1, 3, picture.height, picture.width), device)?)
}

/// Numbers from -1 to 1, `[1, 3, height, width]`, as bytes.
///
/// # Errors
/// A number is not finite.
pub fn unsigned(values: &Tensor) -> Result<ImageU8> {
    let (_, _, height, width) = values.dims4()?;
    let values: Vec<f32> = values.flatten_all()?.to_vec1()?;
    if !values.iter().all(|v| v.is_finite()) {
        return Err(DiffusionError::NotFinite);
    }
    let count = width * height;
    let byte = |k: usize| {
        let v = values[k % 3 * count + k / 3];
        (v * 127.5 + 127.5).clamp(0.0, 255.0).round_ties_even() as u8
    };
    Ok(ImageU8::from_data(width, height, 3, (0..3 * count).map(byte).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_multiples_and_keep_the_shape() {
        assert_eq!(working_size((640, 512), 640), (640, 512));
        assert_eq!(working_size((3000, 2000), 512), (512, 320));
        assert_eq!(working_size((1, 300), 512), (64, 512));
        assert_eq!(working_size((1, 1), 100), (128, 128));
    }

    #[test]
    fn bytes_survive_the_way_to_numbers_and_back() {
        let picture = ImageU8::from_data(4, 2, 3, (0..24).map(|v| v * 10).collect());
        let numbers = signed(&picture, 127.5, &Device::Cpu).unwrap();
        assert_eq!(unsigned(&numbers).unwrap(), picture);
        assert_eq!(resized(&picture, (4, 2)), picture);
        let odd = (numbers * f64::NAN).unwrap();
        assert!(unsigned(&odd).is_err());
    }
}
