//! What the planes that objects left say about the light that the edit changes ([`super::calibrate`]).

use glam::Vec3;
use motes_relighting::{Probe, RelightScene};

use super::ReshadeOptions;
use super::calibrate::{Calibration, Observed, changed_grid, is_change};
use super::colors::Projection;
use super::hole::{ALIGNED, Hole, covered};
use super::plane_picture::plane_picture;
use super::ratio::{Lit, METAL, Rows, White};
use crate::EditState;

/// What the plane of each hole says, and the shift of every row that is scaled.
pub(super) fn learned(
    state: &EditState,
    rows: &Rows,
    white: &White,
    before: Lit<'_>,
    after: Lit<'_>,
    holes: &[&Hole],
    projection: &Projection,
    options: &ReshadeOptions,
) -> (Vec<Vec3>, Vec<Option<Calibration>>) {
    let mut shifts = vec![Vec3::ZERO; rows.scaled.len()];
    let log_white = |probes: &[Probe]| {
        [before.1, after.1].map(|lit| white.log(&lit.white_radiance(probes, options.samples)))
    };
    let of_hole = |hole: &&Hole| {
        if hole.grid.is_uneven() {
            return None;
        }
        let lies = |k: &usize| {
            let (i, then, now) = &rows.scaled[*k];
            then.position.distance(now.position) <= hole.tolerance
                && hole.on_plane(now.position)
                && now.normal.dot(hole.grid.plane.normal) > ALIGNED
                && after.0.materials.metallic[*i as usize] < METAL
        };
        let lying: Vec<usize> = (0..rows.scaled.len()).filter(lies).collect();
        let logs = [&white.log_then[..], &white.log_now];
        let found = calibrated(state, rows, &lying, hole, logs, log_white, before.0, projection)?;
        for &k in &lying {
            shifts[k] += found.shift_at(rows.scaled[k].2.position);
        }
        Some(found)
    };
    let calibrations = holes.iter().map(of_hole).collect();
    (shifts, calibrations)
}

/// Learns from the plane of a hole, as the Gaussians that lie in it look.
fn calibrated(
    state: &EditState,
    rows: &Rows,
    lying: &[usize],
    hole: &Hole,
    logs: [&[Vec3]; 2],
    log_white: impl Fn(&[Probe]) -> [Vec<Vec3>; 2],
    before: &RelightScene,
    projection: &Projection,
) -> Option<Calibration> {
    let place = |k: &usize| rows.scaled[*k].2.position;
    let changed: Vec<Vec3> =
        lying.iter().filter(|k| is_change(logs[0][**k], logs[1][**k])).map(place).collect();
    let plane = hole.grid.plane;
    let grid = changed_grid(plane, hole.object_size, &changed)?;
    let shown: Vec<u32> = lying.iter().map(|k| rows.scaled[*k].0).collect();
    let mut radiance = plane_picture(&grid, &state.gaussians, &shown, projection, before.antialias);
    let covered = covered(&grid, before.surface(), hole.tolerance, &|_| true);
    let of_hole = |marks: &[bool], c: usize| {
        hole.grid.cell(plane.flat(plane.point(grid.middle(c)))).is_some_and(|c| marks[c])
    };
    let blurred = (0..grid.cells()).map(|c| of_hole(&hole.blurred, c)).collect();
    for (c, radiance) in radiance.iter_mut().enumerate() {
        if !covered[c] || of_hole(&hole.open, c) {
            *radiance = None;
        }
    }
    let probe = |c: usize| Probe {
        position: plane.point(grid.middle(c)),
        normal: plane.normal,
        item: (1 << 40) + c as u64,
    };
    let probes: Vec<Probe> = (0..grid.cells()).map(probe).collect();
    let [log_before, log_after] = log_white(&probes);
    Calibration::new(grid, &Observed { radiance, blurred, log_before, log_after })
}
