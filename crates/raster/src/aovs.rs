//! Depth and normals: scalar passes over the tile lists of a finished frame.

use glam::{Mat3, Quat, Vec3};
use motes_scene::{Gaussians, ImageF32};
use rayon::prelude::*;

use crate::frame::Frame;
use crate::options::BLUR_VARIANCE_PX2;
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
    let shapes: Vec<WorldShape> = (0..gaussians.len())
        .into_par_iter()
        .map(|i| match frame.projected()[i].is_visible() {
            true => WorldShape::new(gaussians, i, view),
            false => WorldShape::default(),
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
                            let id = row.ids[e as usize] as usize;
                            (&row.splats[e as usize], &shapes[id])
                        })
                    });
                    composite(splats, [x as f32 + 0.5, y as f32 + 0.5], view, parameters)
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

/// What a view shows of the shape of a Gaussian. The depth of its center would do for a small one; a wide one that is seen at a grazing
/// angle covers many depths.
#[derive(Clone, Copy, Default)]
struct WorldShape {
    /// Its shortest axis, turned toward the camera, world.
    normal: Vec3,
    /// From the camera frame to the axes of the Gaussian in units of its standard deviations.
    to_local: Mat3,
    /// Its center in those, from the camera.
    center: Vec3,
    /// Three of its largest standard deviations: depth changes by no more.
    reach: f32,
}

impl WorldShape {
    fn new(gaussians: &Gaussians, i: usize, view: &ViewTransform) -> Self {
        let [w, x, y, z] = gaussians.rotations[i];
        let axes = Mat3::from_quat(Quat::from_xyzw(x, y, z, w).normalize());
        let offset = view.offset_to(gaussians.means[i]);
        // Nothing is thinner than the blur of the picture.
        let pixel = view.rotation.row(2).dot(offset) / view.focal[0].max(view.focal[1]);
        let blur = BLUR_VARIANCE_PX2.sqrt() * pixel;
        let sigmas = Vec3::from(gaussians.log_scales[i]).exp().max(Vec3::splat(blur.max(1e-30)));
        let whiten = Mat3::from_diagonal(sigmas.recip()) * axes.transpose();
        Self {
            normal: facing_normal(axes, gaussians, i, view),
            to_local: whiten * view.rotation.transpose(),
            center: whiten * offset,
            reach: 3.0 * sigmas.max_element(),
        }
    }

    /// Depth at which a ray whose direction has depth 1 passes the densest point, near that of the center.
    fn depth(&self, ray: Vec3, center_depth: f32) -> f32 {
        let d = self.to_local * ray;
        let peak = d.dot(self.center) / d.length_squared();
        let (near, far) = (center_depth - self.reach, center_depth + self.reach);
        // What is around the camera has no depth but that of its center.
        if near > 0.0 && peak.is_finite() { peak.clamp(near, far) } else { center_depth }
    }
}

fn composite<'a>(
    splats: impl Iterator<Item = (&'a Splat, &'a WorldShape)>,
    [x, y]: [f32; 2],
    view: &ViewTransform,
    parameters: &RasterParameters,
) -> PixelAovs {
    let slope = |at: f32, k: usize| (at - view.principal[k]) / view.focal[k];
    let ray = Vec3::new(slope(x, 0), slope(y, 1), 1.0);
    let mut transmittance = 1.0f32;
    let (mut depth, mut weights, mut normal, mut median) = (0.0f32, 0.0f32, Vec3::ZERO, 0.0f32);
    for (s, shape) in splats {
        let Some(alpha) = s.alpha_at(x, y, parameters.exp_degree.into()) else {
            continue;
        };
        let weight = alpha * transmittance;
        let at = shape.depth(ray, s.depth);
        depth += weight * at;
        normal += weight * shape.normal;
        weights += weight;
        let next = transmittance - weight;
        if transmittance > 0.5 && next <= 0.5 {
            median = at;
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
fn facing_normal(axes: Mat3, gaussians: &Gaussians, i: usize, view: &ViewTransform) -> Vec3 {
    let s = gaussians.log_scales[i];
    let shortest = (1..3).fold(0, |best, k| if s[k] < s[best] { k } else { best });
    let normal = axes.col(shortest);
    let to_camera = view.center - Vec3::from(gaussians.means[i]);
    if normal.dot(to_camera) < 0.0 { -normal } else { normal }
}
