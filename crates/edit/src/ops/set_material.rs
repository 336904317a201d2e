//! Changing what the target is made of.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation, Short};
use crate::EditState;
use crate::changes::color::{ColorChange, ColorMode};
use crate::changes::material::{MaterialChange, MaterialOutcome, set_material};
use crate::changes::materials::material_named;
use crate::run::{
    ColorChangeDocument, EditError, Fault, Outcome, Run, applied, color, color_values, range,
    rows_of, skipped,
};

/// Change what the target is made of. Keys win over the values of `name`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetMaterialOp {
    /// What to change.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// A material of the library, such as `chrome`, `brass`, `matte_black`, `oak`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Base color: diffuse reflectance of a dielectric, reflectance at normal incidence of a metal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_color: Option<ColorChangeDocument>,
    /// Perceptual roughness, 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub roughness: Option<f64>,
    /// 0 dielectric, 1 metal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub metallic: Option<f64>,
}

impl Operation for SetMaterialOp {
    const FLAGS: &'static [Flag] = &[Flag::of(
        "set-material",
        Short::Text("name"),
        "NAME",
        "Set the material of the selection, such as brass",
    )];

    fn check(&self) -> Result<(), Fault> {
        let nothing = self.name.is_none()
            && self.base_color.is_none()
            && self.roughness.is_none()
            && self.metallic.is_none();
        if nothing {
            let cause = "nothing is set: \"name\", \"base_color\", \"roughness\" or \"metallic\"";
            return Err((String::new(), cause.into(), None));
        }
        if let Some(change) = &self.base_color {
            color_values("/base_color/rgb_linear", change.mode, &change.rgb_linear)?;
        }
        self.roughness.map_or(Ok(()), |v| range("/roughness", v, 0.0, 1.0))?;
        self.metallic.map_or(Ok(()), |v| range("/metallic", v, 0.0, 1.0))
    }

    fn refers_to(&self) -> Option<(&'static str, &str)> {
        self.target.as_deref().map(|target| ("target", target))
    }

    fn material(&self) -> Option<(&'static str, &str)> {
        self.name.as_deref().map(|name| ("name", name))
    }

    fn apply(
        &self,
        run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let rows = rows_of(state, self.target.as_deref(), at)?;
        let mut change = MaterialChange::default();
        if let Some(material) = self.name.as_deref().and_then(material_named) {
            let rgb_linear = material.base_color_linear;
            change.base_color = Some(ColorChange { mode: ColorMode::Even, rgb_linear });
            (change.roughness, change.metallic) =
                (Some(material.roughness), Some(material.metallic));
        }
        if let Some(ColorChangeDocument { mode, rgb_linear }) = self.base_color {
            change.base_color = Some(color(mode, rgb_linear));
        }
        change.roughness = self.roughness.map(|v| v as f32).or(change.roughness);
        change.metallic = self.metallic.map(|v| v as f32).or(change.metallic);
        match set_material(state, &rows, &change) {
            MaterialOutcome::Columns => applied(rows.len()),
            MaterialOutcome::Shown if change.base_color.is_none() => {
                skipped("a plain splat has no roughness and no metallic: decompose it first")
            }
            MaterialOutcome::Shown => {
                run.unlit(state, at, "only the color changed, not how it reflects");
                applied(rows.len())
            }
        }
    }
}
