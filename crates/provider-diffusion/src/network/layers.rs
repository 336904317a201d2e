//! Layers with their weights.

use candle_core::{Module as _, Tensor};
use candle_nn::{Conv2d, Conv2dConfig, LayerNorm, Linear};

use super::normalize::GroupNorm;
use crate::error::Result;
use crate::weights::Place;

pub(super) fn linear(place: &Place<'_>, inputs: usize, outputs: usize) -> Result<Linear> {
    let bias = place.tensor("bias", &[outputs])?;
    Ok(Linear::new(place.tensor("weight", &[outputs, inputs])?, Some(bias)))
}

pub(super) fn linear_without_bias(
    place: &Place<'_>,
    inputs: usize,
    outputs: usize,
) -> Result<Linear> {
    Ok(Linear::new(place.tensor("weight", &[outputs, inputs])?, None))
}

/// A convolution with a square kernel of odd side; its result has the size of its input.
pub(super) fn convolution(
    place: &Place<'_>,
    inputs: usize,
    outputs: usize,
    side: usize,
) -> Result<Conv2d> {
    strided(place, (inputs, outputs), side, (1, side / 2))
}

pub(super) fn strided(
    place: &Place<'_>,
    (inputs, outputs): (usize, usize),
    side: usize,
    (stride, padding): (usize, usize),
) -> Result<Conv2d> {
    let weight = place.tensor("weight", &[outputs, inputs, side, side])?;
    let config = Conv2dConfig { padding, stride, ..Conv2dConfig::default() };
    Ok(Conv2d::new(weight, Some(place.tensor("bias", &[outputs])?), config))
}

pub(super) fn group_norm(
    place: &Place<'_>,
    groups: usize,
    channels: usize,
    epsilon: f64,
) -> Result<GroupNorm> {
    let (weight, bias) = (place.tensor("weight", &[channels])?, place.tensor("bias", &[channels])?);
    Ok(GroupNorm { weight, bias, groups, epsilon })
}

pub(super) fn layer_norm(place: &Place<'_>, size: usize, epsilon: f64) -> Result<LayerNorm> {
    let (weight, bias) = (place.tensor("weight", &[size])?, place.tensor("bias", &[size])?);
    Ok(LayerNorm::new(weight, bias, epsilon))
}

/// Doubled sides, or the sides that are given, by repetition; then a convolution.
pub(super) fn upsampled(
    convolution: &Conv2d,
    seen: &Tensor,
    size: Option<(usize, usize)>,
) -> Result<Tensor> {
    let (_, _, height, width) = seen.dims4()?;
    let (height, width) = size.unwrap_or((2 * height, 2 * width));
    Ok(convolution.forward(&seen.upsample_nearest2d(height, width)?)?)
}
