//! Dense start points: a depth for every few pixels of every training photo, by matching patches
//! in neighboring photos near the depths of the sparse points.
//!
//! A fit that starts from many accurate points needs fewer steps and generalizes better than one
//! that grows them by splitting (EDGS, Kotovenko et al. 2025, which triangulates learned matches).
//! Here a plain normalized cross-correlation search stands in for the network: each pixel tries
//! the inverse depths of the sparse points that project nearest to it, refines the best, and is
//! kept when the correlation is high and a second photo found the same surface.

mod pair;
mod photo;
mod search;

use glam::Vec3;
use motes_scene::SparsePoints;
use rayon::prelude::*;

use crate::target::TrainingImage;
use pair::neighbors;
use photo::Photo;
use search::{Match, search_photo};

/// Photos are matched at this long side, pixels: finer detail is left to the fit.
const LONG_SIDE: usize = 512;
/// Relative depth difference at which two photos agree about a surface.
const AGREEMENT: f32 = 0.01;

/// A matched depth at one grid pixel of one photo; `None` where nothing matched.
struct DepthGrid {
    step: usize,
    columns: usize,
    matches: Vec<Option<Match>>,
}

/// Points on the surfaces that the photos show, colored by the photo they were found in.
///
/// `step` is the spacing of the searched pixels at a long side of 512. Empty without sparse points or
/// with a single photo. The result depends on the input alone.
pub fn dense_points(images: &[TrainingImage], sparse: &SparsePoints, step: usize) -> SparsePoints {
    if images.len() < 2 || sparse.len() < 8 {
        return SparsePoints::default();
    }
    let photos: Vec<Photo> =
        images.par_iter().map(|image| Photo::new(image, sparse, LONG_SIDE)).collect();
    let pairs: Vec<Vec<pair::Pair>> =
        (0..photos.len()).into_par_iter().map(|i| neighbors(&photos, i, sparse)).collect();
    let grids: Vec<DepthGrid> = (0..photos.len())
        .into_par_iter()
        .with_max_len(1)
        .map(|i| {
            let columns = photos[i].width.div_ceil(step);
            let matches = search_photo(&photos, i, &pairs[i], step);
            DepthGrid { step, columns, matches }
        })
        .collect();
    let found: Vec<SparsePoints> = (0..photos.len())
        .into_par_iter()
        .map(|i| agreed_points(&photos, &grids, &pairs[i], i))
        .collect();
    let mut all = SparsePoints::default();
    for points in found {
        all.positions.extend(points.positions);
        all.colors.extend(points.colors);
    }
    all
}

/// The matches of photo `i` that at least one neighbor's own search confirms.
fn agreed_points(
    photos: &[Photo],
    grids: &[DepthGrid],
    pairs: &[pair::Pair],
    i: usize,
) -> SparsePoints {
    let (photo, grid) = (&photos[i], &grids[i]);
    let mut out = SparsePoints::default();
    for (cell, found) in grid.matches.iter().enumerate() {
        let Some(found) = found else { continue };
        let (x, y) = ((cell % grid.columns) * grid.step, (cell / grid.columns) * grid.step);
        let position = photo.unproject(x as f32 + 0.5, y as f32 + 0.5, 1.0 / found.inverse_depth);
        let confirmed =
            pairs.iter().any(|pair| agrees(&photos[pair.other], &grids[pair.other], position));
        if confirmed && position.is_finite() {
            out.positions.push(position.to_array());
            out.colors.push(photo.color(x, y));
        }
    }
    out
}

/// Whether the grid of `photo` has a match at (nearly) the depth of `position`.
fn agrees(photo: &Photo, grid: &DepthGrid, position: Vec3) -> bool {
    let Some((x, y, z)) = photo.project(position) else { return false };
    let near = |v: f32| ((v - 0.5) / grid.step as f32).round() as usize;
    let (column, row) = (near(x), near(y));
    if column >= grid.columns {
        return false;
    }
    let found = grid.matches.get(row * grid.columns + column).and_then(Option::as_ref);
    found.is_some_and(|m| (m.inverse_depth * z - 1.0).abs() < AGREEMENT)
}

#[cfg(test)]
mod tests;
