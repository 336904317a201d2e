//! What can be asked of each kind of provider.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{NovelViewTask, ProviderKind};

/// What is asked, by the kind of provider.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "one variant per kind of provider")]
pub enum Task {
    Segment(SegmentTask),
    Relight(RelightTask),
    InstructEdit(InstructEditTask),
    Predict(PredictTask),
    Environment(EnvironmentTask),
    Chat(ChatTask),
    NovelView(NovelViewTask),
}

/// Prompts to masks of one object. Pixels: x right, y down, the middle of the first one is (0.5, 0.5).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SegmentTask {
    /// The picture.
    pub picture: String,
    /// Points on the object and beside it.
    #[serde(default)]
    pub points: Vec<PointPrompt>,
    /// Left, top, right and bottom of a rectangle around the object.
    #[serde(default, skip_serializing_if = "Option::is_none", rename = "box")]
    pub around: Option<[f64; 4]>,
    /// OpenEXR with one channel of logits, such as an earlier reply names: where the object is known to be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub logits: Option<String>,
    /// Masks wanted at most, from the whole object to a part of it.
    #[serde(default = "three")]
    #[schemars(range(min = 1, max = 3))]
    pub candidates: u8,
}

fn three() -> u8 {
    3
}

/// A point that a user clicked.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PointPrompt {
    /// Column, pixels.
    pub x: f64,
    /// Row, pixels.
    pub y: f64,
    /// Whether it is on the object.
    pub positive: bool,
}

/// A picture under another light, which a text or a background says.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RelightTask {
    /// The picture.
    pub picture: String,
    /// Gray picture of the same size: white where the object is that is lit; all of it when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub foreground: Option<String>,
    /// Picture of the same size whose light is taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<String>,
    /// The light in words.
    #[serde(default)]
    pub prompt: String,
}

/// Pictures of one scene, edited as a text says; several of them are edited alike.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct InstructEditTask {
    /// What to do: "make it snow".
    #[schemars(length(min = 1))]
    pub prompt: String,
    /// The views.
    #[schemars(length(min = 1))]
    pub views: Vec<EditView>,
    /// Share of noise that the start is drowned in: 0 keeps it, 1 forgets it.
    #[serde(default = "all")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub noise: f64,
}

fn all() -> f64 {
    1.0
}

/// A view to edit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EditView {
    /// The photo, which the edit is conditioned on.
    pub original: String,
    /// The picture that the edit starts from, of the same size; the photo when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<String>,
}

/// Maps of what a picture shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PredictTask {
    /// Pictures of one scene.
    #[schemars(length(min = 1))]
    pub pictures: Vec<String>,
    /// What is wanted of each.
    #[schemars(length(min = 1))]
    pub quantities: Vec<Quantity>,
}

/// What a map holds, an OpenEXR file of the size of its picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Channels X, Y, Z: unit vectors in the camera (x right, y down, z forward) that face it.
    Normal,
    /// Channel Z: depth along the axis of the camera in any unit, above 0; 0 where there is none.
    Depth,
    /// Channels R, G, B: linear base color, 0 to 1.
    BaseColor,
    /// Channel Y: 0 to 1.
    Roughness,
    /// Channel Y: 0 to 1.
    Metallic,
}

impl Quantity {
    /// As it stands in documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Depth => "depth",
            Self::BaseColor => "base-color",
            Self::Roughness => "roughness",
            Self::Metallic => "metallic",
        }
    }
}

/// The light around what a picture shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EnvironmentTask {
    /// The picture.
    pub picture: String,
}

/// A conversation whose answer is JSON.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChatTask {
    /// What was said, the oldest first.
    #[schemars(length(min = 1))]
    pub messages: Vec<ChatMessage>,
    /// JSON Schema that the answer keeps to.
    #[serde(default)]
    pub schema: Value,
}

/// One turn of a conversation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChatMessage {
    /// Who speaks.
    pub role: ChatRole,
    /// The text.
    pub text: String,
    /// Pictures that go with it.
    #[serde(default)]
    pub pictures: Vec<String>,
}

/// Who speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ChatRole {
    /// Sets the rules.
    System,
    /// Asks.
    User,
    /// The model's earlier answers.
    Assistant,
}

impl Task {
    /// The kind of provider that answers.
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

    /// Names of files with their places in the request.
    pub(super) fn files(&self) -> Vec<(String, &str)> {
        let mut found: Vec<(String, &str)> = Vec::new();
        match self {
            Self::Segment(t) => {
                found.push(("/task/segment/picture".into(), &t.picture));
                found.extend(t.logits.iter().map(|n| ("/task/segment/logits".into(), n.as_str())));
            }
            Self::Relight(t) => {
                let optional = [("foreground", &t.foreground), ("background", &t.background)];
                found.push(("/task/relight/picture".into(), &t.picture));
                found.extend(optional.into_iter().filter_map(|(key, name)| {
                    name.as_deref().map(|name| (format!("/task/relight/{key}"), name))
                }));
            }
            Self::InstructEdit(t) => {
                for (i, view) in t.views.iter().enumerate() {
                    let at = |key: &str| format!("/task/instruct-edit/views/{i}/{key}");
                    found.push((at("original"), &view.original));
                    found.extend(view.start.iter().map(|n| (at("start"), n.as_str())));
                }
            }
            Self::Predict(t) => {
                let at = |i: usize| format!("/task/predict/pictures/{i}");
                found.extend(t.pictures.iter().enumerate().map(|(i, n)| (at(i), n.as_str())));
            }
            Self::Environment(t) => found.push(("/task/environment/picture".into(), &t.picture)),
            Self::NovelView(t) => found.extend(t.files()),
            Self::Chat(t) => {
                for (i, message) in t.messages.iter().enumerate() {
                    let at = |k: usize| format!("/task/chat/messages/{i}/pictures/{k}");
                    let pictures = message.pictures.iter().enumerate();
                    found.extend(pictures.map(|(k, n)| (at(k), n.as_str())));
                }
            }
        }
        found
    }
}
