//! Command line, recognition, and a reader per kind.

mod command;
mod documents;
mod folders;
mod gltf;
mod images;
mod made_by;
mod ply;
mod recognize;
mod splats;
mod tensors;

pub use command::{Args, Report, run};
