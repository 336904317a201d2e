//! What became of the matter of every source, and its surface where it is now.

use std::collections::HashMap;

use motes_scene::Surface;

use super::images::{Fate, Images};
use super::surface;
use crate::{EditState, Fill, Origin, SCENE};

/// What became of the rows of the scene, and what fills each hole.
pub(super) fn fates(state: &EditState, rows: usize) -> (Images, Vec<Fill>) {
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
                fills.push(Fill::default());
                fills.len() as u32 - 1
            }),
        };
        Fate { hole: Some(hole), ..fate.clone() }
    });
    (images, fills)
}

/// Surfaces of what was inserted, where it is now.
pub(super) fn append_sources(state: &EditState, mesh: &mut Surface) {
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
