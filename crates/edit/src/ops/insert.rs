//! Bringing something else in.

use glam::{DQuat, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation, Short};
use crate::changes::insert::AssetSize;
use crate::run::{
    AlignDocument, EditError, Fault, Outcome, PlaceDocument, Run, SurroundingsDocument, Wanted,
    direction, finite, flat, mesh_count, positive,
};
use crate::{EditState, Similarity};

/// Add another splat, scene folder or mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InsertOp {
    /// A splat, a scene folder, or a triangle mesh (PLY with faces, glTF, OBJ).
    pub file: String,
    /// Name of the selection of what was inserted.
    #[serde(default, rename = "as", skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// How it finds its place.
    #[serde(default)]
    pub align: AlignDocument,
    /// Where its base comes to stand (with `ground`): a point in world units, or the pixel of a view that shows it; default: free
    /// ground nearest to the middle of the scene. With `none` a shift, world units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<PlaceDocument>,
    /// Its own direction up. Default: what its scene folder says, +y for glTF and OBJ, else +z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// Degrees about the scene's up, counter-clockwise seen from above.
    #[serde(default)]
    pub rotate_deg: f64,
    /// Factor on its size, above 0. Not together with `height`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<f64>,
    /// Height that it gets, world units, above 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub height: Option<f64>,
    /// Number of Gaussians that a mesh becomes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 10_000_000))]
    pub gaussians: Option<u64>,
    /// Material of a mesh or splat that has none: a name of the library.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// What happens to ground that a splat brings along, with `ground`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub surroundings: SurroundingsDocument,
}

pub(super) fn is_default(surroundings: &SurroundingsDocument) -> bool {
    *surroundings == SurroundingsDocument::default()
}

impl Operation for InsertOp {
    const FLAGS: &'static [Flag] = &[
        Flag::of(
            "insert",
            Short::Text("file"),
            "FILE",
            "Insert a splat, a scene folder or a mesh, standing on the ground",
        ),
        Flag::of(
            "merge",
            Short::Text("file"),
            "FILE",
            "Insert a splat, a scene folder or a mesh at its own coordinates",
        )
        .setting("align", "none"),
    ];
    const SHARED: &'static [&'static str] = &["at", "height", "surroundings"];

    fn check(&self) -> Result<(), Fault> {
        match &self.at {
            Some(PlaceDocument::Point(at)) => finite("/at", at)?,
            Some(PlaceDocument::Pixel(_)) if self.align == AlignDocument::None => {
                let cause = "with \"align\": \"none\" it keeps its coordinates: \"at\" is a shift of three numbers";
                return Err(("/at".into(), cause.into(), None));
            }
            Some(PlaceDocument::Pixel(at)) => finite("/at/pixel", &at.pixel)?,
            None => {}
        }
        self.up.as_ref().map_or(Ok(()), |up| direction("/up", up))?;
        finite("/rotate_deg", &[self.rotate_deg])?;
        self.scale.map_or(Ok(()), |s| positive("/scale", s))?;
        self.height.map_or(Ok(()), |s| positive("/height", s))?;
        if self.scale.is_some() && self.height.is_some() {
            let cause = "\"scale\" and \"height\" exclude each other";
            return Err(("/height".into(), cause.into(), None));
        }
        mesh_count(self.gaussians)
    }

    fn defines(&self) -> Option<(&'static str, &str)> {
        self.name.as_deref().map(|name| ("as", name))
    }

    fn files(&mut self) -> Vec<(String, &mut String)> {
        vec![("/file".into(), &mut self.file)]
    }

    fn material(&self) -> Option<(&'static str, &str)> {
        self.material.as_deref().map(|name| ("material", name))
    }

    fn apply(
        &self,
        run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let material = self.material.as_deref();
        let surroundings = match self.align {
            AlignDocument::Ground => self.surroundings,
            AlignDocument::None => SurroundingsDocument::Keep,
        };
        let wanted =
            Wanted { file: &self.file, up: self.up, count: self.gaussians, material, surroundings };
        let asset = run.asset(&wanted, at)?;
        let size = match self.height {
            Some(height) => AssetSize::Height(height),
            None => AssetSize::Factor(self.scale.unwrap_or(1.0)),
        };
        let placement = match self.align {
            AlignDocument::None => {
                let turn = DQuat::from_axis_angle(state.up_in_world, self.rotate_deg.to_radians());
                let shift = match &self.at {
                    Some(PlaceDocument::Point(at)) => DVec3::from_array(*at),
                    _ => DVec3::ZERO,
                };
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
                if self.height.is_none() && self.scale.is_none() {
                    run.tell_size(&asset, state, at);
                }
                let to = match &self.at {
                    Some(PlaceDocument::Point(to)) => DVec3::from_array(*to),
                    Some(PlaceDocument::Pixel(pixel)) => run.shown_at(state, pixel, at)?,
                    None => run.free_ground(state, &asset, size, at),
                };
                asset.placement(to, state.up_in_world, self.rotate_deg, size)
            }
        };
        let placement = placement.ok_or_else(|| flat(at))?;
        run.place(state, asset, &placement, self.name.as_deref(), at)
    }
}
