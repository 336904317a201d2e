//! Texture of the ground around a hole, continued into it.
//!
//! ```text
//! a = log c - log L
//! ```
//!
//! `c` is the ground as it looks from above, `L` the light of white matte matter there. `a` goes on by example
//! ([`super::exemplar`], [`super::pieces`]), and `exp a` is the unlit color of what fills the hole. Its mean is not taken out: ground is told from
//! other ground by its color at least as well as by its grain.

use glam::Vec3;
use motes_scene::Gaussians;

use super::colors::Projection;
use super::examples::examples_of;
use super::exemplar::{Raster, filled};
use super::foretold::is_foretold;
use super::grid::{Grid, boxed};
use super::hole::Hole;
use super::looks::Seen;
use super::pieces::with_pieces;
use super::plane_picture::plane_picture;

/// Cells of the texture over the object's size, where the ground has no finer cells anyway.
const CELLS: f32 = 112.0;
/// A cell of the ground is divided into so many along a side at most.
const FINEST: usize = 3;
/// Half a side of a patch, share of the object's size, and in cells: a strip of ground as narrow as a tenth beside the hole holds
/// whole patches.
const PATCH: f32 = 0.05;
const PATCH_CELLS: [usize; 2] = [3, 14];
/// Light varies by less where the ground may serve as an example, log units: no edge of a shadow is copied.
const EVEN_LIGHT: f32 = 0.05;
/// Light is a mean over so many cells of the ground to each side, since it is sampled.
const LIGHT_WINDOW: usize = 2;
/// Ground that varies by less within a patch has no texture, log units, root mean square.
const LEAST_DEVIATION: f64 = 0.025;
/// Radiance below says nothing but dark, as in `calibrate`.
const LEAST_RADIANCE: f32 = 2e-3;
/// Cells of examples that a hole needs.
const LEAST_EXAMPLES: usize = 400;

/// Unlit colors of ground and hole, per cell of a raster of its own.
#[derive(Debug)]
pub(super) struct Texture {
    grid: Grid,
    log_unlit: Vec<[f32; 3]>,
}

impl Texture {
    /// Of the ground around a hole, or none where it has none or too little of it is seen. `low` are the rows of the ground.
    pub(super) fn new(
        hole: &Hole,
        gaussians: &Gaussians,
        seen: &Seen,
        projection: &Projection,
        antialias: motes_raster::Antialias,
    ) -> Option<Self> {
        let per_object = hole.object_size / hole.grid.pitch;
        let factor = ((CELLS / per_object).round() as usize).clamp(1, FINEST);
        let grid = hole.grid.divided(factor);
        let picture = plane_picture(&grid, gaussians, &seen.low, projection, antialias);
        let coarse = |c: usize| hole.grid.cell(grid.middle(c));
        let (log_light, even) = light(hole, seen);
        let cells = 0..grid.cells();
        let log_ratio = |c: usize| {
            let from = coarse(c).filter(|from| seen.is_known(*from))?;
            let color = picture[c]?.max(Vec3::splat(LEAST_RADIANCE)).map(f32::ln);
            Some((color - log_light[from]).to_array())
        };
        let ratios: Vec<Option<[f32; 3]>> = cells.clone().map(log_ratio).collect();
        let known: Vec<bool> = ratios.iter().map(Option::is_some).collect();
        let values: Vec<[f32; 3]> = ratios.into_iter().map(Option::unwrap_or_default).collect();
        let serves = |from: usize| even[from] && !hole.occupied[from];
        let examples: Vec<bool> =
            cells.clone().map(|c| known[c] && coarse(c).is_some_and(serves)).collect();
        let radius = (PATCH * hole.object_size / grid.pitch).round() as usize;
        let radius = radius.clamp(PATCH_CELLS[0], PATCH_CELLS[1]);
        has_texture(&grid, &values, &examples, radius).then_some(())?;
        let open = cells.map(|c| !known[c] && coarse(c).is_some_and(|from| hole.blurred[from]));
        let raster = Raster {
            size: grid.size,
            values: &values,
            known: &known,
            examples: &examples,
            hole: &open.collect::<Vec<_>>(),
            radius,
        };
        Some(Self { log_unlit: continued(&raster)?, grid })
    }

    /// Width of a cell, world units.
    pub(super) fn pitch(&self) -> f32 {
        self.grid.pitch
    }

    /// Color without light at coordinates of the plane, linear.
    pub(super) fn unlit_at(&self, flat: [f32; 2]) -> Option<Vec3> {
        Some(Vec3::from(self.log_unlit[self.grid.cell(flat)?]).map(f32::exp))
    }
}

/// The values with the hole filled: patch by patch where examples foretell the ground, by pieces as large as they get where they
/// do not, since patches of grain would repeat. `None` where too little ground can be copied.
fn continued(raster: &Raster<'_>) -> Option<Vec<[f32; 3]>> {
    let examples = examples_of(raster)?;
    if is_foretold(raster, &examples) {
        return Some(filled(raster, &examples));
    }
    let (values, known) = with_pieces(raster);
    Some(filled(&Raster { values: &values, known: &known, ..*raster }, &examples))
}

/// Logarithm of the light per cell of the ground, smoothed, and whether it is even there.
fn light(hole: &Hole, seen: &Seen) -> (Vec<Vec3>, Vec<bool>) {
    let grid = &hole.grid;
    let of = |c: usize| {
        if !seen.is_known(c) {
            return [0.0; 4];
        }
        let [r, g, b] = seen.white_radiance[c].max(Vec3::splat(1e-6)).to_array().map(f32::ln);
        [r, g, b, 1.0]
    };
    let logs: Vec<[f32; 4]> = (0..grid.cells()).map(of).collect();
    let mean = |[r, g, b, n]: [f32; 4]| Vec3::new(r, g, b) / n.max(1.0);
    let near: Vec<Vec3> = boxed(grid.size, &logs, LIGHT_WINDOW).into_iter().map(mean).collect();
    let wider: Vec<Vec3> =
        boxed(grid.size, &logs, 3 * LIGHT_WINDOW).into_iter().map(mean).collect();
    let even = (0..grid.cells())
        .map(|c| seen.is_known(c) && (near[c] - wider[c]).abs().max_element() < EVEN_LIGHT)
        .collect();
    (near, even)
}

/// Whether enough ground is seen, and varies within patches.
fn has_texture(grid: &Grid, values: &[[f32; 3]], examples: &[bool], radius: usize) -> bool {
    let mean = |v: &[f32; 3]| v.iter().sum::<f32>() / 3.0;
    let own = values.iter().zip(examples);
    let own: Vec<[f32; 2]> =
        own.map(|(v, example)| if *example { [mean(v), 1.0] } else { [0.0; 2] }).collect();
    let (mut squares, mut count) = (0.0f64, 0usize);
    for ([value, known], [sum, near]) in own.iter().zip(boxed(grid.size, &own, radius)) {
        if *known > 0.0 {
            squares += f64::from(value - sum / near).powi(2);
            count += 1;
        }
    }
    count >= LEAST_EXAMPLES && squares > count as f64 * LEAST_DEVIATION.powi(2)
}
