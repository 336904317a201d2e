//! Depth and normals: scalar passes over the tile lists of a finished frame.

use glam::{Mat3, Quat, Vec3};
use motes_scene::{Gaussians, ImageF32};
use rayon::prelude::*;

use crate::binning::TileRow;
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
    let shapes = shapes(frame, gaussians, view);
    let pixels = per_pixel(view, |x, y, at| {
        composite(splats(frame.bins().list_at(x, y), &shapes), at, view, parameters)
    });
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

/// `[h, w, 1]`, `depth_median` of [`Aovs`] where the coverage is at least `least_alpha`, and 0 elsewhere. What lies behind the
/// pixel's answer is not looked at: half the time of all AOVs.
pub(crate) fn tile_depth_median(
    frame: &Frame,
    gaussians: &Gaussians,
    view: &ViewTransform,
    parameters: &RasterParameters,
    least_alpha: f32,
) -> ImageF32 {
    let [width, height] = view.size;
    let enough = (1.0 - least_alpha).min(0.5);
    let shapes = shapes(frame, gaussians, view);
    let depth = per_pixel(view, |x, y, at| {
        let (mut transmittance, mut depth) = (1.0f32, 0.0);
        for (s, shape) in splats(frame.bins().list_at(x, y), &shapes) {
            let Some(alpha) = s.alpha_at(at[0], at[1], parameters.exp_degree.into()) else {
                continue;
            };
            let next = transmittance - alpha * transmittance;
            if transmittance > 0.5 && next <= 0.5 {
                depth = shape.depth(ray(at, view), s.depth);
            }
            transmittance = next;
            if transmittance <= enough {
                return depth;
            }
        }
        0.0
    });
    ImageF32::from_data(width, height, 1, depth)
}

fn shapes(frame: &Frame, gaussians: &Gaussians, view: &ViewTransform) -> Vec<WorldShape> {
    (0..gaussians.len())
        .into_par_iter()
        .map(|i| match frame.projected()[i].is_visible() {
            true => WorldShape::new(gaussians, i, view),
            false => WorldShape::default(),
        })
        .collect()
}

/// The splats of a tile's list with their shapes, front to back.
fn splats<'a>(
    list: Option<(&'a TileRow, &'a [u32])>,
    shapes: &'a [WorldShape],
) -> impl Iterator<Item = (&'a Splat, &'a WorldShape)> {
    list.into_iter().flat_map(move |(row, entries)| {
        entries.iter().map(move |&e| {
            let id = row.ids[e as usize] as usize;
            (&row.splats[e as usize], &shapes[id])
        })
    })
}

/// What `of` makes of each pixel, of its column, its row and its center.
fn per_pixel<T: Send>(
    view: &ViewTransform,
    of: impl Fn(usize, usize, [f32; 2]) -> T + Sync,
) -> Vec<T> {
    let [width, height] = view.size;
    let row = |y: usize| (0..width).map(|x| of(x, y, [x as f32 + 0.5, y as f32 + 0.5])).collect();
    let rows: Vec<Vec<T>> = (0..height).into_par_iter().map(row).collect();
    rows.into_iter().flatten().collect()
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

/// Direction of a place on the image, camera frame, whose depth is 1.
fn ray(at: [f32; 2], view: &ViewTransform) -> Vec3 {
    let slope = |k: usize| (at[k] - view.principal[k]) / view.focal[k];
    Vec3::new(slope(0), slope(1), 1.0)
}

fn composite<'a>(
    splats: impl Iterator<Item = (&'a Splat, &'a WorldShape)>,
    [x, y]: [f32; 2],
    view: &ViewTransform,
    parameters: &RasterParameters,
) -> PixelAovs {
    let ray = ray([x, y], view);
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
