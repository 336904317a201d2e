//! What a provider answers.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{ProviderKind, Quantity};
use crate::capture::checked_relative_path;
use crate::documents::Document;
use crate::error::Result;

/// What a provider answers. Files are named relative to the document, which lies beside the request as `reply.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "motes provider reply")]
pub struct ProviderReply {
    /// `motes/provider-reply`.
    pub format: String,
    /// `MAJOR.MINOR`.
    pub version: String,
    /// One key, the kind that was asked, with what came of it.
    pub result: TaskResult,
    /// Sentences for the user.
    #[serde(default)]
    pub warnings: Vec<String>,
}

impl Document for ProviderReply {
    const FORMAT: &'static str = "motes/provider-reply";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 1;
}

/// What came of a task, by the kind of provider.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "one variant per kind of provider")]
pub enum TaskResult {
    Segment(SegmentResult),
    Relight(RelightResult),
    InstructEdit(InstructEditResult),
    Predict(PredictResult),
    Environment(EnvironmentResult),
    Chat(ChatResult),
    NovelView(NovelViewResult),
}

/// Masks of one object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SegmentResult {
    /// From the largest to the smallest, at least one.
    #[schemars(length(min = 1, max = 3))]
    pub masks: Vec<SegmentMask>,
    /// The one that the provider would choose, counted from 0.
    pub best: u64,
}

/// A mask.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SegmentMask {
    /// Gray picture of the size of the picture: white on the object.
    pub mask: String,
    /// Intersection over union with the truth that the model expects, 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub predicted_iou: f64,
    /// Intersection over union of the masks at a raised and a lowered threshold, 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub stability: f64,
    /// OpenEXR with the channel Y: logits in the resolution of the model, which a later request may name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub logits: Option<String>,
}

/// The picture under the other light.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct RelightResult {
    /// Picture of the size of the one that was given.
    pub picture: String,
}

/// The edited views.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct InstructEditResult {
    /// One per view, of its size, in the order of the request.
    pub pictures: Vec<String>,
}

/// The maps that were asked for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct PredictResult {
    /// One per picture and quantity.
    pub maps: Vec<PredictedMap>,
}

/// A map of a picture.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct PredictedMap {
    /// Which picture of the request, counted from 0.
    pub picture: u64,
    /// What the map holds.
    pub quantity: Quantity,
    /// OpenEXR of the size of the picture.
    pub map: String,
    /// OpenEXR with the channel Y, 0 to 1: how far the map can be trusted; 1 when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confidence: Option<String>,
}

/// The light around the picture.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct EnvironmentResult {
    /// Panorama, OpenEXR with linear R, G, B, twice as wide as high.
    pub environment: String,
}

/// The answer of a language model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChatResult {
    /// JSON that keeps to the schema of the request.
    pub content: Value,
}

/// The view as a photo would show it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct NovelViewResult {
    /// Picture of the size of the rendering.
    pub picture: String,
    /// OpenEXR with the channel Y, 0 to 1: how far the picture can be trusted; 1 when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confidence: Option<String>,
}

impl ProviderReply {
    /// A reply without warnings.
    pub fn new(result: TaskResult) -> Self {
        let (format, version) = (Self::FORMAT.into(), Self::version());
        Self { format, version, result, warnings: Vec::new() }
    }

    /// The files that the reply names, relative to its folder.
    ///
    /// # Errors
    /// A name leads out of the folder; `document` stands for the file in the error.
    pub fn files(&self, document: &Path) -> Result<Vec<PathBuf>> {
        let checked = |name: &str| checked_relative_path(document, "/result", name);
        self.result.files().into_iter().map(checked).collect()
    }
}

impl TaskResult {
    /// The kind of provider that answered.
    pub fn kind(&self) -> ProviderKind {
        match self {
            Self::Segment(_) => ProviderKind::Segment,
            Self::Relight(_) => ProviderKind::Relight,
            Self::InstructEdit(_) => ProviderKind::InstructEdit,
            Self::Predict(_) => ProviderKind::Predict,
            Self::Environment(_) => ProviderKind::Environment,
            Self::Chat(_) => ProviderKind::Chat,
            Self::NovelView(_) => ProviderKind::NovelView,
        }
    }

    fn files(&self) -> Vec<&str> {
        match self {
            Self::Segment(r) => r
                .masks
                .iter()
                .flat_map(|m| [Some(&m.mask), m.logits.as_ref()])
                .flatten()
                .map(String::as_str)
                .collect(),
            Self::Relight(r) => vec![&r.picture],
            Self::InstructEdit(r) => r.pictures.iter().map(String::as_str).collect(),
            Self::Predict(r) => r
                .maps
                .iter()
                .flat_map(|m| [Some(&m.map), m.confidence.as_ref()])
                .flatten()
                .map(String::as_str)
                .collect(),
            Self::Environment(r) => vec![&r.environment],
            Self::NovelView(r) => [Some(&r.picture), r.confidence.as_ref()]
                .into_iter()
                .flatten()
                .map(String::as_str)
                .collect(),
            Self::Chat(_) => Vec::new(),
        }
    }
}
