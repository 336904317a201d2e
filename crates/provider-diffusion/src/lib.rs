//! IC-Light and InstructPix2Pix on Stable Diffusion 1.5 as a provider of relit and edited pictures, in Rust on `candle`.
//!
//! The networks ([`network`]) are written here, so that their configuration is that of the user's files and every tensor of these is
//! accounted for ([`weights`]). [`relight`] and [`edit`] are the two ways from pictures to pictures; [`schedule`] and [`sampler`] are
//! how noise leaves latents. What is random comes from the seed of the request, never from the device.

mod answer;
pub mod command;
mod device;
pub mod edit;
mod error;
pub mod network;
pub mod noise;
pub mod options;
pub mod parts;
pub mod pictures;
pub mod relight;
pub mod sampler;
pub mod schedule;
pub mod tokens;
pub mod weights;

pub use answer::Diffusion;
pub use error::DiffusionError;
