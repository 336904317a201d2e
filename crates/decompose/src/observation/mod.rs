//! What the photos show of a surface: rays, hits, points with their observations.

pub(crate) mod flat_pieces;
pub(crate) mod observed;
pub(crate) mod photo;
pub(crate) mod samples;
pub(crate) mod traced_surface;

pub use flat_pieces::up_in_world;
pub use observed::Observed;
pub use photo::Photo;
pub use samples::{Observation, Sample, SeenView};
pub use traced_surface::{PixelHit, TracedSurface, ViewRays};
