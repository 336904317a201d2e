//! The residual block of the autoencoder and the UNet.

use candle_core::{Module as _, Tensor};
use candle_nn::{Conv2d, Linear};

use super::layers::{convolution, group_norm, linear};
use super::normalize::GroupNorm;
use crate::error::Result;
use crate::weights::Place;

/// Two convolutions beside the input; between them the UNet adds what it knows of the time.
pub(super) struct Resnet {
    norm1: GroupNorm,
    conv1: Conv2d,
    time: Option<Linear>,
    norm2: GroupNorm,
    conv2: Conv2d,
    shortcut: Option<Conv2d>,
}

/// What the residual blocks of a network share.
#[derive(Clone, Copy)]
pub(super) struct ResnetKind {
    pub(super) groups: usize,
    pub(super) epsilon: f64,
    /// Channels of the embedding of time, where there is one.
    pub(super) time: Option<usize>,
}

impl Resnet {
    pub(super) fn new(
        place: &Place<'_>,
        inputs: usize,
        outputs: usize,
        kind: ResnetKind,
    ) -> Result<Self> {
        let time = kind.time.map(|size| linear(&place.at("time_emb_proj"), size, outputs));
        let shortcut = (inputs != outputs)
            .then(|| convolution(&place.at("conv_shortcut"), inputs, outputs, 1));
        Ok(Self {
            norm1: group_norm(&place.at("norm1"), kind.groups, inputs, kind.epsilon)?,
            conv1: convolution(&place.at("conv1"), inputs, outputs, 3)?,
            time: time.transpose()?,
            norm2: group_norm(&place.at("norm2"), kind.groups, outputs, kind.epsilon)?,
            conv2: convolution(&place.at("conv2"), outputs, outputs, 3)?,
            shortcut: shortcut.transpose()?,
        })
    }

    /// `time` is the embedding after its activation, `[batch, channels]`.
    pub(super) fn forward(&self, seen: &Tensor, time: Option<&Tensor>) -> Result<Tensor> {
        let mut inner = self.conv1.forward(&self.norm1.forward_silu(seen)?)?;
        if let (Some(layer), Some(time)) = (&self.time, time) {
            let added = layer.forward(time)?;
            let (batch, channels) = added.dims2()?;
            inner = inner.broadcast_add(&added.reshape((batch, channels, 1, 1))?)?;
        }
        let inner = self.conv2.forward(&self.norm2.forward_silu(&inner)?)?;
        Ok(match &self.shortcut {
            Some(shortcut) => (shortcut.forward(seen)? + inner)?,
            None => (seen + inner)?,
        })
    }
}
