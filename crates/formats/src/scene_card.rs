//! `scene-card.json`: what is in a scene, for people, for the interpreter of instructions and for language models.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::documents::Document;
use crate::selection::BoxDocument;

/// What is in a scene, in the frame of one view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "motes scene card")]
pub struct SceneCardDocument {
    /// `motes/scene-card`.
    pub format: String,
    /// `MAJOR.MINOR`.
    pub version: String,
    /// Program and version that made it.
    #[serde(default)]
    pub made_by: String,
    /// Whether surface, material and light are known: without them light cannot be changed.
    pub decomposed: bool,
    /// What left, right, front and up mean.
    pub frame: FrameDocument,
    /// Meters per world unit, where the user said so.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub meters_per_unit: Option<f64>,
    /// The objects that have names, in the order of the labels.
    pub objects: Vec<ObjectDocument>,
    /// How they stand to each other; only relations that hold clearly.
    #[serde(default)]
    pub relations: Vec<RelationDocument>,
    /// The light of the scene; null where it is not decomposed.
    #[serde(default)]
    pub light: Option<LightDocument>,
    /// Lights that have names.
    pub lights: Vec<NamedLightDocument>,
    /// Files that may be inserted, by the names to call them.
    #[serde(default)]
    pub assets: Vec<String>,
}

impl Document for SceneCardDocument {
    const FORMAT: &'static str = "motes/scene-card";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 0;
}

/// Directions as a person sees them who stands where a view was taken. Unit vectors in world, at right angles to each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FrameDocument {
    /// The view; null without a capture: then right is the first axis of the world laid on the ground.
    pub view: Option<String>,
    /// Away from the ground.
    pub up: [f64; 3],
    /// To the right in the view, along the ground.
    pub right: [f64; 3],
    /// Toward the viewer, along the ground: what is in front is nearer to the camera.
    pub front: [f64; 3],
}

/// An object. Lengths in world units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ObjectDocument {
    /// Name of its selection in plans; no two objects share it.
    pub id: String,
    /// What people call it, the usual name first.
    pub names: Vec<String>,
    /// Its `selection.json`, as the labels name it.
    pub selection: String,
    /// Number of its Gaussians.
    pub count: u64,
    /// Mean of its Gaussians, weighted by opacity, world.
    pub center: [f64; 3],
    /// Where it stands: below the center, at its lowest, world.
    pub base: [f64; 3],
    /// Bounds of their centers, world.
    #[serde(rename = "box")]
    pub bounds: BoxDocument,
    /// Extent along the frame, without the outermost percent.
    pub size: SizeDocument,
    /// How far its lowest part is above what it stands on; null where nothing was found below it.
    #[serde(default)]
    pub height_above_ground: Option<f64>,
    /// Its mean color: base color where the scene is decomposed, else as photographed.
    pub color: ColorDocument,
    /// What it is made of, where that is known.
    #[serde(default)]
    pub material: Option<MaterialDocument>,
    /// Views that show it, the best first, at most 3.
    #[serde(default)]
    pub views: Vec<String>,
}

/// Extent along the directions of the frame, world units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SizeDocument {
    /// Along right.
    pub width: f64,
    /// Along front.
    pub depth: f64,
    /// Along up.
    pub height: f64,
}

/// A color with its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ColorDocument {
    /// `red`, `orange`, `yellow`, `green`, `blue`, `purple`, `pink`, `brown`, `black`, `gray` or `white`.
    pub name: String,
    /// Linear Rec. 709.
    pub rgb_linear: [f64; 3],
}

/// Mean material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MaterialDocument {
    /// `metal`, `glossy` or `matte` where the scene is decomposed; else what the label says, such as `wood`.
    pub class: String,
    /// What the label says that it is made of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_of: Option<String>,
    /// Perceptual roughness, 0 to 1; null where the scene is not decomposed.
    #[serde(default)]
    pub roughness: Option<f64>,
    /// 0 dielectric, 1 metal; null where the scene is not decomposed.
    #[serde(default)]
    pub metallic: Option<f64>,
}

/// How two objects stand to each other in the frame.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct RelationDocument {
    /// `id` of the object that the sentence is about.
    pub subject: String,
    /// What it is to the other.
    pub relation: Relation,
    /// `id` of the other.
    pub object: String,
}

/// Relations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Relation {
    /// Farther left in the frame.
    LeftOf,
    /// Farther from the viewer.
    Behind,
    /// Stands on it.
    On,
}

/// The light of a decomposed scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LightDocument {
    /// Unit vector in world toward the side that most light comes from.
    pub to_light: [f64; 3],
    /// The same in words, in the frame: `left`, `front left`, `above`, ...
    pub from: String,
    /// Above the ground, degrees.
    pub elevation_deg: f64,
    /// Mean over all directions, linear Rec. 709, the largest channel 1.
    pub rgb_linear: [f64; 3],
    /// `warm`, `neutral` or `cool`.
    pub tone: String,
}

/// A light with a name, as `set_environment` takes it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct NamedLightDocument {
    /// What people call it.
    pub name: String,
    /// The value of `sun`.
    pub sun: String,
}
