//! Pixels that lie on a plane by what other photos show.

use super::Region;
use super::consistency::Photos;
use super::spread::Compared;
use crate::steps::surface::planes::Plane;
use crate::steps::surface::splat_depth::DepthMap;

/// Difference that the plane may leave over that of the depth.
const EXPLAINED: f32 = 1.0;

/// Pixels of a piece of a region, with their depth on the plane.
pub(super) struct Put {
    pub(super) piece: usize,
    view: usize,
    pub(super) depths: Vec<(usize, f32)>,
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
    let is_on_plane = compared.is_wall(EXPLAINED);
    let depth = |&i: &u32| {
        let (at, z) = on_plane(i as usize)?;
        is_on_plane[compared.cell(at)].then_some((i as usize, z))
    };
    Put { piece, view: region.view, depths: region.pixels.iter().filter_map(depth).collect() }
}
