//! What the photos show of a surface: rays, hits, points with their observations.

mod choose_photos;
pub(crate) mod flat_pieces;
pub(crate) mod local_factors;
mod most_telling;
pub(crate) mod observed;
pub(crate) mod photo;
pub(crate) mod radiance;
pub(crate) mod samples;
pub(crate) mod sky;
pub(crate) mod traced_surface;

pub use choose_photos::choose_photos;
pub use flat_pieces::up_in_world;
pub use observed::Observed;
pub use photo::Photo;
pub use radiance::Radiance;
pub use samples::{Observation, Sample, SeenView, Wanted};
pub use traced_surface::{PixelHit, TracedSurface, ViewRays};
