//! The light from infinity that explains the photos.

pub mod cells;
pub mod find;
pub(crate) mod glossy;
pub mod pairs;
pub mod solve;
pub mod transport;
