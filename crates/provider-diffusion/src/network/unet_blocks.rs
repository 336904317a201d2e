//! The levels of the UNet.

use candle_core::{Module as _, Tensor};
use candle_nn::Conv2d;

use super::UNetConfig;
use super::attention::Transformer;
use super::layers::{convolution, strided, upsampled};
use super::resnet::{Resnet, ResnetKind};
use crate::error::Result;
use crate::weights::Place;

/// What a level is told beside the picture.
#[derive(Clone, Copy)]
pub(super) struct Given<'a> {
    /// Embedding of the time after its activation, `[batch, channels]`.
    pub(super) time: &'a Tensor,
    /// Embedding of the text, `[batch, tokens, channels]`.
    pub(super) text: &'a Tensor,
    /// Views that see each other.
    pub(super) views: usize,
}

/// A residual block, and a transformer where the level has attention.
pub(super) struct Step {
    resnet: Resnet,
    transformer: Option<Transformer>,
}

impl Step {
    fn new(
        place: &Place<'_>,
        k: usize,
        (inputs, outputs): (usize, usize),
        attends: bool,
        (config, kind): (&UNetConfig, ResnetKind),
    ) -> Result<Self> {
        let resnet = Resnet::new(&place.at("resnets").at(k), inputs, outputs, kind)?;
        let (text, heads) = (config.cross_attention_dim, config.attention_head_dim);
        let within = place.at("attentions").at(k);
        let transformer = attends
            .then(|| Transformer::new(&within, outputs, text, heads, kind.groups))
            .transpose()?;
        Ok(Self { resnet, transformer })
    }

    fn forward(&self, seen: &Tensor, given: Given<'_>) -> Result<Tensor> {
        let made = self.resnet.forward(seen, Some(given.time))?;
        match &self.transformer {
            Some(transformer) => transformer.forward(&made, given.text, given.views),
            None => Ok(made),
        }
    }
}

/// A level on the way down.
pub(super) struct Down {
    steps: Vec<Step>,
    resize: Option<Conv2d>,
}

impl Down {
    pub(super) fn new(
        place: &Place<'_>,
        level: usize,
        shared: (&UNetConfig, ResnetKind),
    ) -> Result<Self> {
        let widths = &shared.0.block_out_channels;
        let (inputs, width) = (widths[level.saturating_sub(1)], widths[level]);
        let attends = shared.0.down_block_types[level].starts_with("CrossAttn");
        let step = |k: usize| {
            Step::new(place, k, (if k == 0 { inputs } else { width }, width), attends, shared)
        };
        let steps = (0..shared.0.layers_per_block).map(step).collect::<Result<_>>()?;
        let resize = (level + 1 < widths.len())
            .then(|| strided(&place.at("downsamplers.0.conv"), (width, width), 3, (2, 1)))
            .transpose()?;
        Ok(Self { steps, resize })
    }

    /// Whatever is made on the way is kept for the way up.
    pub(super) fn forward(
        &self,
        mut seen: Tensor,
        given: Given<'_>,
        kept: &mut Vec<Tensor>,
    ) -> Result<Tensor> {
        for step in &self.steps {
            seen = step.forward(&seen, given)?;
            kept.push(seen.clone());
        }
        if let Some(resize) = &self.resize {
            seen = resize.forward(&seen)?;
            kept.push(seen.clone());
        }
        Ok(seen)
    }
}

/// The lowest level.
pub(super) struct Middle {
    first: Step,
    second: Resnet,
}

impl Middle {
    pub(super) fn new(place: &Place<'_>, shared: (&UNetConfig, ResnetKind)) -> Result<Self> {
        let widths = &shared.0.block_out_channels;
        let width = widths[widths.len() - 1];
        let first = Step::new(place, 0, (width, width), true, shared)?;
        let second = Resnet::new(&place.at("resnets.1"), width, width, shared.1)?;
        Ok(Self { first, second })
    }

    pub(super) fn forward(&self, seen: &Tensor, given: Given<'_>) -> Result<Tensor> {
        self.second.forward(&self.first.forward(seen, given)?, Some(given.time))
    }
}

/// A level on the way up.
pub(super) struct Up {
    steps: Vec<Step>,
    resize: Option<Conv2d>,
}

impl Up {
    pub(super) fn new(
        place: &Place<'_>,
        level: usize,
        shared: (&UNetConfig, ResnetKind),
    ) -> Result<Self> {
        let widths: Vec<usize> = shared.0.block_out_channels.iter().rev().copied().collect();
        let (before, width) = (widths[level.saturating_sub(1)], widths[level]);
        let below = widths[(level + 1).min(widths.len() - 1)];
        let attends = shared.0.up_block_types[level].starts_with("CrossAttn");
        let last = shared.0.layers_per_block;
        let step = |k: usize| {
            let beside = if k == last { below } else { width };
            let inputs = if k == 0 { before } else { width };
            Step::new(place, k, (inputs + beside, width), attends, shared)
        };
        let steps = (0..=last).map(step).collect::<Result<_>>()?;
        let resize = (level + 1 < widths.len())
            .then(|| convolution(&place.at("upsamplers.0.conv"), width, width, 3))
            .transpose()?;
        Ok(Self { steps, resize })
    }

    pub(super) fn forward(
        &self,
        mut seen: Tensor,
        given: Given<'_>,
        kept: &mut Vec<Tensor>,
    ) -> Result<Tensor> {
        for step in &self.steps {
            // As many are kept on the way down as are taken here.
            let Some(beside) = kept.pop() else { break };
            seen = step.forward(&Tensor::cat(&[&seen, &beside], 1)?, given)?;
        }
        if let Some(resize) = &self.resize {
            let size = kept.last().map(|beside| (beside.dims()[2], beside.dims()[3]));
            seen = upsampled(resize, &seen, size)?;
        }
        Ok(seen)
    }
}
