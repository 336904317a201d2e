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

/// Leaves one plane of every wall, the one that explains the photos best, and puts the pixels of the others onto it.
pub(in crate::steps::surface) fn joined(
    mut planes: Vec<Plane>,
    regions: &[Region],
    views: &[View],
    maps: &mut [DepthMap],
    voxel: f32,
) -> Vec<Plane> {
    let shades = shades(views);
    while let Some([kept, dropped]) = {
        let photos = Photos::new(views, maps, &shades);
        pairs(planes.len()).find_map(|[a, b]| same_wall(&photos, &planes, [a, b], regions, voxel))
    } {
        put(&planes[kept], &planes[dropped], regions, views, maps, voxel);
        planes.remove(dropped);
    }
    planes
}

fn pairs(count: usize) -> impl Iterator<Item = [usize; 2]> {
    (0..count).flat_map(move |a| (a + 1..count).map(move |b| [a, b]))
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
    if two[0].normal.dot(two[1].normal) < ALIKE {
        return None;
    }
    let shows = |region: &&Region| {
        let on = |&i: &u32| lies_on_any(&two, photos.views, photos.maps, region.view, i, voxel);
        let held = region.looked_at().filter(on).count();
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

fn lies_on_any(
    planes: &[Plane],
    views: &[View],
    maps: &[DepthMap],
    view: usize,
    i: u32,
    voxel: f32,
) -> bool {
    let place = Place::new(&views[view], &maps[view], i as usize, voxel);
    planes.iter().any(|plane| place.lies_on(plane))
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
        let view = &views[region.view];
        for &i in &region.pixels {
            if !lies_on_any(&[*dropped], views, maps, region.view, i, voxel) {
                continue;
            }
            if let Some(z) = kept.depth(view, view.pixel_ray(view.at(i))) {
                maps[region.view].depth[i as usize] = z;
            }
        }
    }
}

#[cfg(test)]
mod tests;
