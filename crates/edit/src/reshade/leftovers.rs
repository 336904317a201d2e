//! What goes with the matter that left: its surface below a lid, and what it hid.

use glam::Vec3;
use rayon::prelude::*;
use relight::RelightScene;

use super::ReshadeReport;
use super::cover::{Cover, Orphans};
use super::hole::Hole;
use crate::{EditState, Fill, Origin, SCENE};

/// Vertices that go because something else is there now: the lid of a hole, or nothing but air.
pub(super) fn replaced_vertices(
    before: &RelightScene,
    cover: Option<&Cover>,
    holes: &[(Hole, Fill)],
) -> Vec<bool> {
    let vertices = &before.surface().vertices;
    let Some(cover) = cover.filter(|_| !holes.is_empty()) else {
        return vec![false; vertices.len()];
    };
    let replaced = |v: &[f32; 3]| {
        let p = Vec3::from(*v);
        holes.iter().any(|(hole, _)| hole.replaces(cover, p))
    };
    vertices.par_iter().with_min_len(256).map(replaced).collect()
}

/// Removes what was hidden in matter that left, and what belongs to it.
pub(super) fn remove_leftovers(
    state: &mut EditState,
    before: &RelightScene,
    holes: &[(Hole, Fill)],
    cover: &Cover,
    orphans: Option<&Orphans>,
    report: &mut ReshadeReport,
) {
    let hidden = |origin: &Origin| {
        let here = origin.source == SCENE
            && origin.row != Origin::NEW_ROW
            && state.motions[origin.motion as usize].is_identity();
        let row = origin.row as usize;
        let p = || Vec3::from(before.gaussians.means[row]);
        let is_orphan = || {
            orphans.is_some_and(|orphans| orphans.contains(p()))
                && !holes.iter().any(|(hole, _)| hole.on_plane(p()))
        };
        here && (holes.iter().any(|(hole, _)| hole.was_inside(before, cover, row))
            || (!holes.is_empty() && is_orphan()))
    };
    let hidden: Vec<bool> = state.origins.par_iter().with_min_len(256).map(hidden).collect();
    let kept: Vec<u32> = (0..state.len() as u32).filter(|&i| !hidden[i as usize]).collect();
    report.leftovers = state.len() - kept.len();
    if report.leftovers > 0 {
        state.gather(&kept);
    }
}
