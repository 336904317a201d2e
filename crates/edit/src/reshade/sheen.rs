//! How ground changes with the direction of view.
//!
//! ```text
//! ratio(d) = Σ c(d) / Σ c̄        over the seen cells around a hole; c̄: mean of the views that colors are read from
//! ```
//!
//! Polished and wet ground shows its surroundings. What fills a hole has one color toward every viewer, and would be a dull stain on it.

use glam::Vec3;
use motes_raster::Antialias;
use motes_scene::Gaussians;

use super::colors::{DIRECTIONS, Projection};
use super::hole::Hole;
use super::looks::Seen;
use super::plane_picture::{plane_pictures, views_of};

/// Photos look at ground from higher than this (sine): below, harmonics say anything.
const LOWEST_VIEW: f32 = 0.2;
/// Ground gets no brighter or darker than by this factor.
const LARGEST: f32 = 4.0;
/// Fewer cells do not tell.
const LEAST_CELLS: usize = 32;

/// Color over its mean toward each viewer of a projection, of the ground beside a hole; 1 where that is not known.
pub(super) fn sheen(
    hole: &Hole,
    gaussians: &Gaussians,
    seen: &Seen,
    projection: &Projection,
    antialias: Antialias,
) -> [Vec3; DIRECTIONS] {
    let grid = &hole.grid;
    let mut ratios = [Vec3::ONE; DIRECTIONS];
    let around = grid.grown(&hole.rim(), hole.rim_width());
    let cells: Vec<usize> = (0..grid.cells()).filter(|c| around[*c] && seen.is_known(*c)).collect();
    let is_level = gaussians.sh_degree == 0;
    if is_level || cells.len() < LEAST_CELLS {
        return ratios;
    }
    let high: Vec<usize> = (0..DIRECTIONS)
        .filter(|d| projection.to_viewer[*d].dot(grid.plane.normal) >= LOWEST_VIEW)
        .collect();
    let usual = views_of(&grid.plane);
    let toward = high.iter().map(|d| std::slice::from_ref(&projection.to_viewer[*d]));
    let sets: Vec<&[Vec3]> = std::iter::once(&usual[..]).chain(toward).collect();
    let pictures = plane_pictures(grid, gaussians, &seen.low, projection, antialias, &sets);
    let sum = |picture: &[Option<Vec3>]| cells.iter().filter_map(|c| picture[*c]).sum::<Vec3>();
    let mean = sum(&pictures[0]);
    if !(mean.min_element() > 0.0) {
        return ratios;
    }
    for (d, picture) in high.into_iter().zip(&pictures[1..]) {
        ratios[d] = (sum(picture) / mean).clamp(Vec3::splat(LARGEST.recip()), Vec3::splat(LARGEST));
    }
    ratios
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::grid::Grid;
    use super::super::looks::hole_in;
    use super::super::support::Plane;
    use super::*;

    /// Ground that is brighter from the side that light comes from, with a hole in the middle.
    fn of_ground(degree: u8, slope: f32) -> [Vec3; DIRECTIONS] {
        let plane = Plane::new(DVec3::Z, DVec3::ZERO);
        let corners = [[-1.0, -1.0], [1.0, 1.0]].map(|f| plane.point(f));
        let grid = Grid::over(plane, &corners, 0.05, 0.0).expect("a grid");
        let projection = Projection::new(degree);
        let mut gaussians = Gaussians::empty(degree);
        let is_open = |p: [f32; 2]| p.iter().all(|v| v.abs() < 0.3);
        for c in 0..grid.cells() {
            gaussians.means.push(plane.point(grid.middle(c)).to_array());
            gaussians.rotations.push([1.0, 0.0, 0.0, 0.0]);
            gaussians.log_scales.push([0.04f32.ln(); 3]);
            gaussians.opacity_logits.push(6.0);
            let mut sh = vec![0.0; 3 * gaussians.sh_coefficients()];
            projection.set_even(&mut sh, Vec3::splat(0.2));
            projection.scale(&mut sh, |d| Vec3::splat(1.0 + slope * projection.to_viewer[d].x));
            gaussians.sh.extend(sh);
        }
        let open: Vec<bool> = (0..grid.cells()).map(|c| is_open(grid.middle(c))).collect();
        let seen = Seen::of_cells(&grid, (0..gaussians.len() as u32).collect(), &open);
        let hole = hole_in(grid, open);
        sheen(&hole, &gaussians, &seen, &projection, Antialias::Mip)
    }

    #[test]
    fn ground_that_shines_toward_one_side_does_so_in_its_hole() {
        let projection = Projection::new(3);
        for slope in [0.0, 0.4] {
            let ratios = of_ground(3, slope);
            for (ratio, to_viewer) in ratios.iter().zip(&projection.to_viewer) {
                let high = to_viewer.z >= LOWEST_VIEW;
                let wanted = if high { 1.0 + slope * to_viewer.x } else { 1.0 };
                assert!((ratio.y - wanted).abs() < 0.03, "{slope} {to_viewer}: {ratio}");
            }
        }
        assert_eq!(of_ground(0, 0.4), [Vec3::ONE; DIRECTIONS]);
    }
}
