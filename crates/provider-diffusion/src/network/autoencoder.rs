//! The autoencoder of Stable Diffusion (Rombach et al., 2022): pixels to latents, and back.

use candle_core::{Module as _, Tensor};
use candle_nn::Conv2d;
use serde::Deserialize;

use super::attention::Attention;
use super::layers::{convolution, group_norm, strided, upsampled};
use super::normalize::GroupNorm;
use super::resnet::{Resnet, ResnetKind};
use crate::error::{DiffusionError, Result};
use crate::weights::Place;

const EPSILON: f64 = 1e-6;

/// `config.json` of an autoencoder.
#[derive(Clone, Debug, Deserialize)]
#[expect(missing_docs, reason = "the names of the file")]
pub struct AutoencoderConfig {
    pub block_out_channels: Vec<usize>,
    #[serde(default = "one")]
    pub layers_per_block: usize,
    #[serde(default = "four")]
    pub latent_channels: usize,
    #[serde(default = "groups")]
    pub norm_num_groups: usize,
    #[serde(default = "scaling")]
    pub scaling_factor: f64,
    #[serde(default)]
    pub shift_factor: Option<f64>,
}

fn one() -> usize {
    1
}

fn four() -> usize {
    4
}

fn groups() -> usize {
    32
}

fn scaling() -> f64 {
    0.18215
}

impl AutoencoderConfig {
    fn check(&self) -> Result<()> {
        let channels = |c: &usize| *c > 0 && c.is_multiple_of(self.norm_num_groups.max(1));
        let fits = (1..=6).contains(&self.block_out_channels.len())
            && self.block_out_channels.iter().all(channels)
            && (1..=8).contains(&self.layers_per_block)
            && (1..=64).contains(&self.latent_channels)
            && self.norm_num_groups > 0
            && self.scaling_factor > 0.0
            && self.shift_factor.unwrap_or(0.0) == 0.0;
        if fits {
            return Ok(());
        }
        let help = "give the folder of Stable Diffusion 1.5 or InstructPix2Pix";
        Err(DiffusionError::request("vae/config.json is of another kind of network", help))
    }
}

/// Two residual blocks with attention between them.
struct Middle {
    first: Resnet,
    norm: GroupNorm,
    attention: Attention,
    second: Resnet,
}

impl Middle {
    fn new(place: &Place<'_>, channels: usize, kind: ResnetKind) -> Result<Self> {
        let resnet = |k: usize| Resnet::new(&place.at("resnets").at(k), channels, channels, kind);
        let within = place.at("attentions.0");
        Ok(Self {
            first: resnet(0)?,
            norm: group_norm(&within.at("group_norm"), kind.groups, channels, EPSILON)?,
            attention: Attention::new(&within, (channels, channels), 1, true)?,
            second: resnet(1)?,
        })
    }

    fn forward(&self, seen: &Tensor) -> Result<Tensor> {
        let seen = self.first.forward(seen, None)?;
        let (batch, channels, height, width) = seen.dims4()?;
        let tokens = self.norm.forward(&seen)?.flatten_from(2)?.transpose(1, 2)?.contiguous()?;
        let found = self.attention.forward(&tokens, &tokens)?.transpose(1, 2)?;
        let found = found.reshape((batch, channels, height, width))?;
        self.second.forward(&(found + seen)?, None)
    }
}

/// Residual blocks, then a change of size.
struct Level {
    resnets: Vec<Resnet>,
    resize: Option<Conv2d>,
}

/// Both halves of the autoencoder.
pub struct Autoencoder {
    enter: Conv2d,
    down: Vec<Level>,
    encoder_middle: Middle,
    encoder_norm: GroupNorm,
    encoder_out: Conv2d,
    moments: Conv2d,
    unpack: Conv2d,
    decoder_in: Conv2d,
    decoder_middle: Middle,
    up: Vec<Level>,
    decoder_norm: GroupNorm,
    decoder_out: Conv2d,
    config: AutoencoderConfig,
}

impl Autoencoder {
    /// With the tensors of a place.
    ///
    /// # Errors
    /// The configuration is of another network, or a tensor cannot be read.
    pub fn new(place: &Place<'_>, config: &AutoencoderConfig) -> Result<Self> {
        config.check()?;
        let widths = &config.block_out_channels;
        let kind = ResnetKind { groups: config.norm_num_groups, epsilon: EPSILON, time: None };
        let (narrow, wide) = (widths[0], widths[widths.len() - 1]);
        let (encoder, decoder) = (place.at("encoder"), place.at("decoder"));
        let (latent, count) = (config.latent_channels, config.layers_per_block);
        let norm = |place: &Place<'_>, width: usize| {
            group_norm(&place.at("conv_norm_out"), kind.groups, width, EPSILON)
        };
        let reversed: Vec<usize> = widths.iter().rev().copied().collect();
        Ok(Self {
            enter: convolution(&encoder.at("conv_in"), 3, narrow, 3)?,
            down: levels(&encoder, "down", (narrow, widths), count, kind)?,
            encoder_middle: Middle::new(&encoder.at("mid_block"), wide, kind)?,
            encoder_norm: norm(&encoder, wide)?,
            encoder_out: convolution(&encoder.at("conv_out"), wide, 2 * latent, 3)?,
            moments: convolution(&place.at("quant_conv"), 2 * latent, 2 * latent, 1)?,
            unpack: convolution(&place.at("post_quant_conv"), latent, latent, 1)?,
            decoder_in: convolution(&decoder.at("conv_in"), latent, wide, 3)?,
            decoder_middle: Middle::new(&decoder.at("mid_block"), wide, kind)?,
            up: levels(&decoder, "up", (wide, &reversed), count + 1, kind)?,
            decoder_norm: norm(&decoder, narrow)?,
            decoder_out: convolution(&decoder.at("conv_out"), narrow, 3, 3)?,
            config: config.clone(),
        })
    }

    /// The name of a stored tensor in the network: files older than diffusers 0.18 name attention otherwise.
    pub fn renamed(stored: &str) -> Option<String> {
        let old =
            [("query", "to_q"), ("key", "to_k"), ("value", "to_v"), ("proj_attn", "to_out.0")];
        let mut name = stored.to_owned();
        for (from, to) in old {
            name = name.replace(&format!("attentions.0.{from}."), &format!("attentions.0.{to}."));
        }
        Some(name)
    }

    /// Channels of latents.
    pub fn latent_channels(&self) -> usize {
        self.config.latent_channels
    }

    /// What latents are multiplied by for the UNet.
    pub fn scale(&self) -> f64 {
        self.config.scaling_factor
    }

    /// Pixels per pixel of latents.
    pub fn factor(&self) -> usize {
        1 << (self.config.block_out_channels.len() - 1)
    }

    /// The mode of the latents of pixels, -1 to 1, `[pictures, 3, height, width]`; not scaled.
    ///
    /// # Errors
    /// Memory ran out.
    pub fn encode(&self, pixels: &Tensor) -> Result<Tensor> {
        let mut state = self.enter.forward(pixels)?;
        for level in &self.down {
            for resnet in &level.resnets {
                state = resnet.forward(&state, None)?;
            }
            if let Some(resize) = &level.resize {
                let padded = state.pad_with_zeros(3, 0, 1)?.pad_with_zeros(2, 0, 1)?;
                state = resize.forward(&padded)?;
            }
        }
        let state = self.encoder_norm.forward_silu(&self.encoder_middle.forward(&state)?)?;
        let moments = self.moments.forward(&self.encoder_out.forward(&state)?)?;
        Ok(moments.narrow(1, 0, self.config.latent_channels)?.contiguous()?)
    }

    /// Pixels, about -1 to 1, of latents that are not scaled.
    ///
    /// # Errors
    /// Memory ran out.
    pub fn decode(&self, latents: &Tensor) -> Result<Tensor> {
        let state = self.decoder_in.forward(&self.unpack.forward(latents)?)?;
        let mut state = self.decoder_middle.forward(&state)?;
        for level in &self.up {
            for resnet in &level.resnets {
                state = resnet.forward(&state, None)?;
            }
            if let Some(resize) = &level.resize {
                state = upsampled(resize, &state, None)?;
            }
        }
        Ok(self.decoder_out.forward(&self.decoder_norm.forward_silu(&state)?)?)
    }
}

/// The levels of one half, from the one that is entered with `begin` channels.
fn levels(
    place: &Place<'_>,
    way: &str,
    (begin, widths): (usize, &[usize]),
    count: usize,
    kind: ResnetKind,
) -> Result<Vec<Level>> {
    let mut inputs = begin;
    let mut levels = Vec::new();
    for (k, &width) in widths.iter().enumerate() {
        let place = place.at(format!("{way}_blocks")).at(k);
        let mut resnets = Vec::new();
        for j in 0..count {
            resnets.push(Resnet::new(&place.at("resnets").at(j), inputs, width, kind)?);
            inputs = width;
        }
        let within = place.at(format!("{way}samplers.0.conv"));
        let resize = match (k + 1 == widths.len(), way) {
            (true, _) => None,
            (false, "down") => Some(strided(&within, (width, width), 3, (2, 0))?),
            (false, _) => Some(convolution(&within, width, width, 3)?),
        };
        levels.push(Level { resnets, resize });
    }
    Ok(levels)
}
