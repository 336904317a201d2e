//! What the operations that bring something else in share.

use glam::DVec3;

use super::asset::{AssetRequest, load_asset};
use super::context::EditError;
use super::preview::whole_extent;
use super::targets::{keep, within_range};
use super::{Outcome, Run, applied};
use crate::changes::ground;
use crate::changes::insert::{Asset, InsertNotes, insert};
use crate::changes::measure::Extent;
use crate::{EditState, Similarity};

/// What is inserted is usually as large as this times the scene.
const USUAL_SIZE: std::ops::Range<f64> = 0.02..5.0;

impl Run<'_> {
    /// Reads what an operation inserts.
    pub(crate) fn asset(
        &self,
        file: &str,
        up: Option<[f64; 3]>,
        count: Option<u64>,
        material: Option<&str>,
        at: &str,
    ) -> Result<Asset, EditError> {
        let path = self.resources.file(file);
        load_asset(&AssetRequest { path: &path, name: file, up, count, material }, at)
    }

    /// Files of different makers have different units: what comes in far too small or too large was hardly meant so.
    pub(crate) fn tell_size(&mut self, asset: &Asset, state: &EditState, at: &str) {
        let size = |extent: Extent| extent.height().max(extent.footprint());
        let scene = whole_extent(&state.gaussians, state.up_in_world).map(size);
        let own = asset.extent().map(size);
        let (Some(scene), Some(own)) = (scene, own) else { return };
        let share = own / scene;
        if share.is_finite() && !USUAL_SIZE.contains(&share) {
            let text = format!(
                "what is inserted has {share:.2e} times the size of the scene: \"height\" or \"scale\" would change that"
            );
            self.warn(at, text);
        }
    }

    /// Brings the asset in and keeps it under its name.
    pub(crate) fn place(
        &mut self,
        state: &mut EditState,
        asset: Asset,
        placement: &Similarity,
        name: Option<&str>,
        at: &str,
    ) -> Result<Outcome, EditError> {
        within_range(asset.bounds(), at, |p| placement.point(p))?;
        let (selection, notes) = insert(state, asset, placement);
        self.tell(&notes, state, at);
        self.drop_ball_shadow(state, &selection.rows(), at);
        let n = selection.count();
        keep(state, name, selection);
        applied(n)
    }

    /// On the ground below the middle of the scene.
    pub(crate) fn free_ground(&mut self, state: &EditState, at: &str) -> DVec3 {
        let up = state.up_in_world;
        let middle = whole_extent(&state.gaussians, up).map_or(DVec3::ZERO, |e| e.base());
        match ground::find_ground(&state.gaussians, up) {
            Some(found) => middle + up * (found.height - middle.dot(up)),
            None => {
                self.warn(at, "no ground was found: it stands at the bottom of the scene");
                middle
            }
        }
    }

    fn tell(&mut self, notes: &InsertNotes, state: &EditState, at: &str) {
        if notes.guessed_material {
            self.warn(
                at,
                "what was inserted has no material: its colors are taken for base colors",
            );
        }
        if notes.guessed_surface {
            self.warn(
                at,
                "what was inserted has no surface: squares stand for it, which cast its shadow",
            );
        }
        if !notes.filled_columns.is_empty() {
            let names = notes.filled_columns.join(", ");
            self.warn(at, format!("columns that only one side has are zero on the other: {names}"));
        }
        self.unlit(state, at, "what was inserted keeps its own and casts no shadow");
    }
}
