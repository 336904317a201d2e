//! The text encoder of CLIP (Radford et al., 2021).

use candle_core::{DType, Device, Module as _, Tensor};
use candle_nn::{LayerNorm, Linear, ops::sigmoid};
use serde::Deserialize;

use super::attention::attend;
use super::layers::{layer_norm, linear};
use crate::error::{DiffusionError, Result};
use crate::weights::Place;

/// `config.json` of a text encoder.
#[derive(Clone, Debug, Deserialize)]
#[expect(missing_docs, reason = "the names of the file")]
pub struct TextEncoderConfig {
    pub vocab_size: usize,
    pub hidden_size: usize,
    pub intermediate_size: usize,
    pub num_hidden_layers: usize,
    pub num_attention_heads: usize,
    #[serde(default = "positions")]
    pub max_position_embeddings: usize,
    #[serde(default = "quick_gelu")]
    pub hidden_act: String,
    #[serde(default = "epsilon")]
    pub layer_norm_eps: f64,
}

fn positions() -> usize {
    77
}

fn quick_gelu() -> String {
    "quick_gelu".into()
}

fn epsilon() -> f64 {
    1e-5
}

impl TextEncoderConfig {
    fn check(&self) -> Result<()> {
        let heads = self.num_attention_heads;
        let fits = heads > 0
            && self.hidden_size > 0
            && self.hidden_size.is_multiple_of(heads)
            && (1..=100).contains(&self.num_hidden_layers)
            && (3..=4096).contains(&self.max_position_embeddings)
            && self.vocab_size > 0
            && matches!(self.hidden_act.as_str(), "quick_gelu" | "gelu");
        if fits {
            return Ok(());
        }
        let help = "give the folder of Stable Diffusion 1.5 or InstructPix2Pix";
        Err(DiffusionError::request("text_encoder/config.json is of another kind of network", help))
    }
}

struct Layer {
    norm1: LayerNorm,
    query: Linear,
    key: Linear,
    value: Linear,
    out: Linear,
    norm2: LayerNorm,
    wide: Linear,
    narrow: Linear,
}

/// Token numbers to embeddings that the UNet attends to.
pub struct TextEncoder {
    words: Tensor,
    places: Tensor,
    layers: Vec<Layer>,
    last: LayerNorm,
    config: TextEncoderConfig,
}

impl TextEncoder {
    /// With the tensors of a place.
    ///
    /// # Errors
    /// The configuration is of another network, or a tensor cannot be read.
    pub fn new(place: &Place<'_>, config: &TextEncoderConfig) -> Result<Self> {
        config.check()?;
        let (size, wide, eps) =
            (config.hidden_size, config.intermediate_size, config.layer_norm_eps);
        let embeddings = place.at("embeddings");
        let words =
            embeddings.at("token_embedding").tensor("weight", &[config.vocab_size, size])?;
        let positions = [config.max_position_embeddings, size];
        let places = embeddings.at("position_embedding").tensor("weight", &positions)?;
        let layer = |k: usize| {
            let place = place.at("encoder.layers").at(k);
            let own = |name: &str| linear(&place.at("self_attn").at(name), size, size);
            Ok(Layer {
                norm1: layer_norm(&place.at("layer_norm1"), size, eps)?,
                query: own("q_proj")?,
                key: own("k_proj")?,
                value: own("v_proj")?,
                out: own("out_proj")?,
                norm2: layer_norm(&place.at("layer_norm2"), size, eps)?,
                wide: linear(&place.at("mlp.fc1"), size, wide)?,
                narrow: linear(&place.at("mlp.fc2"), wide, size)?,
            })
        };
        let layers = (0..config.num_hidden_layers).map(layer).collect::<Result<_>>()?;
        let last = layer_norm(&place.at("final_layer_norm"), size, eps)?;
        Ok(Self { words, places, layers, last, config: config.clone() })
    }

    /// The name of a stored tensor in the network: files write it with or without a prefix, and old ones hold a buffer.
    pub fn renamed(stored: &str) -> Option<String> {
        let bare = stored.strip_prefix("text_model.").unwrap_or(stored);
        (!bare.ends_with("position_ids")).then(|| bare.to_owned())
    }

    /// Tokens of a text at most, the marks of its ends included.
    pub fn longest(&self) -> usize {
        self.config.max_position_embeddings
    }

    /// Embeddings, `[texts, tokens, channels]`, of texts of one length.
    ///
    /// # Errors
    /// A number is of no token.
    pub fn embedded(&self, texts: &[Vec<u32>]) -> Result<Tensor> {
        let device = self.words.device();
        let count = texts.first().map_or(0, Vec::len);
        if texts.iter().flatten().any(|token| *token as usize >= self.config.vocab_size) {
            let help = "give the folder of one model, whose parts belong together";
            return Err(DiffusionError::request("the tokenizer is of another text encoder", help));
        }
        let flat = Tensor::new(texts.concat(), device)?;
        let words = self.words.index_select(&flat, 0)?.reshape((texts.len(), count, ()))?;
        let mut state = words.broadcast_add(&self.places.narrow(0, 0, count)?)?;
        let mask = causal(count, state.dtype(), device)?;
        for layer in &self.layers {
            let normal = layer.norm1.forward(&state)?;
            let (query, key, value) = (
                layer.query.forward(&normal)?,
                layer.key.forward(&normal)?,
                layer.value.forward(&normal)?,
            );
            let heads = self.config.num_attention_heads;
            let seen = attend((&query, &key, &value), heads, Some(&mask))?;
            state = (state + layer.out.forward(&seen)?)?;
            let wide = layer.wide.forward(&layer.norm2.forward(&state)?)?;
            let active = match self.config.hidden_act.as_str() {
                "gelu" => wide.gelu_erf()?,
                _ => (&wide * sigmoid(&(&wide * 1.702)?)?)?,
            };
            state = (state + layer.narrow.forward(&active)?)?;
        }
        Ok(self.last.forward(&state)?)
    }
}

/// Minus infinity where a token would see a later one.
fn causal(count: usize, dtype: DType, device: &Device) -> Result<Tensor> {
    let value = |i: usize| if i % count > i / count { f32::NEG_INFINITY } else { 0.0 };
    let values: Vec<f32> = (0..count * count).map(value).collect();
    Ok(Tensor::from_vec(values, (count, count), device)?.to_dtype(dtype)?)
}
