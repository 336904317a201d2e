//! The bytes of an EXR file to channels.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

use exr::prelude::{AttributeValue, FlatSamples, MetaData, ReadChannels, ReadLayers, Text, Vec2};

use super::{AovChannel, AovImage, AovSamples};
use crate::budget;
use crate::error::{FormatError, Result, quoted};

/// Larger images are refused; all channels of one hold 4 GB at most.
const MAX_PIXELS: u64 = 500_000_000;
const MAX_BYTES: u64 = 4 << 30;

/// Reads the channels of an EXR file: `(width, height, channels)`, see [`open_exr`].
///
/// # Errors
/// As [`open_exr`].
pub fn read_exr(path: &Path) -> Result<(usize, usize, Vec<AovChannel>)> {
    open_exr(path).map(|image| (image.width, image.height, image.channels))
}

/// Reads the channels and text attributes of an EXR file. The parts of a multi-part file are
/// joined; a part's name becomes the layer of its channels.
///
/// # Errors
/// The file cannot be read, is not an EXR file or damaged, has deep or subsampled channels or parts
/// of different sizes, has more than 500 megapixels, or promises far more than its length can
/// hold.
pub fn open_exr(path: &Path) -> Result<AovImage> {
    let bytes = std::fs::read(path).map_err(|error| FormatError::io(path, error))?;
    read_exr_from(&bytes, path)
}

/// Reads an EXR file that is in memory; `name` stands for the file in errors.
///
/// # Errors
/// As [`open_exr`].
pub fn read_exr_from(bytes: &[u8], name: &Path) -> Result<AovImage> {
    let path = name;
    check_header(bytes, path)?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| exr_error(path, error))?;
    let (mut channels, mut attributes) = (Vec::new(), BTreeMap::new());
    let mut size = None;
    for layer in image.layer_data {
        let (width, height) = (layer.size.width(), layer.size.height());
        if *size.get_or_insert((width, height)) != (width, height) {
            let cause = "its parts have different sizes";
            return Err(FormatError::not_supported(path, "EXR header", cause));
        }
        // Blender writes a single part whose name is empty.
        let part = layer.attributes.layer_name.as_ref().map(string).filter(|n| !n.is_empty());
        let part = part.map(|name| name + ".");
        for channel in layer.channel_data.list {
            let mut name = string(&channel.name);
            if let Some(part) = part.as_ref().filter(|part| !name.starts_with(part.as_str())) {
                name.insert_str(0, part);
            }
            if channel.sampling != Vec2(1, 1) || channel.sample_data.len() != width * height {
                let cause = format!("channel {} is subsampled", quoted(&name));
                return Err(FormatError::not_supported(path, "EXR header", cause));
            }
            let samples = match channel.sample_data {
                FlatSamples::F16(v) => AovSamples::F16(v),
                FlatSamples::F32(v) => AovSamples::F32(v),
                FlatSamples::U32(v) => AovSamples::U32(v),
            };
            channels.push(AovChannel { name, samples });
        }
        let l = &layer.attributes;
        // Names of the OpenEXR standard, which the decoder takes out of the list.
        for (name, value) in [
            ("software", &l.software_name),
            ("comments", &l.comments),
            ("owner", &l.owner),
            ("capDate", &l.capture_date),
        ] {
            if let Some(value) = value {
                attributes.insert(name.to_owned(), string(value));
            }
        }
        for (name, value) in l.other.iter().chain(&image.attributes.other) {
            if let AttributeValue::Text(value) = value {
                attributes.insert(string(name), string(value));
            }
        }
    }
    channels.sort_by(|a, b| a.name.cmp(&b.name));
    let (width, height) = size.unwrap_or_default();
    Ok(AovImage { width, height, channels, attributes })
}

fn string(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

/// Refuses sizes that the file cannot hold before the decoder makes room for them.
fn check_header(bytes: &[u8], path: &Path) -> Result<()> {
    if !bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        let cause = if bytes.is_empty() { "the file is empty" } else { "not an EXR file" };
        return Err(FormatError::invalid(path, "byte 0", cause));
    }
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|error| exr_error(path, error))?;
    let mut total = 0u64;
    for header in &meta.headers {
        let (width, height) = (header.layer_size.width() as u64, header.layer_size.height() as u64);
        let pixels = width.saturating_mul(height);
        let pixel_bytes = header.channels.bytes_per_pixel as u64;
        total = total.saturating_add(pixels.saturating_mul(pixel_bytes));
        let size = format!("{width} x {height} pixels of {pixel_bytes} bytes");
        budget::floats(path, "EXR header", &size, total, bytes.len() as u64)?;
        if pixels > MAX_PIXELS || total > MAX_BYTES {
            let cause = format!("{size} are more than are read");
            return Err(FormatError::not_supported(path, "EXR header", cause));
        }
    }
    Ok(())
}

fn exr_error(path: &Path, error: exr::error::Error) -> FormatError {
    match error {
        exr::error::Error::NotSupported(cause) => {
            FormatError::not_supported(path, "EXR data", cause.to_string())
        }
        exr::error::Error::Io(source) => FormatError::io(path, source),
        other => FormatError::invalid(path, "EXR data", other.to_string()),
    }
}
