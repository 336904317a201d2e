//! Fusion of depth maps into a truncated signed distance on a sparse grid (Curless & Levoy 1996;
//! blocks after Nießner et al. 2013).

use glam::IVec3;
use motes_math::median::upper_median;
use rayon::prelude::*;

use super::silhouettes::Silhouette;
use super::splat_depth::DepthMap;
use super::view::View;

/// Voxels along the edge of a block.
pub(super) const SIDE: usize = 8;
pub(super) const VOXELS: usize = SIDE * SIDE * SIDE;
/// Distances are kept up to this many voxels: enough for the noise of depth maps to average out,
/// small enough that sheets thinner than it keep both sides.
const TRUNCATION: f32 = 4.0;
/// A pixel whose footprint is wider than this many voxels is too far away to be part of the grid.
pub(super) const MAX_FOOTPRINT: f32 = 4.0;

/// Neighboring pixels whose depths differ by more than this many footprints see two things.
const STEP: f32 = 8.0;

/// Weight of what the silhouettes leave over, against 1 of a depth; less where depths tell, none where they have this.
const HULL_WEIGHT: f32 = 0.3;
const TOLD: f32 = 2.0;
/// Views that must have a place in their picture for silhouettes to tell about it: this many, and one in this many.
const HULL_VIEWS: usize = 4;
const HULL_SHARE: usize = 2;
/// Depth that is believed less than this is a pit: the grid reaches this many voxels farther to its front.
const PIT: f32 = 0.5;
const PIT_REACH: f32 = 24.0;

/// Distances of the corners of one block, in voxels, positive outside; weight 0 where nothing was seen.
pub(super) struct Block {
    pub(super) distance: [f32; VOXELS],
    pub(super) weight: [f32; VOXELS],
    /// Views that saw the surface within the truncation.
    pub(super) seen: [u8; VOXELS],
}

/// Blocks around the surface, sorted by key.
pub(super) struct Grid {
    pub(super) voxel: f32,
    pub(super) keys: Vec<IVec3>,
    pub(super) blocks: Vec<Block>,
}

impl Grid {
    /// Index of the block with this key.
    #[inline]
    pub(super) fn find(&self, key: IVec3) -> Option<usize> {
        self.keys.binary_search_by_key(&order(key), |&k| order(k)).ok()
    }
}

#[inline]
fn order(k: IVec3) -> (i32, i32, i32) {
    (k.z, k.y, k.x)
}

/// Block keys that the depth maps touch; `None` when more than `limit`.
fn touched(
    views: &[View],
    maps: &[DepthMap],
    flat: &[Vec<bool>],
    hull: &[Silhouette],
    voxel: f32,
    limit: usize,
) -> Option<Vec<IVec3>> {
    let edge = voxel * SIDE as f32;
    let reach = TRUNCATION * voxel;
    let of = |(k, ((view, map), flat)): (usize, ((&View, &DepthMap), &Vec<bool>))| {
        let mut keys = Vec::new();
        let mut last = IVec3::MAX;
        let most = MAX_FOOTPRINT * voxel / view.footprint();
        for (i, &z) in map.depth.iter().enumerate() {
            if flat[i] || !(z > 0.0 && z <= most) {
                continue;
            }
            let ray = view.pixel_ray([i % view.width, i / view.width]);
            let step = 0.5 * edge / ray.length();
            let half = reach / ray.length();
            let pit = hull.get(k).is_some_and(|h| h.steady[i] < PIT);
            let mut t = z - if pit { half * (PIT_REACH / TRUNCATION) } else { half };
            loop {
                let p = view.center + ray * t.min(z + half);
                let key = (p / edge).floor().as_ivec3();
                if key != last {
                    keys.push(key);
                    last = key;
                }
                if t >= z + half {
                    break;
                }
                t += step;
            }
        }
        keys.sort_unstable_by_key(|&k| order(k));
        keys.dedup();
        keys
    };
    let per_view: Vec<Vec<IVec3>> =
        views.par_iter().zip(maps).zip(flat).enumerate().with_max_len(1).map(of).collect();
    let mut keys = per_view.concat();
    keys.sort_unstable_by_key(|&k| order(k));
    keys.dedup();
    (keys.len() <= limit).then_some(keys)
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
    let blocks =
        keys.par_iter().map(|&key| integrate(views, maps, hull, voxel, key, carve)).collect();
    Grid { voxel, keys, blocks }
}

fn integrate(
    views: &[View],
    maps: &[DepthMap],
    hull: &[Silhouette],
    voxel: f32,
    key: IVec3,
    carve: f32,
) -> Block {
    let mut block =
        Block { distance: [TRUNCATION; VOXELS], weight: [0.0; VOXELS], seen: [0; VOXELS] };
    let edge = voxel * SIDE as f32;
    let corner = key.as_vec3() * edge;
    let radius = 0.87 * edge;
    let mut inside = [TRUNCATION; VOXELS];
    let mut looks = [0usize; VOXELS];
    for (k, (view, map)) in views.iter().zip(maps).enumerate() {
        let middle = view.rotation * (corner + 0.5 * edge - view.center);
        if middle.z < -radius {
            continue;
        }
        for (i, (distance, weight)) in block.distance.iter_mut().zip(&mut block.weight).enumerate()
        {
            let p = corner + local(i).as_vec3() * voxel;
            let Some(q) = view.project(p) else { continue };
            let mut believed = 1.0;
            if let (Some(hull), Some(pixel)) = (hull.get(k), view.pixel(q.x, q.y)) {
                believed = hull.steady[pixel];
                // From the center of the last pixel inside to the outline is half a pixel.
                let within = (hull.depth_inside[pixel] - 0.5) * q.z * view.footprint() / voxel;
                inside[i] = inside[i].min(within);
                looks[i] += 1;
            }
            let Some(z) = depth_at(view, map, q.x, q.y) else { continue };
            let d = (z - q.z) / voxel;
            if !(d > -TRUNCATION) {
                continue;
            }
            // A depth is as uncertain as a pixel is wide.
            let w = (voxel / (z * view.footprint())).powi(2).min(1.0);
            let w = believed * if d < TRUNCATION { w } else { w * carve };
            *distance = (*distance * *weight + d.min(TRUNCATION) * w) / (*weight + w);
            *weight += w;
            if d < TRUNCATION {
                block.seen[i] = block.seen[i].saturating_add(1);
            }
        }
    }
    if hull.is_empty() {
        return block;
    }
    let least = (views.len() / HULL_SHARE).max(HULL_VIEWS);
    for (i, &within) in inside.iter().enumerate() {
        if within > 0.0 && looks[i] >= least {
            let (distance, weight) = (&mut block.distance[i], &mut block.weight[i]);
            let w = HULL_WEIGHT * (1.0 - *weight / TOLD);
            if !(w > 0.0) {
                continue;
            }
            if w > *weight {
                block.seen[i] = u8::MAX;
            }
            *distance = (*distance * *weight - within * w) / (*weight + w);
            *weight += w;
        }
    }
    block
}

/// Position of a voxel within its block.
#[inline]
pub(super) fn local(i: usize) -> IVec3 {
    IVec3::new((i % SIDE) as i32, (i / SIDE % SIDE) as i32, (i / (SIDE * SIDE)) as i32)
}

/// Depth between the centers of pixels; none at a step, where half a pixel decides what is in front.
#[inline]
fn depth_at(view: &View, map: &DepthMap, x: f32, y: f32) -> Option<f32> {
    let nearest = map.depth[view.pixel(x, y)?];
    if !(nearest > 0.0) {
        return None;
    }
    let (u, v) = (x - 0.5, y - 0.5);
    if !(u >= 0.0 && v >= 0.0 && u < (view.width - 1) as f32 && v < (view.height - 1) as f32) {
        return Some(nearest);
    }
    let (i, j) = (u as usize, v as usize);
    let (a, b) = (u - i as f32, v - j as f32);
    let at = j * view.width + i;
    let four = [at, at + 1, at + view.width, at + view.width + 1].map(|k| map.depth[k]);
    let (low, high) = four.iter().fold((f32::MAX, 0.0f32), |(l, h), &z| (l.min(z), h.max(z)));
    if !(high - low < STEP * nearest * view.footprint()) {
        return None;
    }
    let top = four[0] + (four[1] - four[0]) * a;
    let bottom = four[2] + (four[3] - four[2]) * a;
    Some(top + (bottom - top) * b)
}
