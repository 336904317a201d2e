//! How the world is seen: projection, background, SH degree.

use super::options::{FrameLook, Projection};
use motes_raster::{RenderOptions, Rendering, render, render_equirectangular};

use super::{Frame, FrameSize};
use crate::model::Model;

impl FrameLook {
    /// About how much memory the largest frame takes, bytes: planes, pictures and AOVs per pixel.
    pub fn memory_bytes(&self, frames: &[Frame], size: &FrameSize) -> u64 {
        const PER_PIXEL: u64 = 72;
        let pixels = match self.projection {
            Projection::Pinhole => {
                let area = |f: &Frame| f.camera.width as u64 * f.camera.height as u64;
                frames.iter().map(area).max().unwrap_or(0)
            }
            Projection::Equirect => {
                let (width, height) = size.panorama();
                // Six faces hold about two thirds more than the panorama.
                width as u64 * height as u64 * 8 / 3
            }
        };
        pixels * PER_PIXEL
    }

    /// Options of the rasterizer for a model.
    pub fn options(&self, model: &Model, aovs: bool) -> RenderOptions {
        RenderOptions {
            background: self.background.0,
            aovs,
            sh_degree_limit: self.sh_degree_limit,
            antialias: model.antialias,
            parameters: self.raster,
            ..RenderOptions::default()
        }
    }

    /// Renders one frame. Pinhole frames have their final size already.
    pub fn render(&self, model: &Model, frame: &Frame, size: &FrameSize, aovs: bool) -> Rendering {
        let options = self.options(model, aovs);
        let (gaussians, pose) = (&model.gaussians, &frame.camera_from_world);
        let mut rendering = match self.projection {
            Projection::Pinhole => render(gaussians, &frame.camera, pose, &options),
            Projection::Equirect => {
                let (width, height) = size.panorama();
                render_equirectangular(gaussians, pose, width, height, &options)
            }
        };
        let gain = model.gain(self.view_exposure, frame.exposure_stops);
        rendering.color = rendering.color.scaled(gain);
        rendering
    }
}
