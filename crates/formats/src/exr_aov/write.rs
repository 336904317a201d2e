//! Channels to the bytes of an EXR file.

use std::borrow::Cow;
use std::io::{Cursor, Write};
use std::path::Path;

use exr::prelude::Blocks;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Compression, Encoding, FlatSamples, Image, Layer,
    LayerAttributes, LineOrder, SmallVec, Text, WritableImage,
};

use super::{AovChannel, AovSamples};
use crate::atomic::write_atomic;
use crate::error::{FormatError, Result};
use crate::finite;

/// Writes channels as a ZIP-compressed scan-line EXR. The same input gives the same bytes.
///
/// # Errors
/// Writing fails, or a channel name is empty or longer than 255 bytes.
///
/// # Panics
/// When the image is empty, a channel has not `width * height` values, or a name is used twice.
pub fn write_exr(
    path: &Path,
    width: usize,
    height: usize,
    channels: &[AovChannel],
    attributes: &[(String, String)],
) -> Result<()> {
    let bytes = encode_exr(path, width, height, channels, attributes)?;
    write_atomic(path, |writer: &mut dyn Write| writer.write_all(&bytes))
}

/// [`write_exr`] for a picture that a stage made: other programs may mean something by infinity, a renderer does not.
///
/// # Errors
/// As [`write_exr`], and when a value is not finite.
///
/// # Panics
/// As [`write_exr`].
pub fn write_finite_exr(
    path: &Path,
    width: usize,
    height: usize,
    channels: &[AovChannel],
    attributes: &[(String, String)],
) -> Result<()> {
    for channel in channels {
        let values = match &channel.samples {
            AovSamples::F32(values) => Cow::Borrowed(values),
            AovSamples::F16(_) => Cow::Owned(channel.to_f32()),
            AovSamples::U32(_) => continue,
        };
        finite::columns(path, [(channel.name.as_str(), &values[..], 1)])?;
    }
    write_exr(path, width, height, channels, attributes)
}

pub(super) fn encode_exr(
    path: &Path,
    width: usize,
    height: usize,
    channels: &[AovChannel],
    attributes: &[(String, String)],
) -> Result<Vec<u8>> {
    assert!(width * height > 0 && !channels.is_empty(), "an EXR has pixels and channels");
    let mut list = SmallVec::new();
    for (i, channel) in channels.iter().enumerate() {
        assert_eq!(channel.samples.len(), width * height, "values of {}", channel.name);
        assert!(channels[..i].iter().all(|c| c.name != channel.name), "{} twice", channel.name);
        let samples = match &channel.samples {
            AovSamples::F16(v) => FlatSamples::F16(v.clone()),
            AovSamples::F32(v) => FlatSamples::F32(v.clone()),
            AovSamples::U32(v) => FlatSamples::U32(v.clone()),
        };
        list.push(AnyChannel::new(text(&channel.name), samples));
    }
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer =
        Layer::new((width, height), LayerAttributes::default(), encoding, AnyChannels::sort(list));
    let mut image = Image::from_layer(layer);
    let written = &mut image.layer_data.attributes;
    for (name, value) in attributes {
        // Names of the OpenEXR standard have fields of their own in the encoder.
        let field = match name.as_str() {
            "software" => &mut written.software_name,
            "comments" => &mut written.comments,
            "owner" => &mut written.owner,
            "capDate" => &mut written.capture_date,
            _ => {
                written.other.insert(text(name), AttributeValue::Text(text(value)));
                continue;
            }
        };
        *field = Some(text(value));
    }
    let mut file = Cursor::new(Vec::new());
    image
        .write()
        .to_buffered(&mut file)
        .map_err(|error| FormatError::invalid(path, "EXR header", error.to_string()))?;
    let mut bytes = file.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

fn text(text: &str) -> Text {
    Text::from_bytes_unchecked(text.as_bytes().iter().copied().collect())
}

/// Puts the attributes of the header, which come from a hash map, in the order of their names.
fn sort_attributes(bytes: &mut [u8]) {
    const START: usize = 8; // magic number and version
    let attribute_end = |start: usize| {
        let zero = |from: usize| Some(from + bytes.get(from..)?.iter().position(|b| *b == 0)?);
        let size_at = zero(zero(start)? + 1)? + 1; // after name and type
        let size = bytes.get(size_at..size_at + 4)?;
        Some(size_at + 4 + u32::from_le_bytes([size[0], size[1], size[2], size[3]]) as usize)
    };
    let (mut attributes, mut at) = (Vec::new(), START);
    while bytes.get(at).is_some_and(|b| *b != 0) {
        let Some(attribute) = attribute_end(at).and_then(|end| bytes.get(at..end)) else { return };
        attributes.push(attribute.to_vec());
        at += attribute.len();
    }
    attributes.sort();
    bytes[START..at].copy_from_slice(&attributes.concat());
}
