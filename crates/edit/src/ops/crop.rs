//! Keeping one side of a region.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation, Short};
use crate::EditState;
use crate::changes::delete::{other_rows, rows_in_box, rows_in_sphere};
use crate::run::{
    BoxDocument, EditError, Fault, KeepDocument, Outcome, Run, SphereDocument, finite, positive,
    remove_found,
};

/// Keep one side of a region: exactly one of `box` and `sphere`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CropOp {
    /// A box.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub r#box: Option<BoxDocument>,
    /// A ball.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sphere: Option<SphereDocument>,
    /// Which side stays.
    #[serde(default)]
    pub keep: KeepDocument,
}

impl Operation for CropOp {
    const FLAGS: &'static [Flag] =
        &[Flag::of("crop", Short::Box, "X0,Y0,Z0,X1,Y1,Z1", "Keep Gaussians inside a box")];

    fn check(&self) -> Result<(), Fault> {
        match (&self.r#box, &self.sphere) {
            (Some(region), None) => check_box(region),
            (None, Some(ball)) => {
                finite("/sphere/center", &ball.center)?;
                positive("/sphere/radius", ball.radius)
            }
            _ => Err(("".into(), "exactly one of \"box\" and \"sphere\" is needed".into(), None)),
        }
    }

    fn apply(
        &self,
        _run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let inside = match (&self.r#box, &self.sphere) {
            (Some(b), _) => rows_in_box(state, DVec3::from_array(b.min), DVec3::from_array(b.max)),
            (_, Some(s)) => rows_in_sphere(state, DVec3::from_array(s.center), s.radius),
            _ => Vec::new(),
        };
        let outside = other_rows(&inside, state.len());
        let (kept, gone) = match self.keep {
            KeepDocument::Inside => (inside, outside),
            KeepDocument::Outside => (outside, inside),
        };
        if kept.is_empty() {
            return Err(EditError::plan(at, "nothing would be left")
                .remedy("the report of \"measure\" says where the Gaussians are"));
        }
        remove_found(state, &gone, "nothing lies on the side that goes")
    }
}

fn check_box(region: &BoxDocument) -> Result<(), Fault> {
    finite("/box/min", &region.min)?;
    finite("/box/max", &region.max)?;
    if region.min.iter().zip(&region.max).any(|(a, b)| a > b) {
        return Err(("/box".into(), "a smallest coordinate is above the largest".into(), None));
    }
    Ok(())
}
