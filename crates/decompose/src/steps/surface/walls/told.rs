//! Walls that the photos tell by themselves, wherever the Gaussians are.
//!
//! Structure from motion has no points on a bare wall, so its Gaussians lie anywhere before it, and no plane holds them. What a photo
//! shows of the wall still is what other photos show in the place of the wall: shading that changes from place to place tells it.
//! Pieces of regions without texture tell a plane each, and the one that explains most of all photos is a wall.

use glam::Vec3;
use rayon::prelude::*;

use super::consistency::{Photos, shades};
use super::pieces::{Piece, pieces, search, take};
use super::put::{Put, put};
use super::relief::is_even;
use super::sweep::{BETTER, MOVED, SHARP, descend};
use super::{LEAST_PHOTOS, MOST_WALLS, Region, Surroundings, Wall, spread};
use crate::steps::surface::planes::Plane;
use crate::steps::surface::splat_depth::DepthMap;
use crate::steps::surface::view::View;

/// Pieces that may come to show a plane when it moves leave at most this share of what their depth leaves.
const NEARLY: f32 = 1.2;
/// Rounds of the common fit, steps of a round, scale of the first and what the next ones have of it.
const FITS: u64 = 3;
const FIT_STEPS: u64 = 100;
const FIRST: f32 = 0.1;
const NARROWER: f32 = 0.4;
/// Pieces that planes are ranked by at most, and fitted by; planes that are ranked per wall, and those that are fitted.
const MOST_VOTERS: usize = 256;
const MOST_RANKED: usize = 256;
const MOST_FITTED: usize = 8;
/// Share of a wall's least size that a plane must explain better than depth does.
const LEAST_GAIN: f32 = 0.1;
/// Share of the pieces that show a plane whose pixels must lie on it one by one: it is no plane, but their mean.
const LEAST_PUT: f32 = 0.5;
/// Share of the scene that may lie behind a wall. Gaussians of the wall itself do.
const BEHIND: f32 = 0.1;

/// Walls, and per photo the pixels that were put onto them.
pub(in crate::steps::surface) struct Told {
    pub(in crate::steps::surface) planes: Vec<Plane>,
    pub(in crate::steps::surface) on: Vec<Vec<bool>>,
}

/// Finds walls of at least `share` of all pixels, largest first, and puts the pixels of regions onto them.
pub(in crate::steps::surface) fn told<'a>(
    regions: &[Region],
    views: &[View],
    maps: &mut [DepthMap],
    around: impl Fn(&[DepthMap]) -> Surroundings<'a>,
    share: f32,
) -> Told {
    let least = share * views.iter().map(|v| v.luma.len()).sum::<usize>() as f32;
    let on = views.iter().map(|v| vec![false; v.luma.len()]).collect();
    let mut told = Told { planes: Vec::new(), on };
    let mut refused = Vec::new();
    let voxel = around(maps).voxel;
    let shades = shades(views);
    let mut pieces = pieces(regions, views, maps, voxel);
    while told.planes.len() < MOST_WALLS {
        let photos = Photos::new(views, maps, &shades);
        search(&mut pieces, &photos);
        let around = around(maps);
        let Some((plane, pixels)) =
            Vote::new(&photos, &pieces, &around).wall(least, told.planes.len(), &mut refused)
        else {
            break;
        };
        drop(photos);
        pixels.iter().for_each(|p| p.apply(maps));
        let all: Vec<&Region> = pieces.iter().map(|p| &p.region).collect();
        let showing = pixels.iter().map(|p| p.piece).collect();
        spread(&[Wall { plane, regions: showing }], &all, views, maps, voxel);
        take(&mut pieces, &plane, views, maps, voxel, &mut told.on);
        told.planes.push(plane);
    }
    told
}

/// All pieces, asked about planes.
struct Vote<'a> {
    photos: &'a Photos<'a>,
    pieces: &'a [Piece],
    around: &'a Surroundings<'a>,
    /// Per piece, what its depth leaves unexplained.
    by_depth: Vec<f32>,
    /// Every so many pieces.
    voters: Vec<usize>,
}

impl<'a> Vote<'a> {
    fn new(photos: &'a Photos<'a>, pieces: &'a [Piece], around: &'a Surroundings<'a>) -> Self {
        let left = |p: &Piece| photos.by_depth(&p.region).map_or(0.0, |c| c.mean);
        let by_depth = pieces.par_iter().with_max_len(1).map(left).collect();
        let stride = pieces.len().div_ceil(MOST_VOTERS).max(1);
        let voters = (0..pieces.len()).step_by(stride).collect();
        Self { photos, pieces, around, by_depth, voters }
    }

    /// The wall that explains most, with the pixels to put onto it. Planes that are none go to `refused`, and the pieces that show
    /// one of those are not asked for theirs.
    fn wall(
        &self,
        least: f32,
        found: usize,
        refused: &mut Vec<Plane>,
    ) -> Option<(Plane, Vec<Put>)> {
        let mut fitted = 0;
        for (i, start) in self.ranked(LEAST_GAIN * least) {
            if fitted == MOST_FITTED {
                break;
            }
            if refused.iter().any(|plane| self.ratio(i, plane) < BETTER) {
                continue;
            }
            let plane = self.fitted(start, (found * MOST_FITTED + fitted) as u64);
            fitted += 1;
            if let Some(pixels) = self.evidence(&plane, least) {
                return Some((plane, pixels));
            }
            refused.extend([start, plane]);
        }
        None
    }

    /// The planes of the largest pieces that explain so many pixels, those of most first.
    fn ranked(&self, least: f32) -> Vec<(usize, Plane)> {
        let told = self.pieces.iter().enumerate().filter_map(|(i, p)| Some((i, p.told?)));
        let mut told: Vec<(usize, Plane)> = told.collect();
        told.sort_by_key(|&(i, _)| (std::cmp::Reverse(self.pieces[i].region.pixels.len()), i));
        told.truncate(MOST_RANKED);
        let gain = |(i, plane): (usize, Plane)| (self.gain(&self.voters, &plane), i, plane);
        let mut ranked: Vec<(f32, usize, Plane)> =
            told.into_par_iter().with_max_len(1).map(gain).collect();
        let share = self.voters.len() as f32 / self.pieces.len().max(1) as f32;
        ranked.retain(|(gain, ..)| *gain >= least * share);
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
        ranked.into_iter().map(|(_, i, plane)| (i, plane)).collect()
    }

    fn all(&self) -> Vec<usize> {
        (0..self.pieces.len()).collect()
    }

    /// What a plane leaves unexplained of a piece, over what its depth leaves.
    fn ratio(&self, i: usize, plane: &Plane) -> f32 {
        let region = &self.pieces[i].region;
        let is_before = plane.height(self.photos.views[region.view].center) > 0.0;
        let cost = is_before.then(|| self.photos.by_plane(region, plane)).flatten();
        cost.map_or(f32::INFINITY, |c| c.mean / self.by_depth[i].max(f32::MIN_POSITIVE))
    }

    /// Pixels that a plane explains, as far as it explains them better than depth does.
    fn gain(&self, among: &[usize], plane: &Plane) -> f32 {
        let gain = |&i: &usize| (1.0 - self.ratio(i, plane)).max(0.0) * self.pieces[i].size();
        // Added up in order: floats sum to other values in another.
        among.par_iter().map(gain).collect::<Vec<f32>>().iter().sum()
    }

    fn showing(&self, among: &[usize], plane: &Plane, limit: f32) -> Vec<usize> {
        among.par_iter().copied().filter(|&i| self.ratio(i, plane) < limit).collect()
    }

    /// The plane near one that explains most.
    fn fitted(&self, mut plane: Plane, key: u64) -> Plane {
        let mut scale = FIRST;
        for round in 0..FITS {
            let mut among = self.showing(&self.all(), &plane, NEARLY);
            let stride = among.len().div_ceil(MOST_VOTERS).max(1);
            among = among.into_iter().step_by(stride).collect();
            let regions = || among.iter().map(|&i| &self.pieces[i].region);
            let places = regions().flat_map(|r| self.photos.on_plane(r, &plane));
            let (sum, count) =
                places.fold((Vec3::ZERO, 0.0), |(sum, count), (_, at)| (sum + at, count + 1.0));
            if count == 0.0 {
                break;
            }
            let middle = sum / count;
            let heights = regions().map(|r| plane.height(self.photos.views[r.view].center));
            let half = 0.5 * heights.sum::<f32>() / among.len() as f32;
            // Turned about the middle of what shows it, and moved.
            let step = |p: Plane, scale: f32, [a, b, c, d]: [f32; 4]| {
                let normal = (p.normal + scale * Vec3::new(a, b, c)).normalize();
                let offset = normal.dot(middle) - p.height(middle) + scale * d * half;
                Plane { normal, offset }
            };
            let cost = |p: Plane| -self.gain(&among, &p);
            plane = descend(plane, [key, 1 + round], FIT_STEPS, scale, cost, step).1;
            scale *= NARROWER;
        }
        plane
    }

    /// The pixels to put onto a plane, when it is a wall.
    fn evidence(&self, plane: &Plane, least: f32) -> Option<Vec<Put>> {
        let shown = self.showing(&self.all(), plane, BETTER);
        let size = shown.iter().map(|&i| self.pieces[i].size()).sum::<f32>();
        let mut photos: Vec<usize> = shown.iter().map(|&i| self.pieces[i].region.view).collect();
        photos.sort_unstable();
        photos.dedup();
        let is_wall = size >= least
            && photos.len() >= LEAST_PHOTOS
            && self.around.lies_before(plane, BEHIND)
            && self.is_sharp(&shown, plane)
            && self.is_even(plane);
        let put = |&i: &usize| put(self.photos, &self.pieces[i].region, i, plane);
        let pixels = || shown.par_iter().with_max_len(1).map(put).collect::<Vec<Put>>();
        let pixels = is_wall.then(pixels)?;
        let count = pixels.iter().map(|p| p.depths.len()).sum::<usize>() as f32;
        (count >= least.max(LEAST_PUT * size)).then_some(pixels)
    }

    /// Whether no relief of the pieces that nearly show a plane explains more than the plane.
    fn is_even(&self, plane: &Plane) -> bool {
        let among = self.showing(&self.all(), plane, NEARLY);
        let regions: Vec<&Region> = among.iter().map(|&i| &self.pieces[i].region).collect();
        is_even(self.photos, &regions, plane, self.around.voxel)
    }

    /// Whether the pieces that show a plane tell how far away it is.
    fn is_sharp(&self, shown: &[usize], plane: &Plane) -> bool {
        MOVED.iter().all(|&share| {
            let (mut moved, mut there) = (0.0, 0.0);
            for piece in shown.iter().map(|&i| &self.pieces[i]) {
                let cost = |share| self.photos.by_moved(&piece.region, plane, share);
                if let [Some(a), Some(b)] = [share, 0.0].map(cost) {
                    moved += a.mean * piece.size();
                    there += b.mean * piece.size();
                }
            }
            moved >= SHARP * there
        })
    }
}

#[cfg(test)]
mod tests;
