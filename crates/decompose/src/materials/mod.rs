//! What the surface is made of.

pub mod basis;
mod contrast;
pub mod find;
pub mod profile;
pub mod regions;
pub mod scale;
