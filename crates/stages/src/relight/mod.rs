//! The files around a relighting: a scene folder and a light in; pictures, a splat or a scene out.

mod frames;
mod light;
mod pictures;
mod products;
mod report;
mod scene;

pub use frames::{PoseSource, load_frames};
pub use light::{LightReport, NewLight};
pub use pictures::{PictureJob, write_pictures};
pub use products::{write_baked, write_scene};
pub use report::{Product, RelightReport};
pub use scene::LoadedScene;
