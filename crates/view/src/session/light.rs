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
    /// As `relight --sun` takes it.
    pub sun: Option<String>,
    /// Number of a map that the page offers; the light of the capture without either.
    pub map: Option<usize>,
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
        let LightWish { sun, map, rotate_deg, exposure, replace } = wish;
        let (file, convention, up) = match (&sun, map) {
            (Some(_), Some(_)) => {
                return Err(ActError::Unfit("a light is a sun or a map, not both".into()));
            }
            (Some(_), None) => (None, Convention::default(), None),
            (None, Some(map)) => {
                let offered = self.scene.maps.get(map);
                let known = || ActError::Unfit("no such map is offered".into());
                let file = offered.ok_or_else(known)?.file.clone();
                (Some(file), Convention::default(), None)
            }
            (None, None) => {
                let OwnLight { file, convention, zenith } = own.clone();
                (Some(file), convention, Some(zenith))
            }
        };
        let op = SetEnvironmentOp { file, sun, convention, up, rotate_deg, exposure };
        self.act(Act { op: OpDocument::SetEnvironment(op), replace })
    }
}
