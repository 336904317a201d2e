//! The operations that bring something else in.

use glam::{DQuat, DVec3};
use motes_formats::edit_plan::{AlignDocument, FitDocument, InsertOp, SwapOp};

use super::EditError;
use super::apply::{Outcome, Run, applied};
use super::asset::{AssetRequest, load_asset};
use super::moving::within_range;
use super::preview::whole_extent;
use super::values::{extent_of, flat, keep, rows_of};
use crate::ops::insert::{Asset, AssetSize, InsertNotes, insert};
use crate::ops::measure::Extent;
use crate::ops::{delete, ground};
use crate::{EditState, Similarity};

/// What is inserted is usually as large as this times the scene.
const USUAL_SIZE: std::ops::Range<f64> = 0.02..5.0;

impl Run<'_> {
    pub(super) fn insert(
        &mut self,
        op: &InsertOp,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let asset = self.asset(&op.file, op.up, op.gaussians, op.material.as_deref(), at)?;
        let size = match op.height {
            Some(height) => AssetSize::Height(height),
            None => AssetSize::Factor(op.scale.unwrap_or(1.0)),
        };
        let placement = match op.align {
            AlignDocument::None => {
                let turn = DQuat::from_axis_angle(state.up_in_world, op.rotate_deg.to_radians());
                let shift = DVec3::from_array(op.at.unwrap_or_default());
                let scale = match size {
                    AssetSize::Factor(factor) => factor,
                    AssetSize::Height(height) => {
                        asset.extent().map_or(1.0, |extent| height / extent.height())
                    }
                    AssetSize::Footprint(_) => 1.0,
                };
                Some(Similarity::about(DVec3::ZERO, turn, scale, shift))
                    .filter(|_| scale.is_finite())
            }
            AlignDocument::Ground => {
                if op.height.is_none() && op.scale.is_none() {
                    self.tell_size(&asset, state, at);
                }
                let to = op.at.map_or_else(|| self.free_ground(state, at), DVec3::from_array);
                asset.placement(to, state.up_in_world, op.rotate_deg, size)
            }
        };
        let placement = placement.ok_or_else(|| flat(at))?;
        self.place(state, asset, &placement, op.name.as_deref(), at)
    }

    fn asset(
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
    fn tell_size(&mut self, asset: &Asset, state: &EditState, at: &str) {
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
    fn place(
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
    pub(super) fn free_ground(&mut self, state: &EditState, at: &str) -> DVec3 {
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

    pub(super) fn swap(
        &mut self,
        op: &SwapOp,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let rows = rows_of(state, op.target.as_deref(), at)?;
        let old = extent_of(state, &rows, at)?;
        let asset = self.asset(&op.file, op.up, op.gaussians, op.material.as_deref(), at)?;
        let size = match op.fit {
            FitDocument::Height => AssetSize::Height(old.height()),
            FitDocument::Footprint => AssetSize::Footprint(old.footprint()),
            FitDocument::None => AssetSize::Factor(1.0),
        };
        let placement = asset
            .placement(old.base(), state.up_in_world, op.rotate_deg, size)
            .ok_or_else(|| flat(at))?;
        self.lift_shadow(state, &rows, at);
        delete::delete(state, &rows, op.fill);
        self.place(state, asset, &placement, op.name.as_deref(), at)
    }

    pub(super) fn tell(&mut self, notes: &InsertNotes, state: &EditState, at: &str) {
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
