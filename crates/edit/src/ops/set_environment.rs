//! Another environment for a decomposed scene.

use glam::DVec3;
use motes_scene::Convention;
use motes_shading::environment::MapAxes;
use relight::{Exposure, LightSource, Place, environment_image};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation, Short};
use crate::run::{
    EditError, Fault, Outcome, Resources, Run, applied, direction, finite, positive, skipped,
};
use crate::{EditState, SceneParts};

/// Rows of a map that a turned one is painted into, at least.
const LEAST_ROWS: usize = 512;

/// Put a decomposed scene under another light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetEnvironmentOp {
    /// Lat-long map (.exr, .hdr), linear.
    pub file: String,
    /// Axes of the map.
    #[serde(default)]
    pub convention: Convention,
    /// Vector in world to the map's zenith. Default: the scene's up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// Degrees about the map's up, counter-clockwise seen from above.
    #[serde(default)]
    pub rotate_deg: f64,
    /// Factor on the light, above 0: photo value of radiance 1.
    #[serde(default = "unit")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub exposure: f64,
}

impl Operation for SetEnvironmentOp {
    const FLAGS: &'static [Flag] = &[Flag::of(
        "set-environment",
        Short::Text("file"),
        "FILE",
        "Light a decomposed scene with another environment map",
    )];

    fn check(&self) -> Result<(), Fault> {
        finite("/rotate_deg", &[self.rotate_deg])?;
        self.up.as_ref().map_or(Ok(()), |up| direction("/up", up))?;
        positive("/exposure", self.exposure)
    }

    fn files(&mut self) -> Vec<(String, &mut String)> {
        vec![("/file".into(), &mut self.file)]
    }

    fn apply(
        &self,
        run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let Some(parts) = &mut state.parts else {
            return skipped("a plain splat has its light in its colors: decompose it first");
        };
        set_environment(parts, self, state.up_in_world, run.resources, at)?;
        applied(state.len())
    }
}

fn unit() -> f64 {
    1.0
}

/// Replaces the environment.
fn set_environment(
    parts: &mut SceneParts,
    op: &SetEnvironmentOp,
    up: DVec3,
    resources: &Resources<'_>,
    at: &str,
) -> Result<(), EditError> {
    let image = resources.environment(&op.file).map_err(EditError::file(at))?;
    let convention = op.convention;
    let rows = image.height.max(LEAST_ROWS);
    let axes = match op.up {
        Some(zenith) => MapAxes {
            convention,
            zenith_in_world: DVec3::from_array(zenith).normalize_or(convention.up()),
        },
        None => MapAxes::upright(convention, up),
    };
    let source = LightSource::Map { image: image.clone(), axes };
    // Also checks the map: what no light has is repaired or refused here.
    let light = source
        .light(
            op.rotate_deg,
            Exposure::Factor(op.exposure as f32),
            &Place::with_up(up.as_vec3()),
            &|| None,
        )
        .map_err(|error| EditError::plan(format!("{at}/file"), error.to_string()))?;
    let as_stored = op.rotate_deg == 0.0 && !light.clean_up.any();
    parts.environment = match as_stored {
        true => image.scaled(op.exposure as f32),
        false => environment_image(&light.environment, axes, rows),
    };
    parts.axes = axes;
    parts.environment_changed = true;
    Ok(())
}
