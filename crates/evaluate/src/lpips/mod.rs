//! LPIPS: the distance of two images in the features of a classification network.
//!
//! Zhang, Isola, Efros, Shechtman, Wang, "The Unreasonable Effectiveness of Deep Features as a
//! Perceptual Metric" (2018). For every tapped layer `l` with features `f` [C, H, W]:
//!
//! `d = Σ_l mean_{h,w} Σ_c w_lc (f̂_lc(a) - f̂_lc(b))²`, `f̂ = f / (|f|_2 + 1e-10)` over channels.
//!
//! Weights are the user's own, read from a file (`scripts/export-lpips.py` writes it); none are
//! part of motes and none are ever downloaded. Single precision; results do not depend on the
//! number of threads.

mod convolution;
mod network;
mod options;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use motes_formats::tensors::TensorData;
use motes_scene::ImageF32;
use thiserror::Error;

use convolution::{Convolution, FeatureMap};
use network::Step;
pub use options::{LpipsNet, LpipsRange};

/// Mean subtracted from RGB in [-1, 1] before the network, as in the authors' release.
const SHIFT: [f32; 3] = [-0.030, -0.088, -0.188];
/// Standard deviation that RGB is divided by.
const SCALE: [f32; 3] = [0.458, 0.448, 0.450];
/// Keeps features without energy finite.
const EPSILON: f32 = 1e-10;

/// Why LPIPS cannot be computed.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LpipsError {
    /// A tensor that the network needs is not in the file.
    #[error(
        "LPIPS weights lack the tensor \"{0}\"\nhelp: write the file with scripts/export-lpips.py --net {1}"
    )]
    Missing(String, &'static str),
    /// A tensor has another type or shape than the network needs.
    #[error(
        "LPIPS tensor \"{name}\" must be {expected}\nhelp: check that --lpips-net names the network of the file"
    )]
    Shape {
        /// Tensor name.
        name: String,
        /// What was expected, in words.
        expected: String,
    },
    /// The image is smaller than the receptive field.
    #[error("an image of {0}x{1} pixels is too small for LPIPS")]
    TooSmall(usize, usize),
}

/// A network with its weights.
#[derive(Clone, Debug)]
pub struct Lpips {
    net: LpipsNet,
    range: LpipsRange,
    pub(crate) weights_sha256: String,
    convolutions: Vec<Convolution>,
    /// Per tapped layer, one weight per channel.
    channel_weights: Vec<Vec<f32>>,
}

impl Lpips {
    /// Takes the weights of `net` from named tensors: `features.N.weight` `[out, in, k, k]` and
    /// `features.N.bias` `[out]` as torchvision numbers them, `linK.weight` with one value per
    /// channel of tap `K`.
    ///
    /// # Errors
    /// When a tensor is missing or its shape does not fit the one before it.
    pub fn new(
        net: LpipsNet,
        range: LpipsRange,
        tensors: &BTreeMap<String, TensorData>,
    ) -> Result<Self, LpipsError> {
        let fetch = |name: String| -> Result<(&[usize], &[f32]), LpipsError> {
            match tensors.get(&name) {
                None => Err(LpipsError::Missing(name, net.name())),
                Some(TensorData::F32(shape, values)) => Ok((shape, values)),
                Some(_) => Err(LpipsError::Shape { name, expected: "32-bit floats".into() }),
            }
        };
        let mut channels = 3;
        let mut convolutions = Vec::new();
        let mut channel_weights = Vec::new();
        for step in net.steps() {
            match *step {
                Step::Convolution { feature, kernel, stride, padding } => {
                    let name = format!("features.{feature}.weight");
                    let (shape, weights) = fetch(name.clone())?;
                    let (bias_shape, bias) = fetch(format!("features.{feature}.bias"))?;
                    let fits = matches!(*shape, [out, input, h, w]
                        if out > 0 && input == channels && h == kernel && w == kernel);
                    if !fits {
                        let expected = format!("of shape [N, {channels}, {kernel}, {kernel}]");
                        return Err(LpipsError::Shape { name, expected });
                    }
                    if *bias_shape != [shape[0]] {
                        let name = format!("features.{feature}.bias");
                        let expected = format!("of shape [{}]", shape[0]);
                        return Err(LpipsError::Shape { name, expected });
                    }
                    channels = shape[0];
                    convolutions.push(Convolution {
                        inputs: shape[1],
                        outputs: channels,
                        kernel,
                        stride,
                        padding,
                        weights: weights.to_vec(),
                        bias: bias.to_vec(),
                    });
                }
                Step::Tap => {
                    let name = format!("lin{}.weight", channel_weights.len());
                    let (_, weights) = fetch(name.clone())?;
                    if weights.len() != channels {
                        let expected = format!("{channels} values");
                        return Err(LpipsError::Shape { name, expected });
                    }
                    channel_weights.push(weights.to_vec());
                }
                Step::MaxPool { .. } => {}
            }
        }
        Ok(Self { net, range, weights_sha256: String::new(), convolutions, channel_weights })
    }

    /// The network.
    pub fn net(&self) -> LpipsNet {
        self.net
    }

    /// What the network is fed.
    pub fn range(&self) -> LpipsRange {
        self.range
    }

    /// Of the file of weights, hexadecimal; empty when they did not come from a file.
    pub fn weights_sha256(&self) -> &str {
        &self.weights_sha256
    }

    /// The distance of two RGB images with values in [0, 1]; 0 for equal images.
    ///
    /// # Errors
    /// When the images are smaller than the network's receptive field.
    ///
    /// # Panics
    /// When the sizes differ or an image does not have 3 channels.
    pub fn distance(&self, a: &ImageF32, b: &ImageF32) -> Result<f64, LpipsError> {
        assert_eq!((a.width, a.height, a.channels), (b.width, b.height, 3), "RGB of one size");
        let (taps_a, taps_b) = (self.taps(a)?, self.taps(b)?);
        let layers = taps_a.iter().zip(&taps_b).zip(&self.channel_weights);
        Ok(layers.map(|((a, b), weights)| layer_distance(a, b, weights)).sum())
    }

    fn taps(&self, image: &ImageF32) -> Result<Vec<FeatureMap>, LpipsError> {
        let too_small = || LpipsError::TooSmall(image.width, image.height);
        let mut map = self.input_map(image);
        let mut taps = Vec::new();
        let mut convolutions = self.convolutions.iter();
        for step in self.net.steps() {
            match *step {
                Step::Convolution { .. } => {
                    let Some(convolution) = convolutions.next() else { continue };
                    map = convolution.apply_relu(&map).ok_or_else(too_small)?;
                }
                Step::MaxPool { size } => map = map.max_pool(size, 2).ok_or_else(too_small)?,
                Step::Tap => taps.push(map.clone()),
            }
        }
        Ok(taps)
    }

    fn input_map(&self, image: &ImageF32) -> FeatureMap {
        let pixels = image.pixel_count();
        let mut values = vec![0.0; 3 * pixels];
        for (i, pixel) in image.data.chunks_exact(3).enumerate() {
            for c in 0..3 {
                let value = match self.range {
                    LpipsRange::Symmetric => 2.0 * pixel[c] - 1.0,
                    LpipsRange::Unit => pixel[c],
                };
                values[c * pixels + i] = (value - SHIFT[c]) / SCALE[c];
            }
        }
        FeatureMap { channels: 3, width: image.width, height: image.height, values }
    }
}

fn layer_distance(a: &FeatureMap, b: &FeatureMap, weights: &[f32]) -> f64 {
    let pixels = a.width * a.height;
    let mut sum = 0.0;
    for i in 0..pixels {
        let norm = |map: &FeatureMap| {
            let squares = (0..map.channels).map(|c| map.values[c * pixels + i].powi(2));
            squares.sum::<f32>().sqrt() + EPSILON
        };
        let (norm_a, norm_b) = (norm(a), norm(b));
        for (c, weight) in weights.iter().enumerate() {
            let k = c * pixels + i;
            let difference = a.values[k] / norm_a - b.values[k] / norm_b;
            sum += f64::from(weight * difference * difference);
        }
    }
    sum / pixels as f64
}
