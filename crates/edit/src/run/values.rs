//! Values that operations share.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The point that rotation and scale leave where it is: a name, or `[x, y, z]` in world units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum PivotDocument {
    /// A named point.
    Named(PivotName),
    /// World units.
    Point([f64; 3]),
}

impl Default for PivotDocument {
    fn default() -> Self {
        Self::Named(PivotName::Centroid)
    }
}

/// Named pivots.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PivotName {
    /// The origin of the world.
    Origin,
    /// The mean of the centers, weighted by opacity.
    Centroid,
    /// Where the target stands: below its centroid, at its lowest.
    Base,
}

/// Rotation about an axis through the pivot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxisAngleDocument {
    /// Any length above 0.
    pub axis: [f64; 3],
    /// Degrees, counter-clockwise seen from the tip of the axis.
    pub deg: f64,
}

/// What fills the surface that becomes visible.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fill {
    /// Nothing.
    None,
    /// The support plane goes on with its own colors, smooth.
    Plane,
    /// The support plane goes on with its own colors and its texture, by example.
    #[default]
    Texture,
    /// Pieces of the surroundings are copied.
    Patch,
}

/// How a color changes another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ColorModeDocument {
    /// Hue and saturation of the given color, lightness as it is.
    Tint,
    /// Multiplied by the given factors.
    Gain,
    /// The given color; what varied around the mean still varies.
    #[default]
    Replace,
}

/// A change of base color.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ColorChangeDocument {
    /// How.
    #[serde(default)]
    pub mode: ColorModeDocument,
    /// Linear Rec. 709: 0 to 1 for `tint` and `replace`, factors from 0 for `gain`.
    pub rgb_linear: [f64; 3],
}

/// A box along the axes of the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxDocument {
    /// Smallest coordinates, world units.
    pub min: [f64; 3],
    /// Largest coordinates, world units.
    pub max: [f64; 3],
}

/// A ball.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereDocument {
    /// World units.
    pub center: [f64; 3],
    /// Above 0, world units.
    pub radius: f64,
}

/// Which side of a region stays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum KeepDocument {
    /// What is inside.
    #[default]
    Inside,
    /// What is outside.
    Outside,
}

/// Where something stands: a point, or what a pixel of a view of the capture shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum PlaceDocument {
    /// World units.
    Point([f64; 3]),
    /// What a view shows.
    Pixel(PixelDocument),
}

/// A pixel of a view of the capture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PixelDocument {
    /// Name of the view.
    pub view: String,
    /// Column and row, pixels of the photo.
    pub pixel: [f64; 2],
}

/// What happens to the ground that a splat brings along.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SurroundingsDocument {
    /// Such a splat is refused.
    #[default]
    Refuse,
    /// The largest cluster of what stands on that ground comes in, without the rest.
    Crop,
    /// All of it comes in.
    Keep,
}

/// How something that is inserted finds its place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AlignDocument {
    /// Its up is turned onto the scene's, and it stands on the ground.
    #[default]
    Ground,
    /// Its coordinates are those of the world already.
    None,
}

/// What a replacement is scaled to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FitDocument {
    /// The height of what it replaces.
    #[default]
    Height,
    /// The larger side of the footprint of what it replaces.
    Footprint,
    /// Nothing: its own size.
    None,
}

/// Order of the Gaussians in the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OrderDocument {
    /// Along a Z curve: neighbors in space are neighbors in the file.
    #[default]
    Morton,
}
