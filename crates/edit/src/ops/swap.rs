//! Putting something else where the target is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::insert::is_default;
use super::operation::{Flag, Operation, Short};
use crate::EditState;
use crate::changes::delete::delete;
use crate::changes::insert::AssetSize;
use crate::run::{
    EditError, Fault, Fill, FitDocument, Outcome, Run, SurroundingsDocument, Wanted, direction,
    extent_of, finite, flat, mesh_count, positive, rows_of,
};

/// Put something else where the target is, base on base.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SwapOp {
    /// What is replaced.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// A splat, a scene folder, or a triangle mesh (PLY with faces, glTF, OBJ).
    pub file: String,
    /// Name of the selection of what was inserted.
    #[serde(default, rename = "as", skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// What it is scaled to.
    #[serde(default)]
    pub fit: FitDocument,
    /// Height that it gets instead, world units, above 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub height: Option<f64>,
    /// Its own direction up. Default: what its scene folder says, +y for glTF and OBJ, else +z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// Degrees about the scene's up, counter-clockwise seen from above.
    #[serde(default)]
    pub rotate_deg: f64,
    /// Number of Gaussians that a mesh becomes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 10_000_000))]
    pub gaussians: Option<u64>,
    /// Material of a mesh or splat that has none: a name of the library.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// What happens to ground that a splat brings along.
    #[serde(default, skip_serializing_if = "is_default")]
    pub surroundings: SurroundingsDocument,
    /// What fills the place of what went; the plane it stood on when nothing is said.
    #[serde(default)]
    pub fill: Fill,
}

impl Operation for SwapOp {
    const FLAGS: &'static [Flag] = &[Flag::of(
        "swap",
        Short::Text("file"),
        "FILE",
        "Replace the selection with a splat, a scene folder or a mesh",
    )];
    const SHARED: &'static [&'static str] = &["fill", "height", "surroundings"];

    fn check(&self) -> Result<(), Fault> {
        finite("/rotate_deg", &[self.rotate_deg])?;
        self.up.as_ref().map_or(Ok(()), |up| direction("/up", up))?;
        self.height.map_or(Ok(()), |height| positive("/height", height))?;
        mesh_count(self.gaussians)
    }

    fn refers_to(&self) -> Option<(&'static str, &str)> {
        self.target.as_deref().map(|target| ("target", target))
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
        let rows = rows_of(state, self.target.as_deref(), at)?;
        let old = extent_of(state, &rows, at)?;
        let material = self.material.as_deref();
        let (up, count, surroundings) = (self.up, self.gaussians, self.surroundings);
        let wanted = Wanted { file: &self.file, up, count, material, surroundings };
        let asset = run.asset(&wanted, at)?;
        let size = match (self.height, self.fit) {
            (Some(height), _) => AssetSize::Height(height),
            (None, FitDocument::Height) => AssetSize::Height(old.height()),
            (None, FitDocument::Footprint) => AssetSize::Footprint(old.footprint()),
            (None, FitDocument::None) => AssetSize::Factor(1.0),
        };
        let placement = asset
            .placement(old.base(), state.up_in_world, self.rotate_deg, size)
            .ok_or_else(|| flat(at))?;
        run.lift_shadow(state, &rows, at);
        delete(state, &rows, self.fill);
        run.place(state, asset, &placement, self.name.as_deref(), at)
    }
}
