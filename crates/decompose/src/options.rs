//! All options of the decomposition: those of every step, and those of the model that steps share.

use clap::Args;
use serde::{Deserialize, Serialize};

use crate::appearance::ModelOptions;
use crate::photometry;
use crate::steps::{
    appearance_residual, base_color, light, materials, refinement, reflected_light, samples,
    shading, shape_from_reflection, shape_from_shading, surface,
};

/// What `decompose` may vary.
#[derive(Clone, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[expect(missing_docs, reason = "the options of the step of that name")]
#[group(skip)]
pub struct DecomposeOptions {
    #[command(flatten)]
    #[serde(flatten)]
    pub surface: surface::Options,
    #[command(flatten)]
    #[serde(flatten)]
    pub samples: samples::Options,
    #[command(flatten)]
    #[serde(flatten)]
    pub materials: materials::Options,
    #[command(flatten)]
    #[serde(flatten)]
    pub shading: shading::Options,
    #[command(flatten)]
    #[serde(flatten)]
    pub light: light::Options,
    #[command(flatten)]
    #[serde(flatten)]
    pub reflected_light: reflected_light::Options,
    #[command(flatten)]
    #[serde(flatten)]
    pub base_color: base_color::Options,
    #[command(flatten)]
    #[serde(flatten)]
    pub refinement: refinement::Options,
    #[command(flatten)]
    #[serde(flatten)]
    pub appearance_residual: appearance_residual::Options,
    #[command(flatten)]
    #[serde(flatten)]
    pub shape_from_shading: shape_from_shading::Options,
    #[command(flatten)]
    #[serde(flatten)]
    pub shape_from_reflection: shape_from_reflection::Options,
    #[command(flatten)]
    #[serde(flatten)]
    pub photometry: photometry::Options,
    #[command(flatten)]
    #[serde(flatten)]
    pub model: ModelOptions,
}
