//! The networks of Stable Diffusion 1.5: text encoder, autoencoder, UNet. Tensors are `[batch, channels, height, width]` or
//! `[batch, tokens, channels]`. Names of tensors are those of diffusers and transformers.

mod attention;
mod autoencoder;
mod layers;
mod normalize;
mod resnet;
mod text_encoder;
mod unet;
mod unet_blocks;
mod unet_config;

pub use autoencoder::{Autoencoder, AutoencoderConfig};
pub use text_encoder::{TextEncoder, TextEncoderConfig};
pub use unet::UNet;
pub use unet_config::UNetConfig;
