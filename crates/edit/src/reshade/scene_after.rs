//! Re-shading after an edit: the steps in their order.

use std::collections::HashSet;

use glam::Vec3;
use motes_scene::Surface;
use motes_shading::environment::Environment;
use relight::{QualityOptions, RelightScene, Relighter};

use super::closing::{Closing, Filled, Ground, fill_planes, fills_of};
use super::colors::Projection;
use super::cover::{Cover, Orphans};
use super::fates::{append_sources, fates};
use super::hole::{Hole, Left, find_hole};
use super::images::Images;
use super::leftovers::{remove_leftovers, replaced_vertices};
use super::ratio::{self, Change, Rows, materials_of};
use super::{ReshadeError, ReshadeOptions, ReshadeReport, light_of, surface};
use crate::{EditState, Fill};

pub(super) fn reshade(
    state: &mut EditState,
    options: &ReshadeOptions,
) -> Result<(Surface, ReshadeReport), ReshadeError> {
    let light = light_of(state)?;
    let mut report = ReshadeReport::default();
    let matter = Matter::of(state)?;
    let before = &matter.before;
    report.triangles[0] = before.surface().triangles.len();
    let projection = Projection::new(state.gaussians.sh_degree);
    let mut holes = matter.holes(&projection, options.seed, &mut report);
    let mut mesh = matter.without_leftovers(state, &holes, &mut report);

    let quality = QualityOptions::of(options.quality);
    let same_light = !state.parts.as_ref().is_some_and(|parts| parts.environment_changed);
    // Under another light nothing of the old colors stays, so the old light need not be known; and without a hole nobody asks
    // how the scene before looks.
    let unlit = Environment::default();
    let asked = same_light || !holes.is_empty();
    let light_before = if asked { &light } else { &unlit };
    let lit_before = Relighter::new(before, light_before, &quality, options.seed);
    let closing = Closing { before: (before, &lit_before), projection: &projection, options };
    let first_new = state.len();
    let grounds = closing.close(state, &mut holes, &mut mesh, &mut report)?;
    let filled = fill_planes(state, &holes, &grounds, &mut report);
    report.fills = fills_of(state, &holes, first_new);
    // Rays must meet the new materials, or the bounce light of an object keeps its old color.
    mesh = ratio::with_materials_of(state, &materials_of(state)?, &mesh);

    let after = scene_after(state, mesh, before.up_in_world)?.as_rough_as(before);
    let lit_after = Relighter::new(&after, &light, &quality, options.seed);
    let change = Change {
        before: (before, &lit_before),
        after: (&after, &lit_after),
        projection: &projection,
        options,
    };
    let rows = if same_light {
        scale_light(state, &change, &holes, (filled, &grounds), &mut report)
    } else {
        let all = 0..state.len() as u32;
        let anew = all.filter(|&i| ratio::is_known(&after.materials, i as usize)).collect();
        Rows { anew, ..Rows::default() }
    };
    report.shaded = ratio::shade_anew(state, &rows.anew, &lit_after, options);
    let surface = surface::compacted(after.surface());
    report.triangles[1] = surface.triangles.len();
    Ok((surface, report))
}

/// The surface alone, without light and without lids.
pub(super) fn moved_surface(state: &EditState) -> Surface {
    let Some(source) = state.sources.first() else { return Surface::default() };
    let (Some(gaussians), Some(before)) = (&source.gaussians, &source.surface) else {
        return source.surface.as_deref().cloned().unwrap_or_default();
    };
    let (images, _) = fates(state, gaussians.len());
    let fate_of_vertex = images.of_vertices(gaussians, before);
    let mut mesh = surface::moved(before, &images, &fate_of_vertex, &state.motions, |_| false);
    append_sources(state, &mut mesh);
    if let Ok(materials) = materials_of(state) {
        mesh = ratio::with_materials_of(state, &materials, &mesh);
    }
    surface::compacted(&mesh)
}

/// The scene before the edit, and what became of its matter.
struct Matter {
    before: RelightScene,
    images: Images,
    /// What fills each hole that was left.
    fills: Vec<Fill>,
    fate_of_vertex: Vec<u32>,
    /// The triangles that left.
    cover: Option<Cover>,
}

impl Matter {
    fn of(state: &EditState) -> Result<Self, ReshadeError> {
        let before = scene_before(state)?;
        let (images, fills) = fates(state, before.gaussians.len());
        let fate_of_vertex = images.of_vertices(&before.gaussians, before.surface());
        let left = |v: u32| !images.fate(fate_of_vertex[v as usize]).stays();
        let cover = Cover::new(&before, left);
        Ok(Self { before, images, fills, fate_of_vertex, cover })
    }

    /// The holes that are to be filled; what stays open is reported.
    fn holes(
        &self,
        projection: &Projection,
        seed: u64,
        report: &mut ReshadeReport,
    ) -> Vec<(Hole, Fill)> {
        let Self { before, images, fate_of_vertex, .. } = self;
        let mut holes = Vec::new();
        // A copy that moves on leaves a place where nothing of the scene was.
        let rows = 0..before.gaussians.len() as u32;
        let vacated: HashSet<u32> = rows.filter_map(|row| images.of_row(row).hole).collect();
        let asked =
            |(k, fill): &(usize, &Fill)| **fill != Fill::None && vacated.contains(&(*k as u32));
        for (k, fill) in self.fills.iter().enumerate().filter(asked) {
            let found = self.cover.as_ref().and_then(|cover| {
                let left = Left { before, images, fate_of_vertex, cover };
                find_hole(&left, projection, (k as u32, *fill), seed)
            });
            match found {
                Some(hole) => {
                    report.uneven += usize::from(hole.grid.is_uneven());
                    if hole.floating > 0 {
                        report.unfilled.push(
                            "a place that was left reaches beyond the ground around it: it stays open there".to_owned(),
                        );
                    }
                    holes.push((hole, *fill));
                }
                None => report.unfilled.push(
                    "around a place that was left the surface is neither a plane nor a field of heights: it stays open"
                        .to_owned(),
                ),
            }
        }
        holes
    }

    /// Removes what was hidden in matter that left; returns the surface where it is now, without what the holes' lids replace.
    fn without_leftovers(
        &self,
        state: &mut EditState,
        holes: &[(Hole, Fill)],
        report: &mut ReshadeReport,
    ) -> Surface {
        let Self { before, images, fate_of_vertex, .. } = self;
        let left = |v: u32| !images.fate(fate_of_vertex[v as usize]).stays();
        let replaced = replaced_vertices(before, self.cover.as_ref(), holes);
        if let Some(cover) = &self.cover {
            let stayed = |v: u32| !left(v) && !replaced[v as usize];
            let orphans = Orphans::new(cover, before.surface(), left, stayed);
            remove_leftovers(state, before, holes, cover, orphans.as_ref(), report);
        }
        let dropped = |v: u32| replaced[v as usize];
        let mut mesh =
            surface::moved(before.surface(), images, fate_of_vertex, &state.motions, dropped);
        append_sources(state, &mut mesh);
        mesh
    }
}

fn scene_before(state: &EditState) -> Result<RelightScene, ReshadeError> {
    let (Some(parts), Some(source)) = (&state.parts, state.sources.first()) else {
        return Err(ReshadeError::NoScene);
    };
    let gaussians = source.gaussians.as_deref().ok_or(ReshadeError::NoScene)?.clone();
    let surface = source.surface.as_deref().cloned().unwrap_or_default();
    let up = state.up_in_world.as_vec3();
    Ok(RelightScene::new(gaussians, surface, parts.lobes, parts.indirect, up)?)
}

fn scene_after(state: &EditState, mesh: Surface, up: Vec3) -> Result<RelightScene, ReshadeError> {
    let parts = state.parts.as_ref().ok_or(ReshadeError::NoScene)?;
    Ok(RelightScene::new(state.gaussians.clone(), mesh, parts.lobes, parts.indirect, up)?)
}

/// Scales colors by the change of the light, and lights what fills the holes; returns the rows that are to be shaded anew.
fn scale_light(
    state: &mut EditState,
    change: &Change<'_>,
    holes: &[(Hole, Fill)],
    (filled, grounds): (Filled, &[Ground]),
    report: &mut ReshadeReport,
) -> Rows {
    let Filled { first, mut unlit, by_example, hole } = filled;
    let rows = ratio::sort(state, change.before.0, change.after.0, first);
    let holes: Vec<&Hole> = holes.iter().map(|(hole, _)| hole).collect();
    let (scaled, calibrations) = ratio::scale(state, &rows, change, &holes);
    report.scaled = scaled;
    let exponents = calibrations.iter().flatten().filter_map(|c| c.exponent);
    report.shadow_exponents = exponents.map(|e| e.to_array()).collect();
    let smooth = unlit.iter_mut().zip(&hole).zip(&by_example);
    for (mean, ((unlit, hole), copied)) in state.gaussians.means[first..].iter().zip(smooth) {
        let calibration = calibrations[*hole].as_ref().filter(|_| !copied);
        if let Some(better) = calibration.and_then(|c| c.unlit_at(Vec3::from(*mean))) {
            *unlit = better;
        }
    }
    ratio::light_filling(state, first, &unlit, |k| &grounds[hole[k]].sheen, change);
    rows
}
