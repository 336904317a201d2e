//! One way out.

use std::borrow::Cow;
use std::io::Write;
use std::path::Path;

use motes_scene::{ExposureResponse, Gaussians};

use super::SplatFormat;
use super::ply::PlyLayout;
use super::sog::SogOptions;
use super::spz::SpzOptions;
use motes_formats::atomic::write_checked;
use motes_formats::error::{FormatError, Result};
use motes_formats::finite;
use motes_formats::ply::RenderMode;

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
    pub(super) fn ply_comments(&self) -> Vec<String> {
        let mode = self.render_mode.map(|mode| format!("SplatRenderMode: {}", mode.name()));
        let comments = self.comments.iter().cloned().chain(mode);
        comments.map(|text| text.replace(char::is_control, " ")).collect()
    }
}

/// Writes Gaussians. SH degrees that the format cannot hold are left out.
///
/// # Errors
/// Writing fails, a value is not finite, or the options ask for columns that the Gaussians do not have.
///
/// # Panics
/// When the arrays are not [consistent](Gaussians::is_consistent).
pub fn write_gaussians(
    path: &Path,
    format: SplatFormat,
    gaussians: &Gaussians,
    options: &SplatWriteOptions,
) -> Result<()> {
    finite::gaussians(path, gaussians)?;
    write_checked(path, |writer| write_gaussians_to(writer, format, gaussians, options, path))
}

/// Writes Gaussians to a stream; `name` stands for the file in errors.
///
/// # Errors
/// As [`write_gaussians`].
///
/// # Panics
/// As [`write_gaussians`].
pub fn write_gaussians_to(
    writer: &mut dyn Write,
    format: SplatFormat,
    gaussians: &Gaussians,
    options: &SplatWriteOptions,
    name: &Path,
) -> Result<()> {
    assert!(gaussians.is_consistent(), "arrays of different lengths");
    let codec = format.codec();
    let Some(write) = codec.write else {
        let cause = format!("{} is read, but not written", codec.name);
        return Err(FormatError::not_supported(name, "", cause));
    };
    let gaussians = if gaussians.sh_degree > codec.max_sh_degree {
        Cow::Owned(gaussians.with_sh_degree(codec.max_sh_degree))
    } else {
        Cow::Borrowed(gaussians)
    };
    write(writer, &gaussians, options, name)
}
