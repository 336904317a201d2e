//! The documents of the protocol `provider-v1`, between a stage and a program that runs a learned model.
//!
//! A provider describes itself ([`ProviderDescription`]), gets a request beside its pictures ([`ProviderRequest`]) and leaves a
//! reply there ([`ProviderReply`]). `docs/formats/provider.md` is the contract.

mod description;
mod novel_view;
mod reply;
mod request;
mod tasks;

use clap::ValueEnum;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use description::{ModelDescription, ProviderDescription};
pub use novel_view::{NovelViewTask, PosedPicture, ViewCamera};
pub use reply::{
    ChatResult, EnvironmentResult, InstructEditResult, NovelViewResult, PredictResult,
    PredictedMap, ProviderReply, RelightResult, SegmentMask, SegmentResult, TaskResult,
};
pub use request::{ProviderRequest, read_request};
pub use tasks::{
    ChatMessage, ChatRole, ChatTask, EditView, EnvironmentTask, InstructEditTask, PointPrompt,
    PredictTask, Quantity, RelightTask, SegmentTask, Task,
};

/// What a provider can be asked for.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    ValueEnum,
    Serialize,
    Deserialize,
    JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum ProviderKind {
    /// Points, a box and an earlier mask to masks of an object
    Segment,
    /// A picture under another light
    Relight,
    /// Pictures edited as a text says
    InstructEdit,
    /// Normals, depth, base color, roughness and metallic of a picture
    Predict,
    /// The light around a picture as a panorama
    Environment,
    /// An answer in JSON to a conversation
    Chat,
    /// A picture of a scene from where no photo was taken
    NovelView,
}

impl ProviderKind {
    /// As it stands in documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::Segment => "segment",
            Self::Relight => "relight",
            Self::InstructEdit => "instruct-edit",
            Self::Predict => "predict",
            Self::Environment => "environment",
            Self::Chat => "chat",
            Self::NovelView => "novel-view",
        }
    }
}

#[cfg(test)]
mod tests;
