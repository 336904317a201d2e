//! What the page's scripts know besides the packed Gaussians. Field names are those of `viewer.js`.

use motes_raster::Antialias;
use motes_scene::Pinhole;
use serde::Serialize;

use super::pack::Packed;
use super::{ViewerLight, ViewerPhoto};

#[derive(Serialize)]
pub(super) struct Manifest {
    pub(super) splats: Vec<SplatEntry>,
    pub(super) photos: Vec<PhotoEntry>,
    pub(super) lights: Vec<LightEntry>,
    pub(super) up: [f64; 3],
    pub(super) center: [f64; 3],
    pub(super) start: StartEntry,
    pub(super) background: [f32; 3],
}

#[derive(Serialize)]
pub(super) struct SplatEntry {
    count: usize,
    sh_degree: u8,
    mip: bool,
    materials: bool,
    objects: bool,
    log_scale_range: [f32; 2],
    dc_low: [f32; 3],
    dc_extent: [f32; 3],
    sh_range: [f32; 3],
}

#[derive(Serialize)]
pub(super) struct PhotoEntry {
    name: String,
    pinhole: PinholeEntry,
    /// Width and height of the view in the capture, whose pixels prompts name.
    size: [usize; 2],
    eye: [f64; 3],
    /// Right, down and forward in world.
    rotation: [[f64; 3]; 3],
}

#[derive(Serialize)]
pub(super) struct PinholeEntry {
    width: usize,
    height: usize,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
}

#[derive(Serialize)]
pub(super) struct LightEntry {
    name: String,
    /// 25 coefficients, RGB.
    harmonics: Vec<f64>,
}

/// Where the page starts when there is no photo.
#[derive(Serialize)]
pub(super) struct StartEntry {
    pub(super) eye: [f64; 3],
    pub(super) pinhole: PinholeEntry,
}

impl SplatEntry {
    pub(super) fn new(packed: &Packed, antialias: Antialias) -> Self {
        Self {
            count: packed.count,
            sh_degree: packed.sh_degree,
            mip: antialias == Antialias::Mip,
            materials: packed.materials,
            objects: packed.objects,
            log_scale_range: packed.log_scale_range,
            dc_low: packed.dc_low,
            dc_extent: packed.dc_extent,
            sh_range: packed.sh_range,
        }
    }
}

impl PhotoEntry {
    pub(super) fn new(photo: &ViewerPhoto) -> Self {
        let rotation = photo.camera_from_world.rotation_matrix();
        Self {
            name: photo.name.clone(),
            pinhole: PinholeEntry::new(&photo.camera),
            size: photo.size,
            eye: photo.camera_from_world.center_in_world().to_array(),
            rotation: [0, 1, 2].map(|k| rotation.row(k).to_array()),
        }
    }
}

impl PinholeEntry {
    pub(super) fn new(p: &Pinhole) -> Self {
        let Pinhole { fx, fy, cx, cy, width, height } = *p;
        Self { width, height, fx, fy, cx, cy }
    }
}

impl LightEntry {
    pub(super) fn new(light: &ViewerLight) -> Self {
        let harmonics = light.harmonics.iter().flat_map(|c| c.to_array()).collect();
        Self { name: light.name.clone(), harmonics }
    }
}
