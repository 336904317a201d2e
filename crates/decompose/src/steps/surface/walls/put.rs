//! Pixels that lie on a plane by what other photos show.

use super::Region;
use super::consistency::Photos;
use super::spread::{Compared, Explained};
use crate::steps::surface::planes::Plane;
use crate::steps::surface::splat_depth::DepthMap;

/// Difference that the plane may leave over that of the depth.
const EXPLAINED: f32 = 1.0;

/// Pixels of a piece of a region, with their depth on the plane, and the number of those that their own depth explains better.
pub(super) struct Put {
    pub(super) piece: usize,
    view: usize,
    pub(super) depths: Vec<(usize, f32)>,
    pub(super) against: usize,
}

impl Put {
    pub(super) fn apply(&self, maps: &mut [DepthMap]) {
        self.depths.iter().for_each(|&(i, z)| maps[self.view].depth[i] = z);
    }
}

/// The pixels of a region that a plane explains as well as their depth does.
pub(super) fn put(photos: &Photos<'_>, region: &Region, piece: usize, plane: &Plane) -> Put {
    let (view, map) = (&photos.views[region.view], &photos.maps[region.view]);
    let on_plane = |i: usize| {
        let at = view.at(i as u32);
        plane.depth(view, view.pixel_ray(at)).map(|z| (at, z))
    };
    let compared = Compared::of(region, view, |i| {
        let (at, z) = on_plane(i)?;
        photos.rivals(region.view, i, [z, map.depth[i]].map(|z| view.place(at, z)))
    });
    let explained = compared.explained(EXPLAINED);
    let is = |i: u32, by: Explained| explained[compared.cell(view.at(i))] == by;
    let depth = |&i: &u32| {
        let (_, z) = on_plane(i as usize).filter(|_| is(i, Explained::ByWall))?;
        Some((i as usize, z))
    };
    let depths = region.pixels.iter().filter_map(depth).collect();
    let against = region.pixels.iter().filter(|&&i| is(i, Explained::ByDepth)).count();
    Put { piece, view: region.view, depths, against }
}
