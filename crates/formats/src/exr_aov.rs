//! Multi-channel OpenEXR images: what a renderer knows about every pixel.
//!
//! `docs/formats/exr-aov.md` names the channels. A layer is the part of a channel's name before
//! the last dot: `depth.Z`, `normal.X`.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Cursor, Write};
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Compression, Encoding, FlatSamples, Image, Layer,
    LayerAttributes, LineOrder, MetaData, ReadChannels, ReadLayers, Text, Vec2, WritableImage, f16,
};
use exr::prelude::{Blocks, SmallVec};

use crate::atomic::write_atomic;
use crate::budget;
use crate::error::{FormatError, Result, quoted};
use crate::finite;

/// Larger images are refused; all channels of one hold 4 GB at most.
const MAX_PIXELS: u64 = 500_000_000;
const MAX_BYTES: u64 = 4 << 30;

/// Values of a channel, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "one variant per OpenEXR sample type")]
pub enum AovSamples {
    F16(Vec<f16>),
    F32(Vec<f32>),
    U32(Vec<u32>),
}

impl AovSamples {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::F16(v) => v.len(),
            Self::F32(v) => v.len(),
            Self::U32(v) => v.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A named channel.
#[derive(Clone, Debug, PartialEq)]
pub struct AovChannel {
    /// Name with its layer, such as `normal.X`.
    pub name: String,
    /// `height * width` values.
    pub samples: AovSamples,
}

impl AovChannel {
    /// A channel of half floats: enough for colors. What is beyond the largest, 65504, becomes that.
    pub fn half(name: impl Into<String>, values: &[f32]) -> Self {
        let most = f16::MAX.to_f32();
        let half = |v: &f32| f16::from_f32(if v.is_finite() { v.clamp(-most, most) } else { *v });
        let values = values.iter().map(half).collect();
        Self { name: name.into(), samples: AovSamples::F16(values) }
    }

    /// A channel of floats, for positions, depths and directions.
    pub fn float(name: impl Into<String>, values: Vec<f32>) -> Self {
        Self { name: name.into(), samples: AovSamples::F32(values) }
    }

    /// A channel of whole numbers, for ids.
    pub fn uint(name: impl Into<String>, values: Vec<u32>) -> Self {
        Self { name: name.into(), samples: AovSamples::U32(values) }
    }

    /// The values as f32; whole numbers beyond 2^24 are rounded.
    pub fn to_f32(&self) -> Vec<f32> {
        match &self.samples {
            AovSamples::F16(v) => v.iter().map(|x| x.to_f32()).collect(),
            AovSamples::F32(v) => v.clone(),
            AovSamples::U32(v) => v.iter().map(|x| *x as f32).collect(),
        }
    }
}

/// An image of named channels and its text attributes.
#[derive(Clone, Debug, PartialEq)]
pub struct AovImage {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Channels sorted by name.
    pub channels: Vec<AovChannel>,
    /// Text attributes of the file by name.
    pub attributes: BTreeMap<String, String>,
}

impl AovImage {
    /// The channel of this name.
    pub fn channel(&self, name: &str) -> Option<&AovChannel> {
        self.channels.iter().find(|channel| channel.name == name)
    }
}

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

fn encode_exr(
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

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Vec<AovChannel> {
        let values: Vec<f32> = (0..12).map(|i| i as f32 * 0.37 - 1.0).collect();
        vec![
            AovChannel::half("R", &values),
            AovChannel::float("depth.Z", values.clone()),
            AovChannel::float("deep.layer.name.that.is.longer.than.31.bytes.X", values),
            AovChannel::uint("object_id", (0..12).map(|i| u32::MAX - i).collect()),
        ]
    }

    #[test]
    fn channels_and_attributes_survive() {
        let attributes: Vec<(String, String)> =
            ["software", "owner", "comments", "capDate", "motes.run", "colorSpace"]
                .map(|name| (name.to_owned(), format!("wert é of {name}")))
                .to_vec();
        let bytes = encode_exr(Path::new("a.exr"), 4, 3, &sample(), &attributes).unwrap();
        let image = read_exr_from(&bytes, Path::new("a.exr")).unwrap();
        assert_eq!((image.width, image.height), (4, 3));
        assert_eq!(image.attributes, attributes.into_iter().collect());
        for channel in sample() {
            assert_eq!(image.channel(&channel.name), Some(&channel));
        }
    }

    #[test]
    fn the_name_of_a_part_is_a_layer_unless_it_is_empty() {
        for (part, expected) in [("", "R"), ("left", "left.R")] {
            let channels = [AovChannel::float("R", vec![1.0])];
            // The encoder lets nobody write the attribute by itself.
            let attributes = [("nom_".to_owned(), part.to_owned())];
            let mut bytes = encode_exr(Path::new("a"), 1, 1, &channels, &attributes).unwrap();
            let at = bytes.windows(5).position(|w| w == b"nom_\0").unwrap();
            bytes[at..at + 4].copy_from_slice(b"name");
            let read = read_exr_from(&bytes, Path::new("a")).unwrap();
            assert_eq!(read.channels[0].name, expected);
        }
    }

    #[test]
    fn the_same_image_has_the_same_bytes() {
        let attributes: Vec<(String, String)> =
            (0..20).map(|i| (format!("key{i}"), i.to_string())).collect();
        let encode = || encode_exr(Path::new("a.exr"), 4, 3, &sample(), &attributes).unwrap();
        let first = encode();
        // A hash map orders anew each time, by chance alike once in 20! runs.
        assert_eq!(first, encode());
    }
}
