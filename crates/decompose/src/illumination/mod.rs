//! The light of a capture: cells of a lat-long map, and octahedral maps of it.

pub(crate) mod cells;
mod octahedron;
mod texels;

pub use cells::{Cell, CellLight, Lamp, environment};
pub(crate) use octahedron::Octahedron;
pub(crate) use texels::light_by_texels;
