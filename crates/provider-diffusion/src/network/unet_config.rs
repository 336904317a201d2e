//! Which UNet it is.

use serde::Deserialize;
use serde_json::Value;

use crate::error::{DiffusionError, Result};

/// `config.json` of a UNet.
#[derive(Clone, Debug, Deserialize)]
#[expect(missing_docs, reason = "the names of the file")]
pub struct UNetConfig {
    pub in_channels: usize,
    #[serde(default = "four")]
    pub out_channels: usize,
    pub block_out_channels: Vec<usize>,
    #[serde(default = "two")]
    pub layers_per_block: usize,
    pub down_block_types: Vec<String>,
    pub up_block_types: Vec<String>,
    pub cross_attention_dim: usize,
    /// The number of heads, whatever its name says.
    #[serde(default = "eight")]
    pub attention_head_dim: usize,
    #[serde(default = "groups")]
    pub norm_num_groups: usize,
    #[serde(default = "epsilon")]
    pub norm_eps: f64,
    /// What other networks have, by name.
    #[serde(flatten)]
    pub more: serde_json::Map<String, Value>,
}

fn two() -> usize {
    2
}

fn four() -> usize {
    4
}

fn eight() -> usize {
    8
}

fn groups() -> usize {
    32
}

fn epsilon() -> f64 {
    1e-5
}

/// What a UNet of Stable Diffusion 1.5 has there; other networks of the same class differ.
const SAME: [(&str, &[&str]); 18] = [
    ("act_fn", &["\"silu\""]),
    ("addition_embed_type", &["null"]),
    ("center_input_sample", &["false"]),
    ("class_embed_type", &["null"]),
    ("conv_in_kernel", &["3"]),
    ("conv_out_kernel", &["3"]),
    ("downsample_padding", &["1"]),
    ("dual_cross_attention", &["false"]),
    ("encoder_hid_dim", &["null"]),
    ("flip_sin_to_cos", &["true"]),
    ("freq_shift", &["0"]),
    ("mid_block_type", &["\"UNetMidBlock2DCrossAttn\""]),
    ("num_attention_heads", &["null"]),
    ("only_cross_attention", &["false"]),
    ("resnet_time_scale_shift", &["\"default\""]),
    ("time_embedding_type", &["\"positional\""]),
    ("transformer_layers_per_block", &["1"]),
    ("use_linear_projection", &["false"]),
];

impl UNetConfig {
    pub(super) fn check(&self) -> Result<()> {
        let help = "give the folder of Stable Diffusion 1.5 or InstructPix2Pix";
        for (name, allowed) in SAME {
            let said = self.more.get(name).map(ToString::to_string);
            if let Some(said) = said.filter(|said| !allowed.contains(&said.as_str())) {
                let cause =
                    format!("unet/config.json is of another kind of network: {name} is {said}");
                return Err(DiffusionError::request(cause, help));
            }
        }
        let known = |names: &[String], known: [&str; 2]| {
            names.len() == self.block_out_channels.len()
                && names.iter().all(|name| known.contains(&name.as_str()))
        };
        let channels = |c: &usize| {
            let (groups, heads) = (self.norm_num_groups.max(1), self.attention_head_dim.max(1));
            *c > 1 && c.is_multiple_of(groups) && c.is_multiple_of(heads) && c.is_multiple_of(2)
        };
        let fits = (1..=8).contains(&self.block_out_channels.len())
            && self.block_out_channels.iter().all(channels)
            && self.norm_num_groups > 0
            && self.attention_head_dim > 0
            && (1..=8).contains(&self.layers_per_block)
            && (1..=64).contains(&self.in_channels)
            && (1..=64).contains(&self.out_channels)
            && self.cross_attention_dim > 0
            && known(&self.down_block_types, ["CrossAttnDownBlock2D", "DownBlock2D"])
            && known(&self.up_block_types, ["CrossAttnUpBlock2D", "UpBlock2D"]);
        match fits {
            true => Ok(()),
            false => {
                let cause = "unet/config.json is of another kind of network";
                Err(DiffusionError::request(cause, help))
            }
        }
    }
}
