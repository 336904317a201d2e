//! The files around a relighting: a scene folder and a light in; pictures, a splat or a scene out.

mod command;
mod frames;
mod lift;
mod light;
mod pictures;
mod products;
mod provider;
mod report;
mod scene;

pub use command::{Args, run};
use frames::metered_cameras;
pub use frames::{PoseOptions, load_frames};
pub use lift::{LiftJob, LiftReport, lift_views};
pub use light::{LightReport, NewLight};
pub use pictures::{PictureJob, write_pictures};
pub use products::{write_baked, write_scene};
pub use provider::{ProviderJob, ProviderOptions, relight_by_provider};
pub use report::{Outcome, Product, RelightReport};
pub use scene::{LoadedScene, map_axes, note_map_axes, tone_curve};
