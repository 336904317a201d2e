//! The UNet of Stable Diffusion 1.5 with any number of input channels.

use candle_core::{DType, Device, Module as _, Tensor};
use candle_nn::{Conv2d, Linear};

use super::UNetConfig;
use super::layers::{convolution, group_norm, linear};
use super::normalize::GroupNorm;
use super::resnet::ResnetKind;
use super::unet_blocks::{Down, Given, Middle, Up};
use crate::error::Result;
use crate::weights::Place;

/// Longest wavelength of the embedding of time, in time steps over 2 pi.
const LONGEST: f64 = 10_000.0;

/// Noise that is in latents, by time and text.
pub struct UNet {
    enter: Conv2d,
    time1: Linear,
    time2: Linear,
    down: Vec<Down>,
    middle: Middle,
    up: Vec<Up>,
    norm: GroupNorm,
    out: Conv2d,
    config: UNetConfig,
}

impl UNet {
    /// With the tensors of a place.
    ///
    /// # Errors
    /// The configuration is of another network, or a tensor cannot be read.
    pub fn new(place: &Place<'_>, config: &UNetConfig) -> Result<Self> {
        config.check()?;
        let first = config.block_out_channels[0];
        let time = 4 * first;
        let (groups, epsilon) = (config.norm_num_groups, config.norm_eps);
        let shared = (config, ResnetKind { groups, epsilon, time: Some(time) });
        let levels = config.block_out_channels.len();
        let embedding = place.at("time_embedding");
        let down = |k: usize| Down::new(&place.at("down_blocks").at(k), k, shared);
        let up = |k: usize| Up::new(&place.at("up_blocks").at(k), k, shared);
        Ok(Self {
            enter: convolution(&place.at("conv_in"), config.in_channels, first, 3)?,
            time1: linear(&embedding.at("linear_1"), first, time)?,
            time2: linear(&embedding.at("linear_2"), time, time)?,
            down: (0..levels).map(down).collect::<Result<_>>()?,
            middle: Middle::new(&place.at("mid_block"), shared)?,
            up: (0..levels).map(up).collect::<Result<_>>()?,
            norm: group_norm(&place.at("conv_norm_out"), groups, first, epsilon)?,
            out: convolution(&place.at("conv_out"), first, config.out_channels, 3)?,
            config: config.clone(),
        })
    }

    /// Channels of the input.
    pub fn in_channels(&self) -> usize {
        self.config.in_channels
    }

    /// Where it computes, and in which numbers.
    pub fn place(&self) -> (&Device, DType) {
        let weight = self.enter.weight();
        (weight.device(), weight.dtype())
    }

    /// The noise in `seen`, `[batch, channels, height, width]`, at a time step, for texts `[batch, tokens, channels]`, in 32 bits. Each
    /// `views` rows of the batch that follow each other are views whose self-attention is joint.
    ///
    /// # Errors
    /// The shapes do not fit, or memory ran out.
    pub fn forward(&self, seen: &Tensor, time: f64, text: &Tensor, views: usize) -> Result<Tensor> {
        let (device, dtype) = self.place();
        let embedded = self.embedded(time)?.to_device(device)?.to_dtype(dtype)?;
        let embedded = self.time2.forward(&self.time1.forward(&embedded)?.silu()?)?.silu()?;
        let text = text.to_dtype(dtype)?;
        let given = Given { time: &embedded, text: &text, views };
        let mut state = self.enter.forward(&seen.to_dtype(dtype)?)?;
        let mut kept = vec![state.clone()];
        for level in &self.down {
            state = level.forward(state, given, &mut kept)?;
        }
        state = self.middle.forward(&state, given)?;
        for level in &self.up {
            state = level.forward(state, given, &mut kept)?;
        }
        let made = self.out.forward(&self.norm.forward_silu(&state)?)?;
        Ok(made.to_dtype(DType::F32)?)
    }

    /// Cosines, then sines, of the time step over wavelengths up to [`LONGEST`].
    fn embedded(&self, time: f64) -> Result<Tensor> {
        let half = self.config.block_out_channels[0] / 2;
        let angle = |k: usize| (time * (-LONGEST.ln() * k as f64 / half as f64).exp()) as f32;
        let cosines = (0..half).map(|k| angle(k).cos());
        let values: Vec<f32> = cosines.chain((0..half).map(|k| angle(k).sin())).collect();
        Ok(Tensor::from_vec(values, (1, 2 * half), &Device::Cpu)?)
    }
}
