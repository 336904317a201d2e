//! Multi-channel OpenEXR images: what a renderer knows about every pixel.
//!
//! `docs/formats/exr-aov.md` names the channels. A layer is the part of a channel's name before
//! the last dot: `depth.Z`, `normal.X`.

mod read;
mod write;

use std::collections::BTreeMap;

use exr::prelude::f16;

pub use read::{open_exr, read_exr, read_exr_from};
pub use write::{write_exr, write_finite_exr};

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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::write::encode_exr;
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
