//! Editing: plans of operations on splats and decomposed scenes, and the light that follows them.
//!
//! - [`EditState`] is what a plan works on: the Gaussians that are there now and the history of each.
//! - [`changes`] are functions on the state alone.
//! - [`compose`] puts assets in: their size, contact, light and shadow.
//! - [`ops`] has a file per operation: its keys, their ranges, its flags, and what it does with `changes`.
//! - [`plan`] reads, checks and applies `edit-plan.json`.
//! - [`reshade`] makes the light follow and fills holes; [`refit`] fits the filling to photos.
//! - [`photo`] shows an edit in a photo of the capture.
//! - [`stylize`] fits the scene to pictures that a program edited.

pub mod changes;
pub mod compose;
pub mod files;
mod grown;
mod mass;
pub mod ops;
pub mod photo;
pub mod plan;
pub mod refit;
pub mod reshade;
pub mod run;
mod similarity;
mod state;
pub mod stylize;
mod symmetric;

pub use run::Fill;
pub use similarity::Similarity;
pub use state::{AT_REST, EditState, Hole, Origin, SCENE, SceneChange, SceneParts, Source};
