//! Points of the scene, and what the photos show of them.

use glam::Vec3;
use motes_math::median::upper_median;
use motes_math::srgb;
use motes_raster::{RenderOptions, render_depth_median};
use motes_scene::{Gaussians, Pinhole};
use rayon::prelude::*;

use crate::observation::{Photo, ViewRays};

/// Photos are looked at in about this size, long side in pixels: noise and small errors of the poses are averaged.
const LONG_SIDE: usize = 320;
/// Points, about, and photos from which on there are fewer: each point is looked up in all photos.
const POINTS: usize = 60_000;
const MANY_PHOTOS: usize = 50;
/// Photos that must show a point.
const LEAST_PHOTOS: usize = 3;
/// Opacity from which a pixel has a depth.
const ALPHA: f32 = 0.6;
/// A point is hidden where its depth is off by more than this share.
const SLACK: f32 = 0.015;
/// Neighbors that differ by more than this share of their mean are an edge.
const UNEVEN: f32 = 0.4;
/// Below this encoded value there is mostly noise.
const DARK: f32 = 0.04;

/// A point that no photo shows clipped.
pub(super) struct Point {
    position: Vec3,
    /// Photo, and the sRGB-encoded value that it shows.
    pub(super) shown: Vec<(u32, [f32; 3])>,
}

impl Point {
    /// Whether a channel is bright enough in all photos: leaving the dark ones out would make the others too dark.
    pub(super) fn is_told(&self, channel: usize) -> bool {
        self.shown.iter().all(|(_, value)| value[channel] > DARK)
    }
}

/// Points seen by three photos of one light or more.
pub(super) fn points_of(
    photos: &[Photo],
    gaussians: &Gaussians,
    render: &RenderOptions,
) -> Vec<Point> {
    let small: Vec<SmallPhoto> = photos
        .par_iter()
        .with_max_len(1)
        .map(|photo| SmallPhoto::of(photo, gaussians, render))
        .collect();
    let pixels: usize = small.iter().map(|s| s.depth.len()).sum();
    let wanted = POINTS * MANY_PHOTOS / photos.len().max(MANY_PHOTOS);
    let stride = (pixels / wanted.max(1)).max(1);
    let points = small.par_iter().enumerate().flat_map_iter(|(k, from)| {
        // Photos start at different pixels of the stride.
        let at = (k * 7919 % stride..from.depth.len()).step_by(stride);
        let small = &small;
        at.filter_map(move |i| point_at(from, i, small))
    });
    points.collect()
}

fn point_at(from: &SmallPhoto, i: usize, all: &[SmallPhoto]) -> Option<Point> {
    let position = from.place(i)?;
    let mut shown = Vec::new();
    for (k, photo) in all.iter().enumerate().filter(|(_, p)| p.light == from.light) {
        match photo.look(position) {
            Look::Value(value) => shown.push((k as u32, value.to_array().map(srgb::encode))),
            // The brighter photos of what is near white would be missing.
            Look::Clipped => return None,
            Look::Nothing => {}
        }
    }
    (shown.len() >= LEAST_PHOTOS).then_some(Point { position, shown })
}

/// Which points lie on one side of the scene: it is cut at the median of the axis along which points are spread most.
pub(super) fn sides(points: &[Point]) -> Vec<bool> {
    let count = points.len().max(1) as f32;
    let mean = points.iter().map(|p| p.position).sum::<Vec3>() / count;
    let spread: Vec3 = points.iter().map(|p| (p.position - mean).abs()).sum();
    let axis = (0..3).max_by(|&a, &b| spread[a].total_cmp(&spread[b])).unwrap_or(0);
    upper_half(points.iter().map(|p| p.position[axis]).collect())
}

/// Which points are the brighter half.
pub(super) fn bright(points: &[Point]) -> Vec<bool> {
    let brightness = |p: &Point| {
        let sum: f32 = p.shown.iter().map(|(_, value)| value.iter().sum::<f32>()).sum();
        sum / p.shown.len() as f32
    };
    upper_half(points.iter().map(brightness).collect())
}

fn upper_half(values: Vec<f32>) -> Vec<bool> {
    let middle = upper_median(&mut values.clone(), f32::total_cmp).unwrap_or(0.0);
    values.into_iter().map(|v| v >= middle).collect()
}

/// What a photo shows of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Look {
    Nothing,
    Clipped,
    /// Linear.
    Value(Vec3),
}

struct SmallPhoto {
    rays: ViewRays,
    light: usize,
    /// Camera z, world units; 0 for none.
    depth: Vec<f32>,
    looks: Vec<Look>,
}

impl SmallPhoto {
    fn of(photo: &Photo, gaussians: &Gaussians, render: &RenderOptions) -> Self {
        let full = &photo.camera;
        let step = full.width.max(full.height).div_ceil(LONG_SIDE).max(1);
        let share = 1.0 / step as f64;
        let camera = Pinhole {
            fx: full.fx * share,
            fy: full.fy * share,
            cx: full.cx * share,
            cy: full.cy * share,
            width: full.width / step,
            height: full.height / step,
        };
        let pose = &photo.camera_from_world;
        let depth = render_depth_median(gaussians, &camera, pose, render, ALPHA).data;
        let blocks = blocks(photo, [camera.width, camera.height], step);
        let looks = smoothed(&blocks, camera.width);
        Self { rays: ViewRays::of(&camera, pose), light: photo.light, depth, looks }
    }

    fn place(&self, i: usize) -> Option<Vec3> {
        let is_told = self.depth[i] > 0.0 && matches!(self.looks[i], Look::Value(_));
        is_told.then(|| self.rays.place(i, self.depth[i])).filter(|place| place.is_finite())
    }

    fn look(&self, position: Vec3) -> Look {
        let seen = self.rays.project(position);
        let seen = seen.and_then(|(x, y, z)| Some((self.rays.pixel(x, y)?, z)));
        match seen {
            Some((i, z)) if (self.depth[i] - z).abs() <= SLACK * z => self.looks[i],
            _ => Look::Nothing,
        }
    }
}

/// Means of blocks of `step` by `step` pixels.
fn blocks(photo: &Photo, [width, height]: [usize; 2], step: usize) -> Vec<Look> {
    let full = photo.camera.width;
    let block = |k: usize| {
        let (x, y) = (k % width * step, k / width * step);
        let mut sum = Vec3::ZERO;
        for row in y..y + step {
            for i in row * full + x..row * full + x + step {
                if !photo.usable[i] {
                    return if photo.is_clipped(i) { Look::Clipped } else { Look::Nothing };
                }
                sum += photo.radiance_linear.at(i);
            }
        }
        Look::Value(sum / (step * step) as f32)
    };
    (0..width * height).map(block).collect()
}

/// Means of three by three blocks; nothing at the border and where they differ much.
fn smoothed(blocks: &[Look], width: usize) -> Vec<Look> {
    let height = blocks.len() / width.max(1);
    let at = |i: usize| {
        let (x, y) = (i % width, i / width);
        if x == 0 || y == 0 || x + 1 >= width || y + 1 >= height {
            return Look::Nothing;
        }
        let (mut sum, mut low, mut high) = (Vec3::ZERO, f32::INFINITY, 0.0f32);
        for k in (y - 1..=y + 1).flat_map(|y| (x - 1..=x + 1).map(move |x| y * width + x)) {
            let Look::Value(value) = blocks[k] else { return blocks[k] };
            let brightness = value.element_sum();
            (low, high) = (low.min(brightness), high.max(brightness));
            sum += value;
        }
        let is_even = high - low <= UNEVEN * sum.element_sum() / 9.0;
        if is_even { Look::Value(sum / 9.0) } else { Look::Nothing }
    };
    (0..blocks.len()).map(at).collect()
}
