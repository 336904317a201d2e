//! Inverse rendering: from a capture and its Gaussians to a surface, its material and the light.
//!
//! [`pipeline`] lists the steps, [`steps`] holds them, [`State`] is what they work on.

mod appearance;
mod error;
pub mod files;
mod illumination;
mod image_gradient;
mod mesh;
mod observation;
mod options;
mod parabola;
pub mod photometry;
pub mod pipeline;
mod prior_agreement;
mod progress;
mod report;
mod state;
pub mod steps;
#[cfg(test)]
mod toy_ball;

pub use appearance::{
    FoundMaterials, Kind, ModelOptions, PartMaterial, PixelShading, ScaleEvidence,
};
pub use error::DecomposeError;
pub use illumination::{Cell, CellLight, Lamp, LightAnchor, LocalLight, environment};
pub use observation::{
    Observation, Observed, Photo, PixelHit, Radiance, Sample, SeenView, TracedSurface, ViewRays,
    Wanted, choose_photos, up_in_world,
};
pub use options::DecomposeOptions;
pub use pipeline::{Pipeline, Progress, Report, StepRecord};
pub use progress::Tick;
pub use report::Term;
pub use state::{BaseColorAnchor, BaseColored, Illumination, Inputs, Known, RenderedView, State};
