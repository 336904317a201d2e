//! What is known of a view before anything is asked: superpixels, their geometry, the edges between
//! them and the Gaussians that they are made of.

use glam::{DVec3, Vec3};
use motes_math::median::upper_median;
use motes_raster::{LabelVotes, RenderOptions, label_votes, render};
use motes_scene::{Gaussians, ImageF32, Pinhole, Pose};

use crate::color::lab_from_srgb;
use crate::superpixels::{Pixels, superpixels};

/// Side of a superpixel, pixels. Smaller ones follow edges more closely and cost more.
pub const SUPERPIXEL_PX: usize = 9;

/// Contributions below this share of a pixel, summed over a superpixel, are forgotten: they are a
/// third of the entries and less than 1 % of the light.
const LEAST_VOTE: f32 = 0.02;

/// A superpixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Segment {
    /// Middle, pixels.
    pub center_px: [f32; 2],
    /// Pixels.
    pub area_px: f32,
    /// Mean color, CIE L*a*b*.
    pub lab: [f32; 3],
    /// Middle in world; meaningless where `width` is 0.
    pub point: [f32; 3],
    /// Unit, world, toward the camera.
    pub normal: [f32; 3],
    /// Side in world units; 0 where nothing was drawn.
    pub width: f32,
    /// `1 / z = a u + b v + c` with `u = (x - cx) / fx`, `v = (y - cy) / fy`.
    pub inverse_depth: [f32; 3],
}

/// Two superpixels that touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Border {
    /// Superpixels, the smaller first.
    pub segments: [u32; 2],
    /// Pixels of border.
    pub length_px: f32,
    /// Middle of the border, pixels.
    pub at_px: [f32; 2],
}

/// A view, prepared.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewData {
    /// Intrinsics at the working size.
    pub camera: Pinhole,
    /// Pose.
    pub camera_from_world: Pose,
    /// Superpixel per pixel.
    pub labels: Vec<u32>,
    /// Median depth per pixel, camera z, world units; 0 where nothing is.
    pub depth: Vec<f32>,
    /// Superpixels.
    pub segments: Vec<Segment>,
    /// Neighbors in the image.
    pub borders: Vec<Border>,
    /// Gaussians per superpixel.
    pub votes: LabelVotes,
}

impl ViewData {
    /// Prepares a view. `photo` is sRGB-encoded, of the camera's size; the rendering stands in for it.
    ///
    /// # Panics
    /// When the photo has another size or no three channels.
    pub fn new(
        gaussians: &Gaussians,
        camera: &Pinhole,
        camera_from_world: &Pose,
        photo: Option<&ImageF32>,
        options: &RenderOptions,
    ) -> Self {
        let options = RenderOptions { aovs: true, ..options.clone() };
        let rendering = render(gaussians, camera, camera_from_world, &options);
        let color = photo.unwrap_or(&rendering.color);
        assert_eq!((color.width, color.height, color.channels), (camera.width, camera.height, 3));
        let lab: Vec<[f32; 3]> =
            color.data.chunks_exact(3).map(|c| lab_from_srgb([c[0], c[1], c[2]])).collect();
        let depth = match &rendering.aovs {
            Some(aovs) => median_3x3(&aovs.depth_median.data, camera.width, camera.height),
            None => Vec::new(),
        };
        let normal = normals(&depth, camera);
        let pixels = Pixels {
            width: camera.width,
            height: camera.height,
            lab: &lab,
            depth: &depth,
            normal: &normal,
            focal: camera.fx as f32,
        };
        let (labels, count) = superpixels(&pixels, SUPERPIXEL_PX);
        let segments = segments(&labels, count, &pixels, camera, camera_from_world);
        let votes = label_votes(
            gaussians,
            camera,
            camera_from_world,
            &RenderOptions { aovs: false, ..options },
            &labels,
            count,
            LEAST_VOTE,
        );
        let borders = borders(&labels, camera.width);
        let (camera, camera_from_world) = (*camera, *camera_from_world);
        Self { camera, camera_from_world, labels, depth, segments, borders, votes }
    }

    /// The superpixel at a pixel of the working size.
    pub fn segment_at(&self, x: f64, y: f64) -> Option<u32> {
        let inside =
            x >= 0.0 && y >= 0.0 && x < self.camera.width as f64 && y < self.camera.height as f64;
        inside.then(|| self.labels[y as usize * self.camera.width + x as usize])
    }

    /// Depth at a pixel of the working size, 0 where nothing is; `None` outside the picture.
    pub(crate) fn depth_at(&self, x: f64, y: f64) -> Option<f32> {
        self.segment_at(x, y).map(|_| self.depth[y as usize * self.camera.width + x as usize])
    }

    /// Pixel and depth of a world point; `None` behind the camera.
    pub fn project(&self, point: Vec3) -> Option<([f64; 2], f64)> {
        let p = self.camera_from_world.transform_point(point.as_dvec3());
        let c = &self.camera;
        (p.z > 1e-9).then(|| ([c.fx * p.x / p.z + c.cx, c.fy * p.y / p.z + c.cy], p.z))
    }

    /// The world point that is seen at a pixel of the working size.
    pub fn point_at(&self, x: f64, y: f64) -> Option<DVec3> {
        let index = self.segment_at(x, y).map(|_| y as usize * self.camera.width + x as usize)?;
        let z = f64::from(self.depth[index]);
        let c = &self.camera;
        let p = DVec3::new((x - c.cx) / c.fx * z, (y - c.cy) / c.fy * z, z);
        (z > 0.0).then(|| self.camera_from_world.inverse().transform_point(p))
    }

    /// Depth of the plane of a superpixel at a pixel; `None` where it is unbounded.
    pub fn plane_depth(&self, segment: u32, [x, y]: [f32; 2]) -> Option<f32> {
        let c = &self.camera;
        let [a, b, k] = self.segments[segment as usize].inverse_depth;
        let (u, v) = ((x - c.cx as f32) / c.fx as f32, (y - c.cy as f32) / c.fy as f32);
        let inverse = a * u + b * v + k;
        (inverse > 1e-12).then(|| 1.0 / inverse)
    }
}

/// Median of each pixel's surroundings: single Gaussians that stick out are not a surface.
fn median_3x3(values: &[f32], w: usize, h: usize) -> Vec<f32> {
    let at = |p: usize| {
        let (x, y) = (p % w, p / w);
        let mut around = [0.0; 9];
        let mut n = 0;
        for yy in y.saturating_sub(1)..(y + 2).min(h) {
            for xx in x.saturating_sub(1)..(x + 2).min(w) {
                around[n] = values[yy * w + xx];
                n += 1;
            }
        }
        around[..n].sort_by(f32::total_cmp);
        around[n / 2]
    };
    (0..values.len()).map(at).collect()
}

/// Normals in the camera frame, from depths a few pixels apart; 0 where something is missing.
fn normals(depth: &[f32], camera: &Pinhole) -> Vec<[f32; 3]> {
    const STEP: usize = 3;
    let (w, h) = (camera.width, camera.height);
    let point = |x: usize, y: usize| {
        let z = depth[y * w + x];
        let u = (x as f32 + 0.5 - camera.cx as f32) / camera.fx as f32;
        let v = (y as f32 + 0.5 - camera.cy as f32) / camera.fy as f32;
        (z > 0.0).then(|| Vec3::new(u * z, v * z, z))
    };
    (0..w * h)
        .map(|p| {
            let (x, y) = (p % w, p / w);
            let (left, right) = (x.saturating_sub(STEP), (x + STEP).min(w - 1));
            let (up, down) = (y.saturating_sub(STEP), (y + STEP).min(h - 1));
            match (point(left, y), point(right, y), point(x, up), point(x, down)) {
                (Some(l), Some(r), Some(u), Some(d)) => {
                    (d - u).cross(r - l).normalize_or_zero().to_array()
                }
                _ => [0.0; 3],
            }
        })
        .collect()
}

fn segments(
    labels: &[u32],
    count: usize,
    pixels: &Pixels<'_>,
    camera: &Pinhole,
    camera_from_world: &Pose,
) -> Vec<Segment> {
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); count];
    for (p, &label) in labels.iter().enumerate() {
        members[label as usize].push(p as u32);
    }
    let world_from_camera = camera_from_world.inverse();
    let rotation = world_from_camera.rotation_matrix();
    members
        .iter()
        .map(|members| {
            let n = members.len().max(1) as f32;
            let (mut center, mut lab) = ([0.0f32; 2], [0.0f32; 3]);
            let mut depths = Vec::with_capacity(members.len());
            for &p in members {
                let p = p as usize;
                center[0] += (p % camera.width) as f32 + 0.5;
                center[1] += (p / camera.width) as f32 + 0.5;
                (0..3).for_each(|k| lab[k] += pixels.lab[p][k]);
                depths.push(pixels.depth[p]);
            }
            let center_px = center.map(|v| v / n);
            let mut segment =
                Segment { center_px, area_px: n, lab: lab.map(|v| v / n), ..Segment::default() };
            let median = upper_median(&mut depths, f32::total_cmp).unwrap_or(0.0);
            if !(median > 0.0) {
                return segment;
            }
            let u = (f64::from(center_px[0]) - camera.cx) / camera.fx;
            let v = (f64::from(center_px[1]) - camera.cy) / camera.fy;
            let [a, b, c] = fit_inverse_depth(members, median, pixels.depth, camera);
            let inverse = a * u + b * v + c;
            let z = if inverse > 0.0 { 1.0 / inverse } else { f64::from(median) };
            let point = world_from_camera.transform_point(DVec3::new(u * z, v * z, z));
            segment.point = point.as_vec3().to_array();
            let normal = -(rotation * DVec3::new(a, b, c)).normalize_or_zero();
            segment.normal = normal.as_vec3().to_array();
            segment.width = (f64::from(n.sqrt()) * z / camera.fx) as f32;
            segment.inverse_depth = [a as f32, b as f32, c as f32];
            segment
        })
        .collect()
}

/// The plane of a superpixel as inverse depth over the image, least squares without outliers.
fn fit_inverse_depth(members: &[u32], median: f32, depth: &[f32], camera: &Pinhole) -> [f64; 3] {
    // Within a superpixel even a grazing plane changes little; more is another surface.
    const OUTLIER: f32 = 0.04;
    let flat = [0.0, 0.0, 1.0 / f64::from(median)];
    let (mut matrix, mut right) = ([[0.0f64; 3]; 3], [0.0f64; 3]);
    let mut used = 0;
    for &p in members {
        let z = depth[p as usize];
        if !(z > 0.0 && (z - median).abs() <= OUTLIER * median) {
            continue;
        }
        let (x, y) = (p as usize % camera.width, p as usize / camera.width);
        let row = [
            (x as f64 + 0.5 - camera.cx) / camera.fx,
            (y as f64 + 0.5 - camera.cy) / camera.fy,
            1.0,
        ];
        let value = 1.0 / f64::from(z);
        for i in 0..3 {
            (0..3).for_each(|k| matrix[i][k] += row[i] * row[k]);
            right[i] += row[i] * value;
        }
        used += 1;
    }
    if used < 8 {
        return flat;
    }
    // A slope nobody saw stays small: half a pixel's spread of position as prior.
    let prior = f64::from(used) * (0.5 / camera.fx).powi(2);
    matrix[0][0] += prior;
    matrix[1][1] += prior;
    let solved = glam::DMat3::from_cols_array_2d(&matrix);
    if !(solved.determinant().abs() > 0.0) {
        return flat;
    }
    let solution = (solved.inverse() * DVec3::from_array(right)).to_array();
    if solution.iter().all(|v| v.is_finite()) { solution } else { flat }
}

fn borders(labels: &[u32], width: usize) -> Vec<Border> {
    let mut pairs: Vec<(u64, [f32; 2])> = Vec::new();
    for (p, &a) in labels.iter().enumerate() {
        let (x, y) = (p % width, p / width);
        let right = (x + 1 < width).then(|| (p + 1, [x as f32 + 1.0, y as f32 + 0.5]));
        let below =
            (p + width < labels.len()).then(|| (p + width, [x as f32 + 0.5, y as f32 + 1.0]));
        for (q, at) in [right, below].into_iter().flatten() {
            let b = labels[q];
            if a != b {
                pairs.push((u64::from(a.min(b)) << 32 | u64::from(a.max(b)), at));
            }
        }
    }
    pairs.sort_by_key(|pair| pair.0);
    pairs
        .chunk_by(|a, b| a.0 == b.0)
        .map(|run| {
            let n = run.len() as f32;
            let sum = |k: usize| run.iter().map(|r| r.1[k]).sum::<f32>() / n;
            Border {
                segments: [(run[0].0 >> 32) as u32, run[0].0 as u32],
                length_px: n,
                at_px: [sum(0), sum(1)],
            }
        })
        .collect()
}
