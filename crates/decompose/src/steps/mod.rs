//! The steps of the decomposition, in their order: each has its options, its `run`, and what it tells.

pub mod surface;

pub mod samples;

pub mod light;

pub mod materials;

pub mod reflected_light;

pub mod shape_from_shading;

pub mod shape_from_reflection;

pub mod shading;

pub mod base_color;

pub mod refinement;

pub mod attributes;

pub mod appearance_residual;

pub mod evaluation;
