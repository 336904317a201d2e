//! The order of work.

use std::collections::{HashMap, HashSet};

use glam::Vec3;
use motes_scene::{ExtraColumn, Materials, Surface};
use rayon::prelude::*;
use relight::{QualityOptions, RelightScene, Relighter};

use super::colors::Projection;
use super::cover::{Cover, Orphans};
use super::fill::{Filling, dressed_lid, fill_with_plane};
use super::hole::{GROUNDED, Hole, Left, find_hole};
use super::images::{Fate, Images};
use super::looks::{Seen, continued_looks, window};
use super::patch::best_shift;
use super::plane_picture::plane_picture;
use super::ratio::{self, Rows};
use super::{ReshadeError, ReshadeOptions, ReshadeReport, light_of, surface};
use crate::refit::Fills;
use crate::{EditState, Fill, Origin, SCENE, Similarity};

/// Directions per vertex for the light that surfaces send on, beside those per Gaussian.
const CACHE: relight::Quality = relight::Quality::Standard;

pub(super) fn reshade(
    state: &mut EditState,
    options: &ReshadeOptions,
) -> Result<(Surface, ReshadeReport), ReshadeError> {
    let light = light_of(state)?;
    let before = scene_before(state)?;
    let mut report = ReshadeReport::default();
    report.triangles[0] = before.surface().triangles.len();

    let (images, fills) = fates(state, before.gaussians.len());
    let fate_of_vertex = images.of_vertices(&before.gaussians, before.surface());
    let left = |v: u32| !images.fate(fate_of_vertex[v as usize]).stays();
    let cover = Cover::new(&before, left);
    let projection = Projection::new(state.gaussians.sh_degree);
    let mut holes: Vec<(Hole, Fill)> = Vec::new();
    // A copy that moves on leaves a place where nothing of the scene was.
    let rows = 0..before.gaussians.len() as u32;
    let vacated: HashSet<u32> = rows.filter_map(|row| images.of_row(row).hole).collect();
    let asked = |(k, fill): &(usize, &Fill)| **fill != Fill::None && vacated.contains(&(*k as u32));
    for (k, fill) in fills.iter().enumerate().filter(asked) {
        let found = cover.as_ref().and_then(|cover| {
            let left =
                Left { before: &before, images: &images, fate_of_vertex: &fate_of_vertex, cover };
            find_hole(&left, &projection, (k as u32, *fill), options.seed)
        });
        match found {
            Some(hole) => {
                report.uneven += usize::from(hole.grid.is_uneven());
                holes.push((hole, *fill));
            }
            None => report.unfilled.push(
                "around a place that was left the surface is neither a plane nor a field of heights: it stays open"
                    .to_owned(),
            ),
        }
    }
    let replaced = replaced_vertices(&before, cover.as_ref(), &holes);
    if let Some(cover) = &cover {
        let stayed = |v: u32| !left(v) && !replaced[v as usize];
        let orphans = Orphans::new(cover, before.surface(), left, stayed);
        remove_leftovers(state, &before, &holes, cover, orphans.as_ref(), &mut report);
    }
    let mut mesh =
        surface::moved(before.surface(), &images, &fate_of_vertex, &state.motions, |v| {
            replaced[v as usize]
        });
    append_sources(state, &mut mesh);

    let quality = QualityOptions::of(CACHE);
    let same_light = !state.parts.as_ref().is_some_and(|parts| parts.environment_changed);
    // Under another light nothing of the old colours stays, so the old light need not be known.
    let lit_before = Relighter::new(&before, &light, &quality, options.seed);
    let mut looks = Vec::with_capacity(holes.len());
    let first_new = state.len();
    for (hole, fill) in &mut holes {
        let seen = seen(state, &before, &lit_before, hole, &projection, options);
        let materials = materials_of(state)?;
        let looks_within =
            |cells| continued_looks(hole, &state.gaussians, &materials, &seen, cells);
        let of_hole = looks_within(window(&hole.grid, hole.object_size));
        if *fill == Fill::Patch {
            match best_shift(hole, &looks_within(0)) {
                Some(shift) => report.filled += copy_patch(state, hole, shift),
                None => {
                    *fill = Fill::Plane;
                    report.warnings.push(
                        "no piece of the surroundings fits a hole: its plane goes on instead"
                            .to_owned(),
                    );
                }
            }
        }
        surface::append(&mut mesh, &dressed_lid(hole, &of_hole));
        looks.push((of_hole, seen.rows));
    }
    let first_filled = state.len();
    let (mut unlit, mut hole_of_filled) = (Vec::new(), Vec::new());
    for (number, (hole, _)) in holes.iter().enumerate().filter(|(_, (_, f))| *f == Fill::Plane) {
        let (looks, rows) = &looks[number];
        let filling = fill_with_plane(hole, &state.gaussians, rows, looks);
        report.filled += filling.gaussians.len();
        unlit.extend_from_slice(&filling.unlit);
        hole_of_filled.resize(unlit.len(), number);
        append_filling(state, filling);
    }
    report.fills = fills_of(state, &holes, first_new);
    // Rays must meet the new materials, or the bounce light of an object keeps its old colour.
    mesh = ratio::with_materials_of(state, &materials_of(state)?, &mesh);

    let parts = state.parts.as_ref().ok_or(ReshadeError::NoScene)?;
    let after = RelightScene::new(
        state.gaussians.clone(),
        mesh,
        parts.lobes,
        parts.indirect,
        before.up_in_world,
    )?;
    let lit_after = Relighter::new(&after, &light, &quality, options.seed);
    let (before, after) = ((&before, &lit_before), (&after, &lit_after));
    let mut rows = Rows::default();
    if same_light {
        rows = ratio::sort(state, before.0, after.0, first_filled);
        let holes: Vec<&Hole> = holes.iter().map(|(hole, _)| hole).collect();
        let (scaled, calibrations) =
            ratio::scale(state, &rows, before, after, &holes, &projection, options);
        report.scaled = scaled;
        report.shadow_exponents = calibrations
            .iter()
            .flatten()
            .filter_map(|c| c.exponent.map(|e| e.to_array()))
            .collect();
        let filled =
            state.gaussians.means[first_filled..].iter().zip(&mut unlit).zip(&hole_of_filled);
        for ((mean, unlit), hole) in filled {
            let calibration = calibrations[*hole].as_ref();
            if let Some(better) = calibration.and_then(|c| c.unlit_at(Vec3::from(*mean))) {
                *unlit = better;
            }
        }
        ratio::light_filling(state, first_filled, &unlit, after, &projection, options);
    } else {
        let all = 0..state.len() as u32;
        rows.anew = all.filter(|&i| ratio::is_known(&after.0.materials, i as usize)).collect();
    }
    report.shaded = ratio::shade_anew(state, &rows.anew, &lit_after, options);
    let surface = surface::compacted(after.0.surface());
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

fn scene_before(state: &EditState) -> Result<RelightScene, ReshadeError> {
    let (Some(parts), Some(source)) = (&state.parts, state.sources.first()) else {
        return Err(ReshadeError::NoScene);
    };
    let gaussians = source.gaussians.as_deref().ok_or(ReshadeError::NoScene)?.clone();
    let surface = source.surface.as_deref().cloned().unwrap_or_default();
    let up = state.up_in_world.as_vec3();
    Ok(RelightScene::new(gaussians, surface, parts.lobes, parts.indirect, up)?)
}

/// What became of the rows of the scene, and what fills each hole.
fn fates(state: &EditState, rows: usize) -> (Images, Vec<Fill>) {
    let of_scene = |o: &&Origin| o.source == SCENE && o.row != Origin::NEW_ROW;
    let now = state.origins.iter().filter(of_scene).map(|o| (o.row, o.motion));
    let images = Images::new(rows, now);
    let mut fills: Vec<Fill> = state.holes.iter().map(|hole| hole.fill).collect();
    let mut deleted: HashMap<u32, u32> = HashMap::new();
    for (k, hole) in state.holes.iter().enumerate() {
        hole.removed.iter().filter(of_scene).for_each(|o| _ = deleted.insert(o.row, k as u32));
    }
    // What was moved leaves a hole as well; nobody asks for a fill there, and nobody wants none.
    let mut moved: HashMap<Vec<u32>, u32> = HashMap::new();
    let images = images.with_fates(|row, _| {
        let is_known =
            |row: u32| !images.of_row(row).motions.is_empty() || deleted.contains_key(&row);
        let row = state.survivor_of(row, is_known);
        let fate = images.of_row(row);
        if fate.stays() {
            return fate.clone();
        }
        let hole = match (deleted.get(&row), fate.motions.is_empty()) {
            (Some(hole), _) => *hole,
            // Neither deleted nor anywhere: merged with others, at the same place.
            (None, true) => return Fate::stayed(),
            (None, false) => *moved.entry(fate.motions.clone()).or_insert_with(|| {
                fills.push(Fill::Plane);
                fills.len() as u32 - 1
            }),
        };
        Fate { hole: Some(hole), ..fate.clone() }
    });
    (images, fills)
}

/// Surfaces of what was inserted, where it is now.
fn append_sources(state: &EditState, mesh: &mut Surface) {
    for (number, source) in state.sources.iter().enumerate().skip(1) {
        let Some(part) = source.surface.as_deref() else { continue };
        let of_source = |o: &&Origin| o.source == number as u32 && o.row != Origin::NEW_ROW;
        let now = state.origins.iter().filter(of_source).map(|o| (o.row, o.motion));
        let placed = match source.gaussians.as_deref() {
            Some(gaussians) => {
                let images = Images::new(gaussians.len(), now);
                let fate_of_vertex = images.of_vertices(gaussians, part);
                surface::moved(part, &images, &fate_of_vertex, &state.motions, |_| false)
            }
            None => part.clone(),
        };
        surface::append(mesh, &surface::compacted(&placed));
    }
}

/// Vertices that go because something else is there now: the lid of a hole, or nothing but air.
fn replaced_vertices(
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
fn remove_leftovers(
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

/// The ground around a hole as the Gaussians show it that lie on it, and its light before the edit.
fn seen(
    state: &EditState,
    before: &RelightScene,
    lit_before: &Relighter<'_>,
    hole: &Hole,
    projection: &Projection,
    options: &ReshadeOptions,
) -> Seen {
    let grid = &hole.grid;
    let stays = |i: &u32| {
        let origin = &state.origins[*i as usize];
        let p = Vec3::from(state.gaussians.means[*i as usize]);
        origin.source == SCENE
            && origin.row != Origin::NEW_ROW
            && state.motions[origin.motion as usize].is_identity()
            && hole.is_low(p)
            && grid.cell(grid.plane.flat(p)).is_some()
    };
    // Seen from above, whatever the ground is made of: its Gaussians scatter more than the surface.
    let low: Vec<u32> = (0..state.len() as u32).filter(stays).collect();
    let picture = plane_picture(grid, &state.gaussians, &low, projection, before.antialias);
    let lies = |i: &u32| {
        let row = state.origins[*i as usize].row as usize;
        hole.on_plane(Vec3::from(state.gaussians.means[*i as usize]))
            && Vec3::from(before.materials.normals[row]).dot(grid.plane.normal) > GROUNDED
    };
    let rows = low.into_iter().filter(lies).collect();
    Seen::new(hole, rows, picture, lit_before, options.samples)
}

/// What fills the holes, from a row on, and what was there around them.
fn fills_of(state: &EditState, holes: &[(Hole, Fill)], first_new: usize) -> Fills {
    let rims: Vec<Vec<bool>> = holes.iter().map(|(hole, _)| hole.rim()).collect();
    let around = |i: &u32| {
        let origin = &state.origins[*i as usize];
        let p = Vec3::from(state.gaussians.means[*i as usize]);
        origin.source == SCENE
            && state.motions[origin.motion as usize].is_identity()
            && holes.iter().zip(&rims).any(|((hole, _), rim)| hole.on_rim(rim, p))
    };
    Fills {
        filled: (first_new as u32..state.len() as u32).collect(),
        rim: (0..first_new as u32).filter(around).collect(),
    }
}

/// Copies the Gaussians of the plane that are `shift` away from the open cells; returns how many.
fn copy_patch(state: &mut EditState, hole: &Hole, shift: [f32; 2]) -> usize {
    let plane = hole.grid.plane;
    let offset = plane.axes[0] * shift[0] + plane.axes[1] * shift[1];
    let back = Similarity::translation(-offset.as_dvec3());
    let fits = |i: &u32| {
        let origin = &state.origins[*i as usize];
        let p = Vec3::from(state.gaussians.means[*i as usize]);
        let at_home = origin.source == SCENE && state.motions[origin.motion as usize].is_identity();
        at_home
            && hole.on_plane(p)
            && hole.grid.cell(plane.flat(p - offset)).is_some_and(|c| hole.open[c])
    };
    let rows: Vec<u32> = (0..state.len() as u32).filter(fits).collect();
    let mut copies = state.gaussians.clone();
    copies.gather(&rows);
    for mean in &mut copies.means {
        let (from, to) = (Vec3::from(*mean), Vec3::from(*mean) - offset);
        let relief = |p: Vec3| hole.grid.relief_at(plane.flat(p));
        *mean = (to + plane.normal * (relief(to) - relief(from))).to_array();
    }
    let origins = rows.iter().map(|&i| state.origins[i as usize]).collect();
    let first = state.len() as u32;
    state.append(copies, origins);
    let added: Vec<u32> = (first..state.len() as u32).collect();
    state.note_motion(&added, &back);
    rows.len()
}

fn materials_of(state: &EditState) -> Result<Materials, ReshadeError> {
    Ok(Materials::of(&state.gaussians).map_err(relight::SceneError::Column)?)
}

/// Adds the Gaussians of a filling, still without colour.
fn append_filling(state: &mut EditState, filling: Filling) {
    let n = filling.gaussians.len();
    if n == 0 {
        return;
    }
    let mut gaussians = filling.gaussians.with_sh_degree(state.gaussians.sh_degree);
    filling.materials.attach(&mut gaussians);
    // Columns that only the scene knows are empty in what is new.
    gaussians.extra = state
        .gaussians
        .extra
        .iter()
        .map(|column| {
            let own = gaussians.extra.iter().find(|c| c.name == column.name).cloned();
            own.unwrap_or_else(|| {
                let values = column.values.zeros(n);
                ExtraColumn { name: column.name.clone(), values }
            })
        })
        .collect();
    let origin = Origin { source: SCENE, row: Origin::NEW_ROW, motion: crate::AT_REST };
    state.append(gaussians, vec![origin; n]);
}
