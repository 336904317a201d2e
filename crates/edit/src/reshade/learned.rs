//! What the planes that objects left say about the light that the edit changes ([`super::calibrate`]).

use glam::Vec3;
use relight::{Probe, RelightScene};

use super::calibrate::{Calibration, Observed, changed_grid, is_change};
use super::colors::Projection;
use super::grid::Grid;
use super::hole::{ALIGNED, Hole, covered};
use super::plane_picture::plane_picture;
use super::ratio::{Change, METAL, Rows, White};
use crate::EditState;

/// How to correct `log L_after - log L_before` of a Gaussian: times the exponent, less the shift.
#[derive(Clone, Copy, Debug)]
pub(super) struct Correction {
    pub(super) exponent: Vec3,
    pub(super) shift: Vec3,
}

impl Default for Correction {
    fn default() -> Self {
        Self { exponent: Vec3::ONE, shift: Vec3::ZERO }
    }
}

/// What the ground of each hole says, and the correction of every row that is scaled.
pub(super) fn learned(
    state: &EditState,
    rows: &Rows,
    white: &White,
    light: &Change<'_>,
    holes: &[&Hole],
) -> (Vec<Correction>, Vec<Option<Calibration>>) {
    let Change { before, after, projection, options } = *light;
    let mut corrections = vec![Correction::default(); rows.scaled.len()];
    let log_white = |probes: &[Probe]| {
        [before.1, after.1].map(|lit| white.log(&lit.white_radiance(probes, options.samples)))
    };
    let of_hole = |hole: &&Hole| {
        let stays = |k: &usize| {
            let (i, then, now) = &rows.scaled[*k];
            then.position.distance(now.position) <= hole.tolerance
                && after.0.materials.metallic[*i as usize] < METAL
        };
        let staying: Vec<usize> = (0..rows.scaled.len()).filter(stays).collect();
        let is_changed = |k: &&usize| is_change(white.log_then[**k], white.log_now[**k]);
        let now = |k: &usize| &rows.scaled[*k].2;
        let is_ground = |p: &&Probe| hole.is_ground(p.position, p.normal);
        let changed = staying.iter().filter(is_changed).map(now).filter(is_ground);
        let places: Vec<Vec3> = changed.map(|p| p.position).collect();
        let grid = changed_grid(hole.grid.plane, hole.object_size, &places)?;
        let grid = hole.raised(grid, before.0.surface(), options.seed)?;
        let lies = |k: &&usize| {
            let Probe { position, normal, .. } = *now(k);
            let flat = grid.plane.flat(position);
            grid.height(position).abs() <= hole.tolerance && normal.dot(grid.normal(flat)) > ALIGNED
        };
        let lying: Vec<usize> = staying.iter().filter(lies).copied().collect();
        let shown: Vec<u32> = lying.iter().map(|k| rows.scaled[*k].0).collect();
        let found = calibrated(state, &shown, grid, hole, log_white, before.0, projection)?;
        for &k in &lying {
            let shift = corrections[k].shift + found.shift_at(rows.scaled[k].2.position);
            let exponent = found.exponent.unwrap_or(corrections[k].exponent);
            corrections[k] = Correction { exponent, shift };
        }
        Some(found)
    };
    let calibrations = holes.iter().map(of_hole).collect();
    (corrections, calibrations)
}

/// Learns from the cells of a plane, as the Gaussians `shown` make it look.
fn calibrated(
    state: &EditState,
    shown: &[u32],
    grid: Grid,
    hole: &Hole,
    log_white: impl Fn(&[Probe]) -> [Vec<Vec3>; 2],
    before: &RelightScene,
    projection: &Projection,
) -> Option<Calibration> {
    let mut radiance = plane_picture(&grid, &state.gaussians, shown, projection, before.antialias);
    let covered = covered(&grid, before.surface(), hole.tolerance, &|_| true);
    let of_hole = |marks: &[bool], c: usize| {
        hole.grid.cell(grid.plane.flat(grid.point(grid.middle(c)))).is_some_and(|c| marks[c])
    };
    let blurred = (0..grid.cells()).map(|c| of_hole(&hole.blurred, c)).collect();
    for (c, radiance) in radiance.iter_mut().enumerate() {
        if !covered[c] || of_hole(&hole.open, c) {
            *radiance = None;
        }
    }
    let probes: Vec<Probe> = (0..grid.cells()).map(|c| grid.probe(c, 1 << 40)).collect();
    let [log_before, log_after] = log_white(&probes);
    let observed = Observed { radiance, blurred, log_before, log_after };
    Calibration::new(grid, &observed, hole.object_size)
}
