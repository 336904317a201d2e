//! Two sheets of one wall: a part of it that all photos show a little before or behind the rest.

use motes_math::median::upper_median;

use super::consistency::{Photos, shades};
use super::{HELD, Place, Region};
use crate::steps::surface::planes::Plane;
use crate::steps::surface::splat_depth::DepthMap;
use crate::steps::surface::view::View;

/// Cosine of the angle (5 degrees), and distance over that from the camera, up to which two planes are one wall.
const ALIKE: f32 = 0.996;
const APART: f32 = 0.04;
/// Share of its distance by which a pixel is moved from one to the other at most.
const MOST_MOVE: f32 = 0.125;

/// Leaves one plane of every wall, the one that explains the photos best, and puts the pixels of the others onto it.
pub(in crate::steps::surface) fn joined(
    mut planes: Vec<Plane>,
    regions: &[Region],
    views: &[View],
    maps: &mut [DepthMap],
    voxel: f32,
) -> Vec<Plane> {
    loop {
        let alike = alike(&planes);
        if alike.is_empty() {
            return planes;
        }
        let shades = shades(views);
        let photos = Photos::new(views, maps, &shades);
        let same = |&pair: &[usize; 2]| same_wall(&photos, &planes, pair, regions, voxel);
        let Some([kept, dropped]) = alike.iter().find_map(same) else { return planes };
        put(&planes[kept], &planes[dropped], regions, views, maps, voxel);
        planes.remove(dropped);
    }
}

/// Pairs of planes along each other.
fn alike(planes: &[Plane]) -> Vec<[usize; 2]> {
    let pairs = (0..planes.len()).flat_map(|a| (a + 1..planes.len()).map(move |b| [a, b]));
    pairs.filter(|&[a, b]| planes[a].normal.dot(planes[b].normal) >= ALIKE).collect()
}

/// The plane of the two to keep and the one to drop, when both are the same wall.
fn same_wall(
    photos: &Photos<'_>,
    planes: &[Plane],
    pair: [usize; 2],
    regions: &[Region],
    voxel: f32,
) -> Option<[usize; 2]> {
    let two = pair.map(|k| planes[k]);
    let shows = |region: &&Region| {
        let (view, map) = (&photos.views[region.view], &photos.maps[region.view]);
        let lies_on_either = |&i: &u32| {
            let place = Place::new(view, map, i as usize, voxel);
            two.iter().any(|plane| place.lies_on(plane))
        };
        let held = region.looked_at().filter(lies_on_either).count();
        held as f32 >= HELD * region.looked_at().count() as f32
    };
    let (mut apart, mut costs) = (Vec::new(), [0.0; 2]);
    for region in regions.iter().filter(shows) {
        let height = two[1].height(photos.views[region.view].center);
        let places = photos.on_plane(region, &two[0]).into_iter();
        apart.extend(places.map(|(_, at)| two[1].height(at).abs() / height.abs()));
        if let [Some(a), Some(b)] = two.map(|plane| photos.by_plane(region, &plane)) {
            let size = region.pixels.len() as f32;
            costs = [costs[0] + a.mean * size, costs[1] + b.mean * size];
        }
    }
    let is_near = upper_median(&mut apart, f32::total_cmp).is_some_and(|share| share <= APART);
    let [a, b] = pair;
    is_near.then_some(if costs[0] <= costs[1] { [a, b] } else { [b, a] })
}

/// Puts the pixels of regions that lie on one plane onto another.
fn put(
    kept: &Plane,
    dropped: &Plane,
    regions: &[Region],
    views: &[View],
    maps: &mut [DepthMap],
    voxel: f32,
) {
    for region in regions {
        let (view, map) = (&views[region.view], &mut maps[region.view]);
        for i in region.pixels.iter().map(|&i| i as usize) {
            let z = kept.depth(view, view.pixel_ray(view.at(i as u32)));
            // Where a ray grazes them, the planes are far apart.
            let z = z.filter(|z| (z - map.depth[i]).abs() <= MOST_MOVE * z);
            if let Some(z) = z.filter(|_| Place::new(view, map, i, voxel).lies_on(dropped)) {
                map.depth[i] = z;
            }
        }
    }
}

#[cfg(test)]
mod tests;
