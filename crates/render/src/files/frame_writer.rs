//! Rendered frames as files.

use std::path::{Path, PathBuf};

use motes_formats::Result;
use motes_formats::exr_aov::{AovChannel, write_finite_exr};
use motes_formats::images::write_png;
use motes_raster::Rendering;

use crate::frames::{DepthRange, FrameFiles, depth_range, exr_channels, preview};

/// Text attributes of every EXR: what its values mean.
const EXR_ATTRIBUTES: [(&str, &str); 4] = [
    ("colorSpace", "linear Rec.709 / sRGB primaries, decoded from the sRGB-encoded rendering"),
    ("depthUnit", "world units along the camera z axis (panoramas: along the ray); 0 = nothing"),
    ("normalSpace", "world"),
    ("generator", concat!("motes ", env!("CARGO_PKG_VERSION"))),
];

/// Writes frames to a folder.
#[derive(Debug)]
pub struct FrameWriter {
    folder: PathBuf,
    files: FrameFiles,
    depth_range: Option<DepthRange>,
    /// Text attributes of EXR files beside the usual ones.
    pub attributes: Vec<(String, String)>,
}

impl FrameWriter {
    /// For a folder; `depth_range` scales depth previews, otherwise the first frame does, so that
    /// the colors of a video do not flicker.
    pub fn new(folder: &Path, files: FrameFiles, depth_range: Option<DepthRange>) -> Self {
        Self { folder: folder.to_owned(), files, depth_range, attributes: Vec::new() }
    }

    /// Whether depth and normals must be rendered.
    pub fn needs_aovs(&self) -> bool {
        self.files.need_aovs()
    }

    /// Writes the files of one frame: `name.png`, `name.exr`, `name.depth.png` and so on.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write(&mut self, name: &str, rendering: &Rendering) -> Result<()> {
        self.write_with(name, rendering, Vec::new())
    }

    /// Writes the files of one frame with further channels in its EXR.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write_with(
        &mut self,
        name: &str,
        rendering: &Rendering,
        more: Vec<AovChannel>,
    ) -> Result<()> {
        let path = |suffix: &str| self.folder.join(format!("{name}.{suffix}"));
        if self.files.png {
            write_png(&path("png"), &rendering.color.to_u8())?;
        }
        if self.files.exr {
            let mut attributes = EXR_ATTRIBUTES.map(|(k, v)| (k.to_owned(), v.to_owned())).to_vec();
            attributes.extend(self.attributes.iter().cloned());
            let mut channels = exr_channels(rendering);
            channels.extend(more);
            let (width, height) = (rendering.color.width, rendering.color.height);
            write_finite_exr(&path("exr"), width, height, &channels, &attributes)?;
        }
        self.depth_range = self.depth_range.or_else(|| depth_range(rendering));
        let range = self.depth_range.unwrap_or(DepthRange { near: 0.0, far: 1.0 });
        for &aov in &self.files.previews {
            if let Some(picture) = preview(rendering, aov, range) {
                write_png(&path(&format!("{}.png", aov.name())), &picture)?;
            }
        }
        Ok(())
    }
}
