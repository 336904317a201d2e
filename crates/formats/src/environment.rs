//! Lat-long environment maps: linear RGB, as OpenEXR or Radiance files.

use std::path::Path;

use motes_scene::ImageF32;

use crate::atomic::write_atomic;
use crate::error::{FormatError, Result};
use crate::exr_aov::{AovChannel, AovImage, AovSamples, read_exr_from, write_finite_exr};
use crate::images::decode_radiance;

/// Reads an environment map: `[h, w, 3]`, linear, row 0 up, values as stored. The content tells
/// OpenEXR from Radiance (`.hdr`). An EXR file may have any sample type; its color is the
/// channels `R G B`, else those of its only layer that has them, else the gray channel `Y`.
///
/// # Errors
/// The file cannot be read, is neither OpenEXR nor Radiance, is damaged, promises more pixels than
/// its length can hold, or has no color.
pub fn read_environment(path: &Path) -> Result<ImageF32> {
    if path.is_dir() {
        return Err(FormatError::invalid(path, "", "this is a folder, not an environment map"));
    }
    let bytes = std::fs::read(path).map_err(|error| FormatError::io(path, error))?;
    read_environment_from(&bytes, path)
}

/// Reads an environment map that is in memory; `name` stands for the file in errors.
///
/// # Errors
/// As [`read_environment`].
pub fn read_environment_from(bytes: &[u8], name: &Path) -> Result<ImageF32> {
    if bytes.starts_with(b"#?") {
        return decode_radiance(bytes, name);
    }
    let is_exr = bytes.is_empty() || bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]);
    if !is_exr {
        let cause = "neither an OpenEXR nor a Radiance file";
        return Err(FormatError::invalid(name, "byte 0", cause)
            .with_remedy("light needs linear values beyond 1: save the map as .exr or .hdr"));
    }
    let image = read_exr_from(bytes, name)?;
    let planes = color_channels(&image).ok_or_else(|| {
        let names: Vec<&str> = image.channels.iter().map(|c| c.name.as_str()).collect();
        let cause = format!("there are no channels R, G and B, only {}", names.join(", "));
        FormatError::invalid(name, "EXR header", cause)
    })?;
    // Without a copy of each plane: maps are large.
    let mut data = vec![0.0; 3 * image.width * image.height];
    for (c, plane) in planes.into_iter().enumerate() {
        let to = data.iter_mut().skip(c).step_by(3);
        match &plane.samples {
            AovSamples::F16(v) => to.zip(v).for_each(|(to, v)| *to = v.to_f32()),
            AovSamples::F32(v) => to.zip(v).for_each(|(to, v)| *to = *v),
            AovSamples::U32(v) => to.zip(v).for_each(|(to, v)| *to = *v as f32),
        }
    }
    Ok(ImageF32::from_data(image.width, image.height, 3, data))
}

fn color_channels(image: &AovImage) -> Option<[&AovChannel; 3]> {
    let of = |layer: &str| {
        let [r, g, b] = ["R", "G", "B"].map(|c| image.channel(&format!("{layer}{c}")));
        Some([r?, g?, b?])
    };
    of("")
        .or_else(|| {
            let layers = image.channels.iter().filter_map(|c| c.name.strip_suffix(".R"));
            let mut colors = layers.filter_map(|layer| of(&format!("{layer}.")));
            let only = colors.next();
            if colors.next().is_some() { None } else { only }
        })
        .or_else(|| image.channel("Y").map(|gray| [gray; 3]))
}

/// Writes a `[h, w, 3]` linear map as an EXR file of floats. `attributes` are texts that say what
/// the values mean.
///
/// # Errors
/// Writing fails.
///
/// # Panics
/// When the image is empty or has not 3 channels.
pub fn write_environment(
    path: &Path,
    image: &ImageF32,
    attributes: &[(String, String)],
) -> Result<()> {
    assert_eq!(image.channels, 3, "an environment map is RGB");
    let channel = |(c, name): (usize, &str)| {
        AovChannel::float(name, image.data.iter().skip(c).step_by(3).copied().collect())
    };
    let channels: Vec<AovChannel> = ["R", "G", "B"].into_iter().enumerate().map(channel).collect();
    write_finite_exr(path, image.width, image.height, &channels, attributes)
}

/// Writes a `[h, w, 3]` linear map as a Radiance file (.hdr): 8 bits of mantissa, one exponent per
/// pixel, no negative values.
///
/// # Errors
/// Writing fails.
///
/// # Panics
/// When the image is empty or has not 3 channels.
pub fn write_radiance(path: &Path, image: &ImageF32) -> Result<()> {
    assert_eq!(image.channels, 3, "an environment map is RGB");
    // `max` first: it turns NaN into 0.
    let value = |v: f32| v.max(0.0).clamp(0.0, f32::MAX);
    let pixels: Vec<image::Rgb<f32>> = image
        .data
        .chunks_exact(3)
        .map(|p| image::Rgb([value(p[0]), value(p[1]), value(p[2])]))
        .collect();
    let mut bytes = Vec::new();
    image::codecs::hdr::HdrEncoder::new(&mut bytes)
        .encode(&pixels, image.width, image.height)
        .map_err(|error| FormatError::io(path, std::io::Error::other(error)))?;
    write_atomic(path, |writer| writer.write_all(&bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exr_aov::write_exr;

    fn map() -> ImageF32 {
        ImageF32::from_data(4, 2, 3, (0..24).map(|v| v as f32 * 1e5 - 3.0).collect())
    }

    #[test]
    fn a_map_survives_with_values_beyond_half_floats() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        write_environment(&path, &map(), &[("colorSpace".into(), "linear".into())]).unwrap();
        assert_eq!(read_environment(&path).unwrap(), map());
    }

    #[test]
    fn radiance_files_are_read_within_their_precision() {
        let values = map().data.iter().map(|v| v.abs() + 0.5).collect::<Vec<_>>();
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.hdr");
        write_radiance(&path, &ImageF32::from_data(4, 2, 3, values.clone())).unwrap();
        let read = read_environment(&path).unwrap();
        assert_eq!((read.width, read.height, read.channels), (4, 2, 3));
        for (pixel, expected) in read.data.chunks_exact(3).zip(values.chunks_exact(3)) {
            let largest = expected.iter().fold(0.0f32, |a, b| a.max(*b));
            for (a, b) in pixel.iter().zip(expected) {
                assert!((a - b).abs() <= largest / 100.0, "{pixel:?} {expected:?}");
            }
        }
    }

    #[test]
    fn color_is_found_in_the_only_layer_and_in_gray() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        let channel = |name: &str, v: f32| AovChannel::half(name, &[v]);
        let layers = ["L.R", "L.G", "L.B", "depth.Z"].map(|n| channel(n, n.len() as f32));
        write_exr(&path, 1, 1, &layers, &[]).unwrap();
        assert_eq!(read_environment(&path).unwrap().data, [3.0; 3]);
        write_exr(&path, 1, 1, &[channel("Y", 0.25)], &[]).unwrap();
        assert_eq!(read_environment(&path).unwrap().data, [0.25; 3]);
        let two = ["L.R", "L.G", "L.B", "M.R", "M.G", "M.B"].map(|n| channel(n, 1.0));
        write_exr(&path, 1, 1, &two, &[]).unwrap();
        let error = read_environment(&path).unwrap_err().to_string();
        assert!(error.contains("no channels R, G and B, only L.B"), "{error}");
    }

    #[test]
    fn pictures_without_range_are_refused_with_a_remedy() {
        let png = crate::images::encode_png(&motes_scene::ImageU8::filled(2, 1, 3, 200));
        let error = read_environment_from(&png, Path::new("sky.png")).unwrap_err().to_string();
        assert!(error.contains("sky.png") && error.contains("help: light needs"), "{error}");
    }
}
