//! What is measured: a made-up scene of any size, or a model with the views of a capture.

use std::path::Path;

use anyhow::{Context as _, bail};
use glam::DVec3;
use motes_formats::capture::read_capture;
use motes_formats::ply::read_gaussians;
use motes_math::rng::keyed_rng;
use motes_math::sh::sh_coefficients;
use motes_raster::ViewTransform;
use motes_scene::{Gaussians, Pinhole, Pose};
use rand::RngExt;

/// Gaussians and the views to draw.
pub(crate) struct Workload {
    pub(crate) name: String,
    pub(crate) gaussians: Gaussians,
    pub(crate) views: Vec<ViewTransform>,
}

/// Splats on a wavy sheet in front of the camera, as a trained surface lies: `count` of them with
/// a spacing of one standard deviation, over an image of `width × height`.
pub(crate) fn synthetic(count: usize, width: usize, height: usize) -> Workload {
    let mut rng = keyed_rng(1, 0xbe7c, count as u64);
    let mut uniform = move |low: f32, high: f32| low + (high - low) * rng.random::<f32>();
    let degree = 3;
    let mut g = Gaussians::empty(degree);
    let sigma = 2.0 / (count as f32).sqrt();
    for _ in 0..count {
        let (x, y) = (uniform(-1.2, 1.2), uniform(-1.0, 1.0));
        let z = 0.3 * (4.0 * x).sin() * (3.0 * y).cos() + uniform(-0.1, 0.1);
        g.means.push([x, y, z]);
        g.rotations.push(std::array::from_fn(|_| uniform(-1.0, 1.0) + 0.05));
        g.log_scales.push(std::array::from_fn(|_| sigma.ln() + uniform(-0.9, 0.6)));
        g.opacity_logits.push(uniform(-3.0, 3.0));
        for k in 0..sh_coefficients(degree) {
            let size = if k == 0 { 1.5 } else { 0.2 };
            g.sh.extend((0..3).map(|_| uniform(-size, size)));
        }
    }
    let focal = 1.2 * width as f64;
    let camera = Pinhole {
        fx: focal,
        fy: focal,
        cx: width as f64 / 2.0,
        cy: height as f64 / 2.0,
        width,
        height,
    };
    let pose = Pose::look_at(DVec3::new(0.2, -0.1, -2.8), DVec3::ZERO, -DVec3::Y)
        .unwrap_or(Pose::IDENTITY);
    let name = format!("synthetic {count} Gaussians, {width}x{height}");
    Workload { name, gaussians: g, views: vec![ViewTransform::new(&camera, &pose)] }
}

/// A model with the first `limit` views of a capture.
pub(crate) fn model(gaussians: &Path, capture: &Path, limit: usize) -> anyhow::Result<Workload> {
    let document = read_capture(capture).context("cannot read the capture")?;
    let mut views = Vec::new();
    for view in document.views.iter().take(limit) {
        let Some(pinhole) = document.cameras[view.camera].as_pinhole() else {
            bail!("view {} has no pinhole camera", view.name);
        };
        views.push(ViewTransform::new(&pinhole, &view.camera_from_world));
    }
    let gaussians = read_gaussians(gaussians).context("cannot read the Gaussians")?;
    let name = format!("model of {} Gaussians, {} views", gaussians.len(), views.len());
    Ok(Workload { name, gaussians, views })
}
