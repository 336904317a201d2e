//! The light of a capture: cells of a lat-long map, and octahedral maps of it.

pub(crate) mod cells;
mod local_light;
mod octahedron;
pub(crate) mod seen_sky;
mod sky_dome;
mod texels;

pub use cells::{Cell, CellLight, Lamp, environment};
pub use local_light::{LightAnchor, LocalLight};
pub(crate) use local_light::{NEAR, NORMAL_REACH, feature};
pub(crate) use octahedron::Octahedron;
pub(crate) use texels::light_by_texels;
