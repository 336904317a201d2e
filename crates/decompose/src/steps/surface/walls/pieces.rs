//! Pieces of regions: a region without contrast may show two walls and a ceiling, a small piece of it shows one.

use rayon::prelude::*;

use super::consistency::Photos;
use super::sweep::sweep;
use super::{LEAST_REGION, Place, Region};
use crate::steps::surface::planes::Plane;
use crate::steps::surface::splat_depth::DepthMap;
use crate::steps::surface::view::View;

/// Share of a photo that a piece has at most.
const MOST_PIECE: f32 = 0.04;

/// A piece, and the plane that it tells by itself.
pub(super) struct Piece {
    pub(super) region: Region,
    pub(super) told: Option<Plane>,
    is_searched: bool,
}

impl Piece {
    fn new(region: Region) -> Self {
        Self { region, told: None, is_searched: false }
    }

    pub(super) fn size(&self) -> f32 {
        self.region.pixels.len() as f32
    }
}

/// All pieces of regions.
pub(super) fn pieces(
    regions: &[Region],
    views: &[View],
    maps: &[DepthMap],
    voxel: f32,
) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for region in regions {
        let (k, view) = (region.view, &views[region.view]);
        let mut parts = Vec::new();
        let most = (MOST_PIECE * view.luma.len() as f32) as usize;
        split(region.pixels.clone(), view, most, &mut parts);
        let piece = |pixels| Piece::new(Region::new(k, pixels, view, &maps[k], voxel));
        pieces.extend(parts.into_iter().map(piece));
    }
    pieces
}

/// Splits pixels in the middle of their longer side until no part has more than `most`.
fn split(mut pixels: Vec<u32>, view: &View, most: usize, parts: &mut Vec<Vec<u32>>) {
    if pixels.len() <= most.max(1) {
        parts.push(pixels);
        return;
    }
    let side = |axis: usize| {
        let along = || pixels.iter().map(|&k| view.at(k)[axis]);
        along().max().zip(along().min()).map_or(0, |(high, low)| high - low)
    };
    let axis = usize::from(side(1) >= side(0));
    pixels.sort_unstable_by_key(|&k| (view.at(k)[axis], k));
    let rest = pixels.split_off(pixels.len() / 2);
    for mut part in [pixels, rest] {
        part.sort_unstable();
        split(part, view, most, parts);
    }
}

/// Looks for the planes of pieces that are new or have changed.
pub(super) fn search(pieces: &mut [Piece], photos: &Photos<'_>) {
    pieces.par_iter_mut().with_max_len(1).filter(|p| !p.is_searched).for_each(|piece| {
        piece.told = sweep(photos, &piece.region);
        piece.is_searched = true;
    });
}

/// Takes the pixels that lie on a plane out of the pieces. What is left of a piece is searched anew.
pub(super) fn take(
    pieces: &mut Vec<Piece>,
    plane: &Plane,
    views: &[View],
    maps: &[DepthMap],
    voxel: f32,
) {
    let left = |piece: Piece| {
        let k = piece.region.view;
        let (view, map) = (&views[k], &maps[k]);
        let lies_on = |&&i: &&u32| Place::new(view, map, i as usize, voxel).lies_on(plane);
        let (taken, left): (Vec<u32>, Vec<u32>) = piece.region.pixels.iter().partition(lies_on);
        if taken.is_empty() {
            return Some(piece);
        }
        let is_large = left.len() as f32 >= LEAST_REGION * view.luma.len() as f32;
        is_large.then(|| Piece::new(Region::new(k, left, view, map, voxel)))
    };
    *pieces = std::mem::take(pieces).into_iter().filter_map(left).collect();
}

#[cfg(test)]
mod tests;
