//! How each photo becomes pixels of a pinhole: decided once per camera and photo size.

use std::collections::HashMap;

use glam::DVec3;
use motes_scene::{Camera, Pinhole};

use crate::options::PhotoSize;
use crate::panorama;
use crate::undistort::PhotoCamera;

/// The way from a photo to the image of the capture.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) source: PhotoCamera,
    /// Intrinsics of the output image.
    pub(crate) pinhole: Pinhole,
    pub(crate) kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Pixels stay as they are.
    Copy,
    /// The whole photo is resized; it has no distortion.
    Resize,
    /// Pixels move.
    Undistort,
    /// Crops of a panorama.
    Panorama,
}

impl Plan {
    /// Position in the photo, pixels, that an output pixel position shows. `crop` counts only
    /// for panoramas.
    pub(crate) fn source_pixel(&self, crop: usize, u: f64, v: f64) -> Option<[f64; 2]> {
        let p = &self.pinhole;
        let mut ray = DVec3::new((u - p.cx) / p.fx, (v - p.cy) / p.fy, 1.0);
        if self.kind == Kind::Panorama {
            ray = panorama::direction_in_panorama(crop, ray);
        }
        Some(self.source.pixel_from_direction(ray)?.to_array())
    }
}

/// Plans by camera and photo size, in order of first use.
pub(crate) struct Plans {
    keep_border: bool,
    size: PhotoSize,
    pub(crate) plans: Vec<Plan>,
    index: HashMap<Key, usize>,
    /// Sentences about cameras that could not be kept whole.
    pub(crate) warnings: Vec<String>,
}

/// Everything that the plan depends on, floats by their bits.
type Key = (u32, [usize; 4], Vec<u64>);

impl Plans {
    pub(crate) fn new(keep_border: bool, size: PhotoSize) -> Self {
        Self { keep_border, size, plans: Vec::new(), index: HashMap::new(), warnings: Vec::new() }
    }

    /// Index of the plan for a camera and a photo size, or why there is none.
    pub(crate) fn plan_for(
        &mut self,
        camera: &Camera,
        width: usize,
        height: usize,
    ) -> Result<usize, String> {
        let bits = camera.params.iter().map(|p| p.to_bits()).collect();
        let key = (camera.model.id(), [camera.width, camera.height, width, height], bits);
        if let Some(&index) = self.index.get(&key) {
            return Ok(index);
        }
        let source = PhotoCamera::new(camera.clone(), width, height).ok_or_else(|| {
            format!(
                "the photo has {width} x {height} pixels and its camera {} x {}: it is turned, cropped or another photo",
                camera.width, camera.height
            )
        })?;
        if !source.is_model_size() {
            self.warnings.push(format!(
                "photos of {width} x {height} pixels use a camera of {} x {}; its intrinsics were scaled",
                camera.width, camera.height
            ));
        }
        let (full, mut kind) = if panorama::is_panorama(camera) {
            (panorama::crop_pinhole(width), Kind::Panorama)
        } else if let Some(pinhole) = source.as_pinhole() {
            (pinhole, Kind::Copy)
        } else {
            let (pinhole, capped) = source.undistorted(self.keep_border)?;
            if capped {
                self.warnings.push(format!(
                    "the {} camera of {width} x {height} pixels sees more than a pinhole can show; \
                     what lies more than 60 degrees from its axis was cut off",
                    camera.model.name()
                ));
            }
            (pinhole, Kind::Undistort)
        };
        let pinhole = downscaled(&full, self.size);
        if kind == Kind::Copy && pinhole != full {
            kind = Kind::Resize;
        }
        self.plans.push(Plan { source, pinhole, kind });
        self.index.insert(key, self.plans.len() - 1);
        Ok(self.plans.len() - 1)
    }
}

/// The camera of photos that are made smaller.
fn downscaled(full: &Pinhole, size: PhotoSize) -> Pinhole {
    let scale = size.scale(full.width.max(full.height) as f64);
    if scale >= 1.0 {
        return *full;
    }
    let side = |pixels: usize| ((pixels as f64 * scale).round() as usize).max(1);
    full.resized(side(full.width), side(full.height))
}
