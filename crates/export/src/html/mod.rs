//! One self-contained HTML file that draws a splat from `file://` with no network.
//!
//! - [`ViewerPage`]: what the page shows; [`ViewerPage::write`] is the page.
//! - [`pack`]: the Gaussians, quantized and compressed, as the page's scripts read them.
//! - `viewer/`: the page itself, plain JavaScript and GLSL without third-party code.
//!
//! `docs/formats/html-page.md` has the layout of the data, `docs/benchmarks/export.md` what it loses.

mod manifest;
mod options;
pub mod pack;
mod page;
mod start;

#[cfg(test)]
mod tests;

use motes_raster::Antialias;
use motes_scene::{Gaussians, Pinhole, Pose};
use motes_shading::environment::Harmonics;

pub use options::PackOptions;
pub use page::{HtmlSummary, PageParts, ServedPage, SplatSummary};

/// A splat on the page.
#[derive(Clone, Copy, Debug)]
pub struct ViewerSplat<'a> {
    /// Any number of Gaussians; material columns are shown when all of them are there.
    pub gaussians: &'a Gaussians,
    /// The footprint to draw it with.
    pub antialias: Antialias,
}

/// A photo with its camera.
#[derive(Clone, Debug)]
pub struct ViewerPhoto {
    /// As people know it.
    pub name: String,
    /// Of the embedded picture.
    pub camera: Pinhole,
    /// Width and height of the view in the capture.
    pub size: [usize; 2],
    /// World to camera.
    pub camera_from_world: Pose,
    /// The bytes of a JPEG file.
    pub jpeg: Vec<u8>,
}

/// A light that the page can turn.
#[derive(Clone, Debug)]
pub struct ViewerLight {
    /// As people know it.
    pub name: String,
    /// Radiance in photo units, world axes.
    pub harmonics: Harmonics,
}

/// Everything that one page shows.
#[derive(Clone, Debug)]
pub struct ViewerPage<'a> {
    /// Title of the page.
    pub title: String,
    /// What it shows first.
    pub splat: ViewerSplat<'a>,
    /// What it can be compared with.
    pub other: Option<ViewerSplat<'a>>,
    /// Photos to compare with; the first one's camera is where the page starts.
    pub photos: Vec<ViewerPhoto>,
    /// Lights for the mode `relit`, which needs materials.
    pub lights: Vec<ViewerLight>,
    /// Turns of the camera and of the light are about it; any length above 0.
    pub up_in_world: glam::DVec3,
    /// Behind the Gaussians, sRGB-encoded.
    pub background: [f32; 3],
}
