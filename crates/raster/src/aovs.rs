//! Depth and normals: scalar passes over the tile lists of a finished frame.

use glam::{Mat3, Quat, Vec3};
use motes_scene::{Gaussians, ImageF32};
use rayon::prelude::*;

use crate::frame::Frame;
use crate::parameters::RasterParameters;
use crate::render::Aovs;
use crate::splat::Splat;
use crate::view::ViewTransform;

/// Depths and normals of the last forward pass of `frame`.
pub(crate) fn tile_aovs(
    frame: &Frame,
    gaussians: &Gaussians,
    view: &ViewTransform,
    parameters: &RasterParameters,
) -> Aovs {
    let [width, height] = view.size;
    let normals: Vec<Vec3> = (0..gaussians.len())
        .into_par_iter()
        .map(|i| match frame.projected()[i].is_visible() {
            true => facing_normal(gaussians, i, view),
            false => Vec3::ZERO,
        })
        .collect();
    let rows: Vec<Vec<PixelAovs>> = (0..height)
        .into_par_iter()
        .map(|y| {
            (0..width)
                .map(|x| {
                    let list = frame.bins().list_at(x, y);
                    let splats = list.iter().flat_map(|(row, entries)| {
                        entries.iter().map(|&e| {
                            (&row.splats[e as usize], normals[row.ids[e as usize] as usize])
                        })
                    });
                    composite(splats, x as f32 + 0.5, y as f32 + 0.5, parameters)
                })
                .collect()
        })
        .collect();
    let pixels: Vec<PixelAovs> = rows.into_iter().flatten().collect();
    let plane = |f: &dyn Fn(&PixelAovs) -> f32| {
        ImageF32::from_data(width, height, 1, pixels.iter().map(f).collect())
    };
    let normal = pixels.iter().flat_map(|p| p.normal.to_array()).collect();
    Aovs {
        depth_expected: plane(&|p| p.depth_expected),
        depth_median: plane(&|p| p.depth_median),
        normal_in_world: ImageF32::from_data(width, height, 3, normal),
    }
}

struct PixelAovs {
    depth_expected: f32,
    depth_median: f32,
    normal: Vec3,
}

fn composite<'a>(
    splats: impl Iterator<Item = (&'a Splat, Vec3)>,
    x: f32,
    y: f32,
    parameters: &RasterParameters,
) -> PixelAovs {
    let mut transmittance = 1.0f32;
    let (mut depth, mut weights, mut normal, mut median) = (0.0f32, 0.0f32, Vec3::ZERO, 0.0f32);
    for (s, n) in splats {
        let Some(alpha) = s.alpha_at(x, y, parameters.exp_degree.into()) else {
            continue;
        };
        let weight = alpha * transmittance;
        depth += weight * s.depth;
        normal += weight * n;
        weights += weight;
        let next = transmittance - weight;
        if transmittance > 0.5 && next <= 0.5 {
            median = s.depth;
        }
        transmittance = next;
        if transmittance < parameters.transmittance_min {
            break;
        }
    }
    let depth_expected = if weights > 0.0 { depth / weights } else { 0.0 };
    PixelAovs { depth_expected, depth_median: median, normal: normal.normalize_or_zero() }
}

/// The shortest axis of a Gaussian, turned toward the camera.
fn facing_normal(gaussians: &Gaussians, i: usize, view: &ViewTransform) -> Vec3 {
    let [w, x, y, z] = gaussians.rotations[i];
    let axes = Mat3::from_quat(Quat::from_xyzw(x, y, z, w).normalize());
    let s = gaussians.log_scales[i];
    let shortest = (1..3).fold(0, |best, k| if s[k] < s[best] { k } else { best });
    let normal = axes.col(shortest);
    let to_camera = view.center - Vec3::from(gaussians.means[i]);
    if normal.dot(to_camera) < 0.0 { -normal } else { normal }
}
