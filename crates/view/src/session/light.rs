//! The light that somebody wishes, as an operation of a plan.

use edit::ops::{OpDocument, SetEnvironmentOp};
use motes_scene::Convention;
use serde::Deserialize;

use super::act::{Act, ActError};
use super::{Session, scene::OwnLight};

/// A light.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightWish {
    /// As `relight --sun` takes it; the light of the capture when it is not there.
    pub sun: Option<String>,
    /// Degrees about up, counter-clockwise seen from above.
    #[serde(default)]
    pub rotate_deg: f64,
    /// Factor above 0.
    #[serde(default = "one")]
    pub exposure: f64,
    /// Whether it takes the place of the light before it in the plan.
    #[serde(default)]
    pub replace: bool,
}

fn one() -> f64 {
    1.0
}

impl Session<'_> {
    /// Lights the scene so.
    ///
    /// # Errors
    /// A plain splat has no light; the light is none.
    pub fn light(&self, wish: LightWish) -> Result<(), ActError> {
        let Some(own) = &self.scene.own_light else {
            let text = "a plain splat has its light in its colors: decompose it first";
            return Err(ActError::Unfit(text.into()));
        };
        let LightWish { sun, rotate_deg, exposure, replace } = wish;
        let OwnLight { file, convention, zenith } = own.clone();
        let op = match sun {
            Some(_) => SetEnvironmentOp {
                file: None,
                sun,
                convention: Convention::default(),
                up: None,
                rotate_deg,
                exposure,
            },
            None => SetEnvironmentOp {
                file: Some(file),
                sun: None,
                convention,
                up: Some(zenith),
                rotate_deg,
                exposure,
            },
        };
        self.act(Act { op: OpDocument::SetEnvironment(op), replace })
    }
}
