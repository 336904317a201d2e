//! Attention (Vaswani et al., 2017), and the transformer block of the UNet.

use candle_core::{Module as _, Tensor};
use candle_nn::{Conv2d, LayerNorm, Linear, ops::softmax_last_dim};

use super::layers::{convolution, group_norm, layer_norm, linear, linear_without_bias};
use super::normalize::GroupNorm;
use crate::error::Result;
use crate::weights::Place;

/// Scores that are held at a time: 64 MB in 32 bits. Queries of a large picture are answered in parts of a fixed size.
const MOST_SCORES: usize = 1 << 24;

/// `softmax(q k^T / sqrt(d)) v` over `[batch, tokens, heads * d]`; `mask` is added to the scores, `[queries, keys]`.
pub(super) fn attend(
    (queries, keys, values): (&Tensor, &Tensor, &Tensor),
    heads: usize,
    mask: Option<&Tensor>,
) -> Result<Tensor> {
    let (batch, count, channels) = queries.dims3()?;
    let split = |t: &Tensor| -> Result<Tensor> {
        let (batch, tokens, channels) = t.dims3()?;
        Ok(t.reshape((batch, tokens, heads, channels / heads))?.transpose(1, 2)?.contiguous()?)
    };
    let scale = 1.0 / ((channels / heads) as f64).sqrt();
    let (queries, values) = ((split(queries)? * scale)?, split(values)?);
    let keys = split(keys)?.transpose(2, 3)?;
    let per_query = batch * heads * keys.dim(3)?;
    let part = (MOST_SCORES / per_query.max(1)).clamp(1, count);
    let mut parts = Vec::new();
    for first in (0..count).step_by(part) {
        let length = part.min(count - first);
        let asked = queries.narrow(2, first, length)?.contiguous()?;
        let mut scores = asked.matmul(&keys)?;
        if let Some(mask) = mask {
            scores = scores.broadcast_add(&mask.narrow(0, first, length)?)?;
        }
        parts.push(softmax_last_dim(&scores)?.matmul(&values)?);
    }
    let made = if parts.len() == 1 { parts.remove(0) } else { Tensor::cat(&parts, 2)? };
    Ok(made.transpose(1, 2)?.reshape((batch, count, channels))?)
}

/// Attention with its projections, as diffusers names them.
pub(super) struct Attention {
    query: Linear,
    key: Linear,
    value: Linear,
    out: Linear,
    heads: usize,
}

impl Attention {
    /// `seen` channels of the keys and values; `bias` of the projections before the attention.
    pub(super) fn new(
        place: &Place<'_>,
        (channels, seen): (usize, usize),
        heads: usize,
        bias: bool,
    ) -> Result<Self> {
        let projection = |name: &str, inputs: usize| match bias {
            true => linear(&place.at(name), inputs, channels),
            false => linear_without_bias(&place.at(name), inputs, channels),
        };
        Ok(Self {
            query: projection("to_q", channels)?,
            key: projection("to_k", seen)?,
            value: projection("to_v", seen)?,
            out: linear(&place.at("to_out.0"), channels, channels)?,
            heads,
        })
    }

    pub(super) fn forward(&self, asking: &Tensor, seen: &Tensor) -> Result<Tensor> {
        let (query, key, value) =
            (self.query.forward(asking)?, self.key.forward(seen)?, self.value.forward(seen)?);
        Ok(self.out.forward(&attend((&query, &key, &value), self.heads, None)?)?)
    }
}

/// Self-attention, attention to the text, and a gated layer, each beside its input.
struct Block {
    norm1: LayerNorm,
    own: Attention,
    norm2: LayerNorm,
    text: Attention,
    norm3: LayerNorm,
    gate: Linear,
    out: Linear,
}

impl Block {
    fn new(place: &Place<'_>, channels: usize, text: usize, heads: usize) -> Result<Self> {
        let norm = |name: &str| layer_norm(&place.at(name), channels, 1e-5);
        Ok(Self {
            norm1: norm("norm1")?,
            own: Attention::new(&place.at("attn1"), (channels, channels), heads, false)?,
            norm2: norm("norm2")?,
            text: Attention::new(&place.at("attn2"), (channels, text), heads, false)?,
            norm3: norm("norm3")?,
            gate: linear(&place.at("ff.net.0.proj"), channels, 8 * channels)?,
            out: linear(&place.at("ff.net.2"), 4 * channels, channels)?,
        })
    }

    fn forward(&self, seen: &Tensor, text: &Tensor, views: usize) -> Result<Tensor> {
        let (batch, tokens, channels) = seen.dims3()?;
        let normal = self.norm1.forward(seen)?;
        // As in MVDream (Shi et al., 2024): tokens of all views of a pass see each other.
        let jointly = normal.reshape((batch / views, views * tokens, channels))?;
        let own = self.own.forward(&jointly, &jointly)?.reshape((batch, tokens, channels))?;
        let seen = (own + seen)?;
        let seen = (self.text.forward(&self.norm2.forward(&seen)?, text)? + &seen)?;
        let gated = self.gate.forward(&self.norm3.forward(&seen)?)?;
        let (value, gate) =
            (gated.narrow(2, 0, 4 * channels)?, gated.narrow(2, 4 * channels, 4 * channels)?);
        // GEGLU with the exact error function, as the weights were trained.
        let gated = (value * gate.contiguous()?.gelu_erf()?)?;
        Ok((self.out.forward(&gated)? + seen)?)
    }
}

/// A transformer over the pixels, with attention to the text.
pub(super) struct Transformer {
    norm: GroupNorm,
    inward: Conv2d,
    block: Block,
    outward: Conv2d,
}

impl Transformer {
    pub(super) fn new(
        place: &Place<'_>,
        channels: usize,
        text: usize,
        heads: usize,
        groups: usize,
    ) -> Result<Self> {
        Ok(Self {
            norm: group_norm(&place.at("norm"), groups, channels, 1e-6)?,
            inward: convolution(&place.at("proj_in"), channels, channels, 1)?,
            block: Block::new(&place.at("transformer_blocks.0"), channels, text, heads)?,
            outward: convolution(&place.at("proj_out"), channels, channels, 1)?,
        })
    }

    pub(super) fn forward(&self, seen: &Tensor, text: &Tensor, views: usize) -> Result<Tensor> {
        let (batch, channels, height, width) = seen.dims4()?;
        let inner = self.inward.forward(&self.norm.forward(seen)?)?;
        let tokens = inner.flatten_from(2)?.transpose(1, 2)?.contiguous()?;
        let tokens = self.block.forward(&tokens, text, views)?;
        let inner = tokens.transpose(1, 2)?.reshape((batch, channels, height, width))?;
        Ok((self.outward.forward(&inner.contiguous()?)? + seen)?)
    }
}
