//! Operations on colors, materials and light.

use motes_formats::edit_plan::{
    ColorChangeDocument, RecolorOp, SetEnvironmentOp, SetMaterialOp, ShadowCatcherOp, StylizeOp,
};

use super::EditError;
use super::apply::{Outcome, Run, applied, skipped};
use super::light::set_environment;
use super::style::apply_style;
use super::values::{color, rows_of};
use crate::EditState;
use crate::ops::color::{ColorChange, ColorMode};
use crate::ops::ground;
use crate::ops::material::{MaterialChange, MaterialOutcome, set_material};
use crate::ops::materials::material_named;

impl Run<'_> {
    pub(super) fn set_material(
        &mut self,
        op: &SetMaterialOp,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let rows = rows_of(state, op.target.as_deref(), at)?;
        let mut change = MaterialChange::default();
        if let Some(material) = op.name.as_deref().and_then(material_named) {
            let rgb_linear = material.base_color_linear;
            change.base_color = Some(ColorChange { mode: ColorMode::Even, rgb_linear });
            (change.roughness, change.metallic) =
                (Some(material.roughness), Some(material.metallic));
        }
        if let Some(ColorChangeDocument { mode, rgb_linear }) = op.base_color {
            change.base_color = Some(color(mode, rgb_linear));
        }
        change.roughness = op.roughness.map(|v| v as f32).or(change.roughness);
        change.metallic = op.metallic.map(|v| v as f32).or(change.metallic);
        match set_material(state, &rows, &change) {
            MaterialOutcome::Columns => applied(rows.len()),
            MaterialOutcome::Shown if change.base_color.is_none() => {
                skipped("a plain splat has no roughness and no metallic: decompose it first")
            }
            MaterialOutcome::Shown => {
                self.unlit(state, at, "only the color changed, not how it reflects");
                applied(rows.len())
            }
        }
    }

    pub(super) fn set_environment(
        &self,
        op: &SetEnvironmentOp,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let Some(parts) = &mut state.parts else {
            return skipped("a plain splat has its light in its colors: decompose it first");
        };
        set_environment(parts, op, state.up_in_world, self.resources, at)?;
        applied(state.len())
    }

    pub(super) fn stylize(
        &mut self,
        op: &StylizeOp,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let rows = rows_of(state, op.target.as_deref(), at)?;
        if !self.resources.editors.starts(&op.editor, at)? {
            return skipped("a dry run starts no program");
        }
        let numbers = apply_style(state, &rows, op, self.seed, self.resources, at)?;
        if state.parts.is_some() {
            self.warn(at, "colors changed, base colors did not: relighting shows the old ones");
        }
        Ok(Outcome::Applied(rows.len() as u64, numbers))
    }
}

pub(super) fn recolor(
    op: &RecolorOp,
    state: &mut EditState,
    at: &str,
) -> Result<Outcome, EditError> {
    let base_color = Some(color(op.mode, op.rgb_linear));
    let change = MaterialChange { base_color, ..MaterialChange::default() };
    let rows = rows_of(state, op.target.as_deref(), at)?;
    set_material(state, &rows, &change);
    applied(rows.len())
}

pub(super) fn shadow_catcher(
    op: &ShadowCatcherOp,
    state: &mut EditState,
    at: &str,
) -> Result<Outcome, EditError> {
    let rows = match &op.target {
        Some(target) => rows_of(state, Some(target), at)?,
        None => ground::find_ground(&state.gaussians, state.up_in_world)
            .map(|found| ground::rows_on(&state.gaussians, &found))
            .unwrap_or_default(),
    };
    if rows.is_empty() {
        return Err(EditError::plan(at, "there is no ground for shadows to fall on")
            .remedy("select what catches shadows and name it as \"target\""));
    }
    ground::mark_catcher(state, &rows);
    applied(rows.len())
}
