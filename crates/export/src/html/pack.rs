//! Gaussians to the records of the page: quantized, in Morton order, in compressed blocks.
//!
//! | part | stored | step |
//! |---|---|---|
//! | center | 16 bits per axis in the bounding box of 256 neighbors | box / 65535 |
//! | log scales | 12 bits between the smallest and the largest of all, at most 20 apart | ≤ 0.005 |
//! | opacity | 12 bits | 1 / 4095 |
//! | rotation | index of the largest component, 10 bits for each of the others | 0.0014 |
//! | SH band 0 | 11, 11, 10 bits between the channel's extremes | |
//! | SH bands 1 to 3 | 2 to 8 bits in a byte, `sign(q) q²` of the band's largest | |
//! | normal | octahedral (Meyer et al. 2010), 2 x 16 bits | |
//! | base color | 8 bits, sRGB-encoded | |
//! | roughness, metallic, visibility | 8 bits | |
//! | object | 16 bits | |
//!
//! A block is the boxes of its chunks, then the bytes of its records by significance (all first
//! bytes, all second bytes, …), which deflate compresses better.

pub use super::options::PackOptions;
use std::io::Write as _;

use flate2::Compression;
use flate2::write::DeflateEncoder;
use glam::Vec3;
use motes_math::sigmoid::sigmoid;
use motes_math::srgb;
use motes_raster::ALPHA_MIN;
use motes_scene::{ColumnValues, Gaussians, Materials};
use rayon::prelude::*;

/// Gaussians that share a bounding box.
pub const CHUNK: usize = 256;
/// Gaussians per compressed block.
pub const BLOCK: usize = 65_536;
/// Of the compression of a file: higher levels take much longer for a few percent.
const LEVEL: u32 = 7;
/// The page's harmonics end here.
pub const MAX_DEGREE: u8 = 3;
/// Scales more than this below the largest, natural logarithm, are raised to it: a millionth of a
/// pixel is no thinner than the blur of the projection.
const MAX_LOG_SCALE_RANGE: f32 = 20.0;
/// Band-0 coefficients beyond are clamped; colors are of the order of 1.
const MAX_DC: f32 = 16.0;
/// Likewise of the higher bands.
const MAX_REST: f32 = 8.0;

/// A splat as the page reads it.
#[derive(Clone, Debug)]
pub struct Packed {
    /// Gaussians that are kept.
    pub count: usize,
    /// Gaussians that no renderer shows: not finite, or fainter than a step of 8 bits.
    pub dropped: usize,
    /// Degree of the harmonics that are kept.
    pub sh_degree: u8,
    /// Natural logarithms that the steps 0 and 4095 stand for.
    pub log_scale_range: [f32; 2],
    /// Smallest coefficient of band 0 per channel.
    pub dc_low: [f32; 3],
    /// Largest minus smallest.
    pub dc_extent: [f32; 3],
    /// Largest coefficient of bands 1 to 3.
    pub sh_range: [f32; 3],
    /// Whether there are materials.
    pub materials: bool,
    /// Whether there is a column `object_id`.
    pub objects: bool,
    /// Rows of the Gaussians that are kept, in the order of the page.
    pub rows: Vec<u32>,
    /// Raw deflate streams of at most [`BLOCK`] Gaussians.
    pub blocks: Vec<Vec<u8>>,
    /// Median of the centers.
    pub center: [f32; 3],
    /// Radius round it that holds nine tenths of the centers.
    pub radius: f32,
}

/// Packs `gaussians`. The same bytes at any number of threads.
///
/// # Panics
/// When the arrays of the Gaussians do not belong together.
pub fn pack(gaussians: &Gaussians, options: &PackOptions) -> Packed {
    pack_at(gaussians, options, LEVEL)
}

/// [`pack`] with a level of compression, 1 (fast) to 9 (small).
///
/// # Panics
/// As [`pack`].
pub fn pack_at(gaussians: &Gaussians, options: &PackOptions, level: u32) -> Packed {
    assert!(gaussians.is_consistent(), "arrays of one length");
    let materials = Materials::of(gaussians).ok();
    let objects = object_ids(gaussians);
    let rows = morton_order(gaussians, drawable(gaussians));
    let degree = gaussians.sh_degree.min(MAX_DEGREE);
    let ranges = Ranges::new(gaussians, &rows, degree);
    // The largest step on each side of 0.
    let sh_steps = f32::from((1u8 << (options.html_sh_bits.clamp(2, 8) - 1)) - 1);
    let source =
        Source { gaussians, materials: materials.as_ref(), objects, degree, ranges, sh_steps };
    let blocks = rows.par_chunks(BLOCK).map(|rows| deflated(&source.block(rows), level)).collect();
    let (center, radius) = extent(gaussians, &rows);
    Packed {
        count: rows.len(),
        dropped: gaussians.len() - rows.len(),
        sh_degree: degree,
        log_scale_range: source.ranges.log_scale,
        dc_low: source.ranges.dc_low,
        dc_extent: source.ranges.dc_extent,
        sh_range: source.ranges.rest,
        materials: materials.is_some(),
        objects: source.objects.is_some(),
        blocks,
        rows,
        center,
        radius,
    }
}

/// Rows that can leave a mark on a picture.
fn drawable(gaussians: &Gaussians) -> Vec<u32> {
    let mut keep = vec![true; gaussians.len()];
    gaussians.invalid_rows().iter().for_each(|i| keep[*i as usize] = false);
    (0..gaussians.len() as u32)
        .filter(|&i| keep[i as usize] && sigmoid(gaussians.opacity_logits[i as usize]) >= ALPHA_MIN)
        .collect()
}

/// Along a curve through space, so that neighbors in the file are neighbors in the world.
fn morton_order(gaussians: &Gaussians, rows: Vec<u32>) -> Vec<u32> {
    let of = |i: u32| Vec3::from(gaussians.means[i as usize]);
    let (low, high) = rows
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), &i| (l.min(of(i)), h.max(of(i))));
    let extent = (high - low).as_dvec3().max(glam::DVec3::splat(f64::MIN_POSITIVE));
    let mut keyed: Vec<(u64, u32)> = rows
        .par_iter()
        .map(|&i| {
            let share = (of(i) - low).as_dvec3() / extent;
            // Casting saturates.
            let steps = (share * f64::from(1 << 21)).to_array().map(|v| (v as u64).min(0x1f_ffff));
            (spread(steps[0]) | spread(steps[1]) << 1 | spread(steps[2]) << 2, i)
        })
        .collect();
    keyed.par_sort_unstable();
    keyed.into_iter().map(|(_, i)| i).collect()
}

/// 21 bits, two zeros after each.
fn spread(v: u64) -> u64 {
    let v = (v | v << 32) & 0x001f_0000_0000_ffff;
    let v = (v | v << 16) & 0x001f_0000_ff00_00ff;
    let v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
    let v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
    (v | v << 2) & 0x1249_2492_4924_9249
}

/// What the smallest and the largest step stand for.
struct Ranges {
    log_scale: [f32; 2],
    dc_low: [f32; 3],
    dc_extent: [f32; 3],
    rest: [f32; 3],
}

impl Ranges {
    fn new(gaussians: &Gaussians, rows: &[u32], degree: u8) -> Self {
        let mut scale = [f32::INFINITY, f32::NEG_INFINITY];
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        let mut rest = [0.0f32; 3];
        for &i in rows {
            for s in gaussians.log_scales[i as usize] {
                scale = [scale[0].min(s), scale[1].max(s)];
            }
            let sh = gaussians.sh_of(i as usize);
            for c in 0..3 {
                let dc = sh[c].clamp(-MAX_DC, MAX_DC);
                (low[c], high[c]) = (low[c].min(dc), high[c].max(dc));
            }
            for band in 1..=degree as usize {
                let values = &sh[3 * band * band..3 * (band + 1) * (band + 1)];
                let largest = values.iter().fold(0.0f32, |a, v| a.max(v.abs()));
                rest[band - 1] = rest[band - 1].max(largest.min(MAX_REST));
            }
        }
        if rows.is_empty() {
            return Self { log_scale: [0.0, 1.0], dc_low: [0.0; 3], dc_extent: [1.0; 3], rest };
        }
        let top = scale[1].max(-f32::MAX);
        let bottom = scale[0].max(top - MAX_LOG_SCALE_RANGE);
        let dc_extent = [0, 1, 2].map(|c| high[c] - low[c]);
        Self { log_scale: [bottom, top], dc_low: low, dc_extent, rest }
    }
}

struct Source<'a> {
    gaussians: &'a Gaussians,
    materials: Option<&'a Materials>,
    objects: Option<Vec<u16>>,
    degree: u8,
    ranges: Ranges,
    sh_steps: f32,
}

impl Source<'_> {
    fn block(&self, rows: &[u32]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut geometry = Vec::with_capacity(16 * rows.len());
        for chunk in rows.chunks(CHUNK) {
            let of = |i: u32| Vec3::from(self.gaussians.means[i as usize]);
            let (low, high) =
                chunk.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), &i| {
                    (l.min(of(i)), h.max(of(i)))
                });
            // A box wider than half of all floats has no finite extent.
            let extent = (high - low).min(Vec3::splat(f32::MAX));
            for v in low.to_array().into_iter().chain(extent.to_array()) {
                bytes.extend(v.to_le_bytes());
            }
            for &i in chunk {
                let share = (of(i) - low) / extent.max(Vec3::splat(f32::MIN_POSITIVE));
                geometry.extend(
                    self.geometry(i as usize, share).into_iter().flat_map(u32::to_le_bytes),
                );
            }
        }
        by_significance(&mut bytes, &geometry, 16);
        let dc: Vec<u8> = rows.iter().flat_map(|&i| self.dc(i as usize).to_le_bytes()).collect();
        by_significance(&mut bytes, &dc, 4);
        let rest = 3 * ((self.degree as usize + 1).pow(2) - 1);
        let sh: Vec<u8> = rows.iter().flat_map(|&i| self.rest(i as usize)).collect();
        by_significance(&mut bytes, &sh, rest);
        if let Some(materials) = self.materials {
            let records: Vec<u8> = rows
                .iter()
                .flat_map(|&i| self.material(materials, i as usize))
                .flat_map(u32::to_le_bytes)
                .collect();
            by_significance(&mut bytes, &records, 12);
        }
        bytes
    }

    fn geometry(&self, i: usize, share: Vec3) -> [u32; 4] {
        let [x, y, z] = share.to_array().map(|v| step(v, 65535));
        let [low, high] = self.ranges.log_scale;
        let range = (high - low).max(f32::MIN_POSITIVE);
        let [a, b, c] = self.gaussians.log_scales[i].map(|s| step((s - low) / range, 4095));
        let opacity = step(sigmoid(self.gaussians.opacity_logits[i]), 4095);
        [
            x | y << 16,
            z | a << 16 | (opacity & 15) << 28,
            b | c << 12 | (opacity >> 4) << 24,
            smallest_three(self.gaussians.rotations[i]),
        ]
    }

    fn dc(&self, i: usize) -> u32 {
        let sh = self.gaussians.sh_of(i);
        let part = |c: usize, steps: u32| {
            let extent = self.ranges.dc_extent[c].max(f32::MIN_POSITIVE);
            step((sh[c] - self.ranges.dc_low[c]) / extent, steps)
        };
        part(0, 2047) | part(1, 2047) << 11 | part(2, 1023) << 22
    }

    fn rest(&self, i: usize) -> impl Iterator<Item = u8> {
        let count = 3 * (self.degree as usize + 1).pow(2);
        self.gaussians.sh_of(i)[3..count.max(3)].iter().enumerate().map(|(at, v)| {
            let k = at / 3 + 1;
            let band = if k < 4 {
                0
            } else if k < 9 {
                1
            } else {
                2
            };
            let q = (v / self.ranges.rest[band].max(f32::MIN_POSITIVE)).clamp(-1.0, 1.0);
            let step = (self.sh_steps * q.signum() * q.abs().sqrt()).round();
            (128.0 + step * (127.0 / self.sh_steps)).round() as u8
        })
    }

    fn material(&self, m: &Materials, i: usize) -> [u32; 3] {
        let byte = |v: f32| step(v, 255);
        let [r, g, b] = m.base_color_linear[i].map(|v| byte(srgb::encode(v.clamp(0.0, 1.0))));
        let object = self.objects.as_ref().map_or(0, |ids| u32::from(ids[i]));
        [
            octahedral(m.normals[i]),
            r | g << 8 | b << 16 | byte(m.roughness[i]) << 24,
            byte(m.metallic[i]) | byte(m.visibility[i]) << 8 | object << 16,
        ]
    }
}

/// 0 to `steps`; NaN is 0.
fn step(share: f32, steps: u32) -> u32 {
    // Casting saturates and takes NaN to 0.
    ((share * steps as f32).round() as u32).min(steps)
}

fn smallest_three(q: [f32; 4]) -> u32 {
    let norm = q.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt();
    let q = q.map(|v| f64::from(v) / norm);
    let largest = (0..4).fold(0, |a, b| if q[b].abs() > q[a].abs() { b } else { a });
    let sign = q[largest].signum();
    let mut bits = (largest as u32) << 30;
    for (place, k) in (0..4).filter(|k| *k != largest).enumerate() {
        let share = sign * q[k] * std::f64::consts::FRAC_1_SQRT_2 + 0.5;
        bits |= step(share as f32, 1023) << (10 * place);
    }
    bits
}

/// The sphere folded onto a square.
fn octahedral(normal: [f32; 3]) -> u32 {
    let n = Vec3::from(normal);
    let sum = n.abs().element_sum();
    let n = if sum > 0.0 && sum.is_finite() { n / sum } else { Vec3::Z };
    let sign = |v: f32| if v < 0.0 { -1.0 } else { 1.0 };
    let (x, y) = if n.z < 0.0 {
        ((1.0 - n.y.abs()) * sign(n.x), (1.0 - n.x.abs()) * sign(n.y))
    } else {
        (n.x, n.y)
    };
    step(0.5 + 0.5 * x, 65535) | step(0.5 + 0.5 * y, 65535) << 16
}

/// The column that says which object a Gaussian belongs to.
fn object_ids(gaussians: &Gaussians) -> Option<Vec<u16>> {
    let column = gaussians.extra.iter().find(|column| column.name == "object_id")?;
    // Ids above 16 bits share colors with others.
    Some(match &column.values {
        ColumnValues::U8(v) => v.iter().map(|v| u16::from(*v)).collect(),
        ColumnValues::I8(v) => v.iter().map(|v| (*v).max(0) as u16).collect(),
        ColumnValues::U16(v) => v.clone(),
        ColumnValues::I16(v) => v.iter().map(|v| (*v).max(0) as u16).collect(),
        ColumnValues::U32(v) => v.iter().map(|v| *v as u16).collect(),
        ColumnValues::I32(v) => v.iter().map(|v| (*v).max(0) as u16).collect(),
        ColumnValues::F32(v) => v.iter().map(|v| *v as u16).collect(),
        ColumnValues::F64(v) => v.iter().map(|v| *v as u16).collect(),
    })
}

fn by_significance(out: &mut Vec<u8>, records: &[u8], stride: usize) {
    for plane in 0..stride {
        out.extend(records.iter().skip(plane).step_by(stride));
    }
}

fn deflated(bytes: &[u8], level: u32) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::new(level.min(9)));
    let written = encoder.write_all(bytes).and_then(|()| encoder.finish());
    // Writing to memory does not fail.
    written.unwrap_or_default()
}

/// Median of the centers, and the radius round it that holds nine tenths of them.
fn extent(gaussians: &Gaussians, rows: &[u32]) -> ([f32; 3], f32) {
    let step = rows.len().div_ceil(100_000).max(1);
    let some: Vec<Vec3> =
        rows.iter().step_by(step).map(|&i| Vec3::from(gaussians.means[i as usize])).collect();
    let quantile = |mut values: Vec<f32>, share: f64| {
        values.sort_by(f32::total_cmp);
        values.get((values.len() as f64 * share) as usize).copied().unwrap_or(0.0)
    };
    let center = [0, 1, 2].map(|k| quantile(some.iter().map(|m| m[k]).collect(), 0.5));
    let radius = quantile(some.iter().map(|m| m.distance(Vec3::from(center))).collect(), 0.9);
    (center, if radius > 0.0 && radius.is_finite() { radius } else { 1.0 })
}
