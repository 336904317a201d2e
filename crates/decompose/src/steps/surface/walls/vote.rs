//! Which plane most pieces show, and whether it is a wall.

use rayon::prelude::*;

use super::consistency::Photos;
use super::fit::{NEARLY, at_right_angles, fitted, on_depth};
use super::height_field::is_even;
use super::pieces::Piece;
use super::put::{Put, lie_on_it, put};
use super::sweep::{BETTER, MOVED, SHARP};
use super::{LEAST_PHOTOS, Region, Surroundings};
use crate::steps::surface::planes::Plane;

/// Pieces that planes are ranked by at most; planes that are ranked per wall, and those that are fitted.
const MOST_VOTERS: usize = 256;
const MOST_RANKED: usize = 256;
const MOST_FITTED: usize = 8;
/// Share of a wall's least size that a plane must explain better than depth does.
const LEAST_GAIN: f32 = 0.1;
/// Share of the scene that may lie behind a wall. Gaussians of the wall itself do.
const BEHIND: f32 = 0.1;

/// All pieces, asked about planes.
pub(super) struct Vote<'a> {
    pub(super) photos: &'a Photos<'a>,
    pub(super) pieces: &'a [Piece],
    around: &'a Surroundings<'a>,
    /// Per piece, what its depth leaves unexplained.
    by_depth: Vec<f32>,
    /// The pieces that planes are ranked by.
    voters: Vec<usize>,
}

impl<'a> Vote<'a> {
    pub(super) fn new(
        photos: &'a Photos<'a>,
        pieces: &'a [Piece],
        around: &'a Surroundings<'a>,
    ) -> Self {
        let left = |p: &Piece| photos.by_depth(&p.region).map_or(0.0, |c| c.mean);
        let by_depth = pieces.par_iter().with_max_len(1).map(left).collect();
        let voters = spaced((0..pieces.len()).collect(), MOST_VOTERS);
        Self { photos, pieces, around, by_depth, voters }
    }

    /// The wall that explains most, with the pixels to put onto it. Planes that are none go to `refused`, and the pieces that show
    /// one of those are not asked for theirs.
    pub(super) fn wall(
        &self,
        least: f32,
        found: &[Plane],
        refused: &mut Vec<Plane>,
    ) -> Option<(Plane, Vec<Put>)> {
        let others: Vec<Plane> = self.around.known.iter().chain(found).copied().collect();
        let mut fits = 0;
        for (i, start) in self.ranked(LEAST_GAIN * least) {
            if fits == MOST_FITTED {
                break;
            }
            if refused.iter().any(|plane| self.ratio(i, plane) < BETTER) {
                continue;
            }
            let key = (found.len() * MOST_FITTED + fits) as u64;
            let plane =
                at_right_angles(self, on_depth(self, fitted(self, start, key)), &others, key);
            fits += 1;
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

    /// What a plane leaves unexplained of a piece, over what its depth leaves.
    fn ratio(&self, i: usize, plane: &Plane) -> f32 {
        let region = &self.pieces[i].region;
        let is_before = plane.height(self.photos.views[region.view].center) > 0.0;
        let cost = is_before.then(|| self.photos.by_plane(region, plane)).flatten();
        cost.map_or(f32::INFINITY, |c| c.mean / self.by_depth[i].max(f32::MIN_POSITIVE))
    }

    /// Pixels that a plane explains, as far as it explains them better than depth does.
    pub(super) fn gain(&self, among: &[usize], plane: &Plane) -> f32 {
        let gain = |&i: &usize| (1.0 - self.ratio(i, plane)).max(0.0) * self.pieces[i].size();
        // Added up in order: floats sum to other values in another.
        among.par_iter().map(gain).collect::<Vec<f32>>().iter().sum()
    }

    /// The pieces of which a plane leaves less than `limit` times what their depth leaves.
    pub(super) fn showing(&self, plane: &Plane, limit: f32) -> Vec<usize> {
        let all = (0..self.pieces.len()).into_par_iter();
        all.filter(|&i| self.ratio(i, plane) < limit).collect()
    }

    /// The pixels to put onto a plane, when it is a wall.
    fn evidence(&self, plane: &Plane, least: f32) -> Option<Vec<Put>> {
        let shown = self.showing(plane, BETTER);
        let size = shown.iter().map(|&i| self.pieces[i].size()).sum::<f32>();
        let mut photos: Vec<usize> = shown.iter().map(|&i| self.pieces[i].region.view).collect();
        photos.sort_unstable();
        photos.dedup();
        let is_wall = size >= least
            && photos.len() >= LEAST_PHOTOS
            && self.around.lies_before(plane, BEHIND)
            && self.is_sharp(&shown, plane);
        let put = |&i: &usize| put(self.photos, &self.pieces[i].region, i, plane);
        let pixels = || shown.par_iter().with_max_len(1).map(put).collect::<Vec<Put>>();
        let pixels = is_wall.then(pixels)?;
        (lie_on_it(&pixels, least) && self.is_even(plane)).then_some(pixels)
    }

    /// Whether no height field of the pieces that nearly show a plane explains more than the plane.
    fn is_even(&self, plane: &Plane) -> bool {
        let among = self.showing(plane, NEARLY);
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

/// All of a list, or so many of it, evenly spaced.
pub(super) fn spaced(all: Vec<usize>, most: usize) -> Vec<usize> {
    let stride = all.len().div_ceil(most).max(1);
    all.into_iter().step_by(stride).collect()
}
