//! Editing: plans of operations on splats and decomposed scenes, and the light that follows them.
//!
//! [`EditState`] is what a plan works on: the Gaussians that are there now and the history of each.

pub mod reshade;
mod similarity;
mod state;

pub use similarity::Similarity;
pub use state::{AT_REST, EditState, Fill, Hole, Origin, SCENE, SceneChange, SceneParts, Source};
