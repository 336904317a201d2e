//! What a writer may be asked for.

use clap::ValueEnum;
use motes_formats::ply::RenderMode;
use motes_scene::ExposureResponse;
use serde::Serialize;

/// Options of all formats.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SplatWriteOptions {
    /// How the Gaussians want to be splatted.
    pub render_mode: Option<RenderMode>,
    /// How the brightness of photos follows their metadata.
    pub exposure_response: Option<ExposureResponse>,
    /// Comments, where the format has them.
    pub comments: Vec<String>,
    /// For PLY.
    pub layout: PlyLayout,
    /// For spz.
    pub spz: SpzOptions,
    /// For SOG.
    pub sog: SogOptions,
}

impl SplatWriteOptions {
    /// Lines that a PLY header of another layout gets.
    pub(crate) fn ply_comments(&self) -> Vec<String> {
        let mode = self.render_mode.map(|mode| format!("SplatRenderMode: {}", mode.name()));
        let comments = self.comments.iter().cloned().chain(mode);
        comments.map(|text| text.replace(char::is_control, " ")).collect()
    }
}

/// Which relative of INRIA's PLY is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlyLayout {
    /// INRIA's columns and all others.
    #[default]
    Motes,
    /// INRIA's columns alone.
    Inria,
    /// INRIA's and those of Relightable3DGaussian.
    R3dg,
    /// INRIA's without `scale_2`: each Gaussian loses its thinnest axis, which becomes its local z.
    #[value(name = "2dgs")]
    #[serde(rename = "2dgs")]
    Flat,
}

/// Options of spz.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpzOptions {
    /// 2, 3 or 4. Every reader knows 2 and 3.
    pub version: u8,
    /// Bits of a coordinate after the binary point, at most 23; without it 12, more in small scenes, fewer
    /// in huge ones.
    pub fractional_bits: Option<u8>,
    /// Significant bits of harmonics of degree 1, 1 to 8.
    pub sh1_bits: u8,
    /// Significant bits of harmonics of higher degrees, 1 to 8.
    pub sh_rest_bits: u8,
}

impl Default for SpzOptions {
    fn default() -> Self {
        // As the format's own writer.
        Self { version: 3, fractional_bits: None, sh1_bits: 5, sh_rest_bits: 4 }
    }
}

/// Options of SOG.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SogOptions {
    /// Rounds of k-means for the palette of harmonics.
    pub iterations: u32,
    /// Groups of the palette that each Gaussian looks through for its nearest entry.
    pub probes: usize,
    /// Entries of the palette, at most 65536; without it as many as other writers take.
    pub palette: Option<u32>,
    /// Seed of the palette.
    pub seed: u64,
}

impl Default for SogOptions {
    fn default() -> Self {
        Self { iterations: 6, probes: 4, palette: None, seed: 0 }
    }
}
