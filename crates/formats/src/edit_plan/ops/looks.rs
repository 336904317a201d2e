//! Operations on what it looks like, and what looks at it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::edit_plan::values::{ColorChangeDocument, ColorModeDocument};
use motes_scene::Convention;

/// Change color: base color of a decomposed scene, the shown color of a plain splat.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RecolorOp {
    /// What to color.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// How.
    #[serde(default)]
    pub mode: ColorModeDocument,
    /// Linear Rec. 709: 0 to 1 for `tint` and `replace`, factors from 0 for `gain`.
    pub rgb_linear: [f64; 3],
}

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

/// Put a decomposed scene under another light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetEnvironmentOp {
    /// Lat-long map (.exr, .hdr), linear.
    pub file: String,
    /// Axes of the map.
    #[serde(default)]
    pub convention: Convention,
    /// Degrees about the map's up, counter-clockwise seen from above.
    #[serde(default)]
    pub rotate_deg: f64,
    /// Factor on the light, above 0: photo value of radiance 1.
    #[serde(default = "unit")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub exposure: f64,
}

/// Mark what shadows may fall on, for `export` and for shadows on plain splats: the column `shadow_catcher`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShadowCatcherOp {
    /// What catches. Default: the ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
}

/// Report number, box, centroid, base and mean color of the target.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasureOp {
    /// Of what.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
}

/// Write a picture of how it looks now, into the folder of thumbnails.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RenderOp {
    /// Name of the picture, a PNG.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// A view of the capture. Default: from the side, see `azimuth_deg`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view: Option<String>,
    /// What the camera looks at when there is no `view`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Where the camera stands around the target, degrees about up.
    #[serde(default)]
    pub azimuth_deg: f64,
    /// How high it stands, degrees above the horizon, -89 to 89.
    #[serde(default = "thirty")]
    #[schemars(range(min = -89.0, max = 89.0))]
    pub elevation_deg: f64,
    /// Longer side, pixels.
    #[serde(default = "preview_side")]
    #[schemars(range(min = 16, max = 8192))]
    pub size: u32,
}

/// Edit pictures of the scene with an external program and fit the Gaussians to them
/// (the loop of Instruct-NeRF2NeRF, Haque et al. 2023). Needs a capture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StylizeOp {
    /// What may change.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Passed to the editor.
    #[serde(default)]
    pub prompt: String,
    /// Command line: `{input}`, `{output}` and `{prompt}` are replaced by the rendered picture, the picture to write and the
    /// prompt. It is run without a shell.
    pub editor: String,
    /// Training views that are edited, evenly spread; 0: all.
    #[serde(default = "eight")]
    pub views: u32,
    /// Views that are edited first and warped to the others by depth; 0: every view is edited on its own.
    #[serde(default = "three_views")]
    pub key_views: u32,
    /// How often all views are edited again.
    #[serde(default = "two")]
    #[schemars(range(min = 1, max = 100))]
    pub rounds: u32,
    /// Steps of the fit in each round.
    #[serde(default = "steps")]
    #[schemars(range(min = 1, max = 100_000))]
    pub steps: u32,
    /// Weight views by how far they agree with the others.
    #[serde(default = "yes")]
    pub weigh: bool,
}

fn unit() -> f64 {
    1.0
}

fn thirty() -> f64 {
    30.0
}

fn preview_side() -> u32 {
    480
}

fn eight() -> u32 {
    8
}

fn three_views() -> u32 {
    3
}

fn two() -> u32 {
    2
}

fn steps() -> u32 {
    200
}

fn yes() -> bool {
    true
}
