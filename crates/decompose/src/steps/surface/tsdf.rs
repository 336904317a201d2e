//! Fusion of depth maps into a truncated signed distance on a sparse grid (Curless & Levoy 1996;
//! blocks after Nießner et al. 2013).

use std::cmp::Ordering;

use glam::IVec3;
use half::f16;
use motes_math::median::upper_median;
use rayon::prelude::*;

use super::integrate::Seen;
use super::silhouettes::Silhouette;
use super::splat_depth::DepthMap;
use super::view::View;

/// Voxels along the edge of a block.
pub(super) const SIDE: usize = 8;
pub(super) const VOXELS: usize = SIDE * SIDE * SIDE;
/// Distances are kept up to this many voxels: enough for the noise of depth maps to average out,
/// small enough that sheets thinner than it keep both sides.
pub(super) const TRUNCATION: f32 = 4.0;
/// A pixel whose footprint is wider than this many voxels is too far away to be part of the grid.
pub(super) const MAX_FOOTPRINT: f32 = 4.0;

/// Depth that is believed less than this is a pit: the grid reaches this many voxels farther to its front.
const PIT: f32 = 0.5;
const PIT_REACH: f32 = 24.0;

/// Distances of the corners of one block, in voxels, positive outside; NaN where nothing was seen. Half precision is a
/// thousandth of a voxel at the surface, and blocks are most of what the extraction holds in memory.
pub(super) struct Block {
    pub(super) distance: [f16; VOXELS],
    /// Views that saw the surface within the truncation.
    pub(super) seen: [u8; VOXELS],
}

/// Blocks around the surface, sorted by key in Morton order.
pub(super) struct Grid {
    pub(super) voxel: f32,
    pub(super) keys: Vec<IVec3>,
    pub(super) blocks: Vec<Block>,
}

impl Grid {
    /// Index of the block with this key.
    #[inline]
    pub(super) fn find(&self, key: IVec3) -> Option<usize> {
        self.keys.binary_search_by(|k| order(k, &key)).ok()
    }
}

/// Morton order (comparison after Chan 2002): what is near in space is near in memory, and so are the vertices of the mesh.
#[inline]
fn order(a: &IVec3, b: &IVec3) -> Ordering {
    // Biased, so that negative keys come first.
    let [a, b] = [a, b].map(|k| k.to_array().map(|v| v as u32 ^ 1 << 31));
    let differing = |axis: usize| a[axis] ^ b[axis];
    // The axis whose highest differing bit is the highest decides.
    let mut decisive = 2;
    for axis in [1, 0] {
        let (known, other) = (differing(decisive), differing(axis));
        if known < other && known < known ^ other {
            decisive = axis;
        }
    }
    a[decisive].cmp(&b[decisive])
}

/// Views whose blocks are collected before they are merged: what all touch together may be many times what one does.
const AT_ONCE: usize = 8;

/// Block keys that the depth maps touch; `None` when more than `limit`.
fn touched(
    views: &[View],
    maps: &[DepthMap],
    flat: &[Vec<bool>],
    hull: &[Silhouette],
    voxel: f32,
    limit: usize,
) -> Option<Vec<IVec3>> {
    let all: Vec<usize> = (0..views.len()).collect();
    let mut codes: Vec<u128> = Vec::new();
    for some in all.chunks(AT_ONCE) {
        let of = |&k: &usize| touched_by(&views[k], &maps[k], &flat[k], hull.get(k), voxel);
        let per_view: Vec<Vec<u128>> = some.par_iter().with_max_len(1).map(of).collect();
        per_view.iter().for_each(|of_view| codes.extend_from_slice(of_view));
        // What is merged already is one sorted run.
        codes.sort();
        codes.dedup();
        if codes.len() > limit {
            return None;
        }
    }
    let mut keys: Vec<IVec3> = codes.into_iter().map(key_of).collect();
    keys.sort_unstable_by(order);
    Some(keys)
}

/// A number for each key, which is compared faster than the key.
fn code_of(key: IVec3) -> u128 {
    key.to_array().into_iter().fold(0, |code, v| code << 32 | u128::from(v as u32))
}

fn key_of(code: u128) -> IVec3 {
    IVec3::from_array([64, 32, 0].map(|shift| (code >> shift) as u32 as i32))
}

/// Codes of the blocks that one map touches, sorted.
fn touched_by(
    view: &View,
    map: &DepthMap,
    flat: &[bool],
    hull: Option<&Silhouette>,
    voxel: f32,
) -> Vec<u128> {
    let edge = voxel * SIDE as f32;
    let reach = TRUNCATION * voxel;
    let mut codes = Vec::new();
    let mut last = IVec3::MAX;
    let most = MAX_FOOTPRINT * voxel / view.footprint();
    for (i, &z) in map.depth.iter().enumerate() {
        if flat[i] || !(z > 0.0 && z <= most) {
            continue;
        }
        let ray = view.pixel_ray([i % view.width, i / view.width]);
        let step = 0.5 * edge / ray.length();
        let half = reach / ray.length();
        let pit = hull.is_some_and(|h| h.has_outline() && h.steady[i] < PIT);
        let mut t = z - if pit { half * (PIT_REACH / TRUNCATION) } else { half };
        loop {
            let p = view.center + ray * t.min(z + half);
            let key = (p / edge).floor().as_ivec3();
            if key != last {
                codes.push(code_of(key));
                last = key;
            }
            if t >= z + half {
                break;
            }
            t += step;
        }
    }
    codes.sort_unstable();
    codes.dedup();
    codes
}

/// The median footprint of the pixels that have a depth; `None` without any.
pub(super) fn median_footprint(views: &[View], maps: &[DepthMap]) -> Option<f32> {
    let mut sizes: Vec<f32> = views
        .iter()
        .zip(maps)
        .flat_map(|(v, m)| {
            m.depth.iter().step_by(7).filter(|&&z| z > 0.0).map(move |&z| z * v.footprint())
        })
        .collect();
    upper_median(&mut sizes, f32::total_cmp)
}

/// Fuses the maps on a grid of the given voxel, or of a coarser one when that takes more than
/// `limit` blocks. Pixels that are `flat` carve, but no grid is laid for them. `hull`: per view, or empty.
pub(super) fn fuse(
    views: &[View],
    maps: &[DepthMap],
    flat: &[Vec<bool>],
    hull: &[Silhouette],
    voxel: f32,
    limit: usize,
    carve: f32,
) -> Grid {
    let mut voxel = voxel;
    let keys = loop {
        match touched(views, maps, flat, hull, voxel, limit) {
            Some(keys) => break keys,
            None => voxel *= 1.25,
        }
    };
    let seen = Seen { views, maps, hull, voxel, carve };
    let blocks = keys.par_iter().map(|&key| seen.integrate(key)).collect();
    Grid { voxel, keys, blocks }
}

/// Position of a voxel within its block.
#[inline]
pub(super) fn local(i: usize) -> IVec3 {
    IVec3::new((i % SIDE) as i32, (i / SIDE % SIDE) as i32, (i / (SIDE * SIDE)) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_has_a_number_of_its_own() {
        let values = [i32::MIN, -70_000, -1, 0, 1, 70_000, i32::MAX];
        let mut codes = Vec::new();
        for x in values {
            for y in values {
                for z in values {
                    let key = IVec3::new(x, y, z);
                    assert_eq!(key_of(code_of(key)), key);
                    codes.push(code_of(key));
                }
            }
        }
        codes.sort_unstable();
        codes.dedup();
        assert_eq!(codes.len(), values.len().pow(3));
    }
}
