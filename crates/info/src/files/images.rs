//! Pictures and images of named channels.

use std::path::Path;

use motes_formats::Result;
use motes_formats::exr_aov::{AovSamples, open_exr};

use crate::{Description, Kind, measure};

/// A picture of these columns and rows.
pub(super) fn describe_picture((width, height): (usize, usize), suffix: &str) -> Description {
    let mut found = Description::new(Kind::Picture, suffix);
    found.size_px = Some([width, height]);
    found
}

/// An OpenEXR image: channels with their type, text attributes as facts.
///
/// # Errors
/// It is broken.
pub(super) fn describe_exr(path: &Path) -> Result<Description> {
    let image = open_exr(path)?;
    let mut found = Description::new(Kind::Channels, "exr").count("channels", image.channels.len());
    found.size_px = Some([image.width, image.height]);
    let kind = |samples: &AovSamples| match samples {
        AovSamples::F16(_) => "half",
        AovSamples::F32(_) => "float",
        AovSamples::U32(_) => "uint",
    };
    let named = image.channels.iter().map(|c| format!("{} ({})", c.name, kind(&c.samples)));
    found.columns = named.collect();
    let bad = image.channels.iter().map(|channel| measure::non_finite(&channel.to_f32()));
    found.non_finite = Some(bad.sum());
    for (name, text) in &image.attributes {
        match name.as_str() {
            "software" | "Software" => found.made_by = Some(text.clone()),
            _ => found = found.fact(name, text.as_str()),
        }
    }
    Ok(found)
}
