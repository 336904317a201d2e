//! Pixels that lie on a plane by what other photos show.

use super::Region;
use super::consistency::Photos;
use super::spread::{Compared, Explanation};
use crate::steps::surface::planes::Plane;
use crate::steps::surface::splat_depth::DepthMap;

/// Difference that the plane may leave over that of the depth.
const EXPLAINED: f32 = 1.0;
/// Times as many pixels must lie on a plane as are explained better by their depth: else it is no plane, but the mean of what is there.
const LEAST_PUT: f32 = 4.4;

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
    let (compared, explained) = (&compared, &compared.explained(EXPLAINED));
    let of = |by: Explanation| {
        let is = move |i: &u32| explained[compared.cell(view.at(*i))] == by;
        region.pixels.iter().copied().filter(is)
    };
    let depth = |i: u32| on_plane(i as usize).map(|(_, z)| (i as usize, z));
    let depths = of(Explanation::Wall).filter_map(depth).collect();
    let against = of(Explanation::Depth).count();
    Put { piece, view: region.view, depths, against }
}

/// Whether so many pixels of the pieces that show a plane lie on it one by one, and hardly any beside it. Pixels of which no other
/// photo tells anything, since Gaussians hang before them in all, count neither way.
pub(super) fn lie_on_it(pieces: &[Put], least: f32) -> bool {
    let on = pieces.iter().map(|p| p.depths.len()).sum::<usize>() as f32;
    let beside = pieces.iter().map(|p| p.against).sum::<usize>() as f32;
    on >= least.max(LEAST_PUT * beside)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(on: usize, against: usize) -> Put {
        Put { piece: 0, view: 0, depths: vec![(0, 1.0); on], against }
    }

    #[test]
    fn a_wall_has_pixels_on_it_and_hardly_any_beside_it_whatever_no_photo_tells() {
        // Shares of 1,000 pixels: a wall, one that is hidden in most photos, and the mean of several things.
        assert!(lie_on_it(&[piece(660, 50), piece(500, 60)], 500.0));
        assert!(lie_on_it(&[piece(460, 85)], 400.0));
        assert!(!lie_on_it(&[piece(480, 120)], 400.0));
        assert!(!lie_on_it(&[piece(660, 50)], 700.0));
        assert!(!lie_on_it(&[], 1.0));
    }
}
