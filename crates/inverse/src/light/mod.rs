//! The light from infinity that explains the photos.

pub mod cells;
pub mod find;
pub mod pairs;
pub mod solve;
pub mod transport;
