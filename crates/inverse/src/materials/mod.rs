//! What the surface is made of.

pub mod basis;
pub mod find;
pub mod profile;
pub mod regions;
pub mod scale;
