//! Another environment for a decomposed scene.

use glam::DVec3;
use motes_formats::edit_plan::SetEnvironmentOp;
use motes_formats::environment::read_environment;
use relight::{Exposure, LightSource, environment_image};

use super::{EditError, Resources};
use crate::SceneParts;

/// Rows of a map that a turned one is painted into, at least.
const LEAST_ROWS: usize = 512;

/// Replaces the environment.
pub(super) fn set_environment(
    parts: &mut SceneParts,
    op: &SetEnvironmentOp,
    up: DVec3,
    resources: &Resources<'_>,
    at: &str,
) -> Result<(), EditError> {
    let image = read_environment(&resources.file(&op.file)).map_err(EditError::file(at))?;
    let convention = op.convention;
    let rows = image.height.max(LEAST_ROWS);
    let source = LightSource::Map { image: image.clone(), convention };
    // Also checks the map: what no light has is repaired or refused here.
    let light = source
        .light(op.rotate_deg, Exposure::Factor(op.exposure as f32), up.as_vec3(), &|| None)
        .map_err(|error| EditError::plan(format!("{at}/file"), error.to_string()))?;
    let as_stored = op.rotate_deg == 0.0 && !light.clean_up.any();
    parts.environment = match as_stored {
        true => image.scaled(op.exposure as f32),
        false => environment_image(&light.environment, convention, rows),
    };
    parts.convention = convention;
    parts.environment_changed = true;
    Ok(())
}
