//! Relighting: a decomposed scene under another light, as views, as baked colors, as a scene.
//!
//! - [`RelightScene`]: Gaussians with material and the surface that rays meet, ready for light.
//! - [`LightSource`]: a lat-long map, or sun and sky, turned and exposed into an environment.
//! - [`Relighter`]: a scene under one light: deferred pictures ([`Relighter::picture`]) and baked
//!   colors ([`Relighter::bake`]).
//! - [`lift`]: views that were relit by other means, back to 3D.
//!
//! `docs/methods/relight.md` has the equations and approximations, `docs/benchmarks/relight.md` what each
//! quality costs.

mod bake;
mod captured_light;
mod compose;
mod coverage;
mod deferred;
mod denoise;
mod disputed;
pub mod files;
mod first_triangles;
mod g_buffer;
mod graph;
mod lamps;
pub mod lift;
mod light;
mod log_layer;
mod meter;
mod options;
mod probe;
mod radiance_cache;
mod ratio;
mod relighter;
mod residual;
mod residual_share;
mod scene;
mod sky;
mod stand_in;
mod sun;
mod surface_point;
mod upsample;
mod view_transform;
mod windows;

pub use compose::{Background, Components, Picture, PictureStats};
pub use light::{Light, LightError, LightSource, Place, environment_image};
pub use options::{
    BakeOptions, EnvUp, Exposure, LightOptions, Quality, QualityOptions, ViewTransform,
};
pub use probe::{Probe, Question};
pub use relighter::Relighter;
pub use residual_share::ResidualShare;
pub use scene::{RelightScene, SceneError};
pub use sun::{Sky, SunOption};
