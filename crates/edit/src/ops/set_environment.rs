//! Another environment for a decomposed scene.

use glam::DVec3;
use motes_scene::Convention;
use motes_shading::environment::MapAxes;
use relight::{Exposure, LightSource, Place, SunOption, environment_image};
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
    /// Lat-long map (.exr, .hdr), linear. Either this or `sun`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// A light by name or by angles, as `relight --sun` takes it: `sunrise`, `noon,azimuth=-30`, `overcast`, `studio`. The ground stays as
    /// bright as it was. Either this or `file`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sun: Option<String>,
    /// Axes of the map.
    #[serde(default, skip_serializing_if = "is_default")]
    pub convention: Convention,
    /// Vector in world to the map's zenith. Default: the scene's up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// Degrees about the map's up, counter-clockwise seen from above.
    #[serde(default)]
    pub rotate_deg: f64,
    /// Factor on the light, above 0: photo value of radiance 1; of `sun`, a factor on what keeps the ground as bright as it was.
    #[serde(default = "unit")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub exposure: f64,
}

impl Operation for SetEnvironmentOp {
    const FLAGS: &'static [Flag] = &[
        Flag::of(
            "set-environment",
            Short::Text("file"),
            "FILE",
            "Light a decomposed scene with another environment map",
        ),
        Flag::of(
            "set-sun",
            Short::Text("sun"),
            "LIGHT",
            "Light a decomposed scene by a light with a name, such as sunset",
        ),
    ];

    fn check(&self) -> Result<(), Fault> {
        finite("/rotate_deg", &[self.rotate_deg])?;
        self.up.as_ref().map_or(Ok(()), |up| direction("/up", up))?;
        positive("/exposure", self.exposure)?;
        match (&self.file, &self.sun) {
            (Some(_), None) => Ok(()),
            (None, Some(sun)) => {
                let read = sun.parse::<SunOption>();
                read.map(|_| ()).map_err(|cause| ("/sun".into(), cause, None))
            }
            (None, None) => {
                let remedy = "give \"file\" (a map) or \"sun\" (a light by name)";
                Err((String::new(), "no light is named".into(), Some(remedy.into())))
            }
            (Some(_), Some(_)) => {
                let cause = "\"file\" and \"sun\" exclude each other";
                Err(("/sun".into(), cause.into(), None))
            }
        }
    }

    fn files(&mut self) -> Vec<(String, &mut String)> {
        self.file.iter_mut().map(|file| ("/file".into(), file)).collect()
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

fn is_default(convention: &Convention) -> bool {
    *convention == Convention::default()
}

/// Replaces the environment.
fn set_environment(
    parts: &mut SceneParts,
    op: &SetEnvironmentOp,
    up: DVec3,
    resources: &Resources<'_>,
    at: &str,
) -> Result<(), EditError> {
    match (&op.file, &op.sun) {
        (Some(file), _) => set_map(parts, op, file, up, resources, at)?,
        (None, Some(sun)) => set_sun(parts, op, sun, up, at)?,
        (None, None) => return Err(EditError::plan(at, "no light is named")),
    }
    parts.environment_changed = true;
    Ok(())
}

/// The light of a map.
fn set_map(
    parts: &mut SceneParts,
    op: &SetEnvironmentOp,
    file: &str,
    up: DVec3,
    resources: &Resources<'_>,
    at: &str,
) -> Result<(), EditError> {
    let image = resources.environment(file).map_err(EditError::file(at))?;
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
    Ok(())
}

/// A light by name: a white sheet on the ground is as bright as under the light that it replaces.
fn set_sun(
    parts: &mut SceneParts,
    op: &SetEnvironmentOp,
    sun: &str,
    up: DVec3,
    at: &str,
) -> Result<(), EditError> {
    let failed = |cause: String| EditError::plan(format!("{at}/sun"), cause);
    let source = LightSource::of_sun(&sun.parse::<SunOption>().map_err(failed)?, true);
    let place = Place::with_up(up.as_vec3());
    let replaced = LightSource::Map { image: parts.environment.clone(), axes: parts.axes };
    let own = || {
        let light = replaced.light(0.0, Exposure::Factor(1.0), &place, &|| None);
        light.ok().map(|light| light.environment)
    };
    let light = source
        .light(op.rotate_deg, Exposure::Ground, &place, &own)
        .map_err(|error| failed(error.to_string()))?;
    let zenith = op.up.map_or(up, DVec3::from_array);
    parts.axes = MapAxes::upright(op.convention, zenith);
    let image = environment_image(&light.environment, parts.axes, LEAST_ROWS);
    parts.environment = image.scaled(op.exposure as f32);
    Ok(())
}
