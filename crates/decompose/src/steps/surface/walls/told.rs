//! Walls that the photos tell by themselves, wherever the Gaussians are.
//!
//! Structure from motion has no points on a bare wall, so its Gaussians lie anywhere before it, and no plane holds them. What a photo
//! shows of the wall still is what other photos show in the place of the wall: shading that changes from place to place tells it.
//! Pieces of regions without texture tell a plane each, and the one that explains most of all photos is a wall.

use super::consistency::{Photos, shades};
use super::pieces::{pieces, search, take};
use super::vote::Vote;
use super::{MOST_WALLS, Place, Region, Surroundings, Wall, spread, spread_to_rest};
use crate::steps::surface::planes::Plane;
use crate::steps::surface::splat_depth::DepthMap;
use crate::steps::surface::view::View;

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
    let mut planes: Vec<Plane> = Vec::new();
    let mut refused = Vec::new();
    let voxel = around(maps).voxel;
    let shades = shades(views);
    let mut pieces = pieces(regions, views, maps, voxel);
    while planes.len() < MOST_WALLS {
        let photos = Photos::new(views, maps, &shades);
        search(&mut pieces, &photos);
        let around = around(maps);
        let Some((plane, pixels)) =
            Vote::new(&photos, &pieces, &around).wall(least, &planes, &mut refused)
        else {
            break;
        };
        drop(photos);
        pixels.iter().for_each(|p| p.apply(maps));
        let all: Vec<&Region> = pieces.iter().map(|p| &p.region).collect();
        let showing = pixels.iter().map(|p| p.piece).collect();
        spread(&[Wall { plane, regions: showing }], &all, views, maps, voxel);
        take(&mut pieces, &plane, views, maps, voxel);
        planes.push(plane);
    }
    spread_to_rest(&planes, regions, views, maps, voxel);
    let on = showing(&planes, regions, views, maps, voxel);
    Told { planes, on }
}

/// Per photo, the pixels of regions that lie on one of the planes.
fn showing(
    planes: &[Plane],
    regions: &[Region],
    views: &[View],
    maps: &[DepthMap],
    voxel: f32,
) -> Vec<Vec<bool>> {
    let mut on: Vec<Vec<bool>> = views.iter().map(|v| vec![false; v.luma.len()]).collect();
    for region in regions {
        let (view, map) = (&views[region.view], &maps[region.view]);
        for i in region.pixels.iter().map(|&i| i as usize) {
            let place = Place::new(view, map, i, voxel);
            let shows = |plane: &Plane| plane.height(view.center) > 0.0 && place.lies_on(plane);
            on[region.view][i] = planes.iter().any(shows);
        }
    }
    on
}

#[cfg(test)]
mod tests;
