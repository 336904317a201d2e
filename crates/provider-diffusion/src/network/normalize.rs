//! Group normalization (Wu and He, 2018), with the activation that follows it.

use candle_core::{CpuStorage, CustomOp3, DType, Layout, Shape, Tensor};
use rayon::prelude::*;

use crate::error::Result;

/// Channels in groups of mean 0 and variance 1, then a scale and a shift per channel.
pub(super) struct GroupNorm {
    pub(super) weight: Tensor,
    pub(super) bias: Tensor,
    pub(super) groups: usize,
    pub(super) epsilon: f64,
}

impl GroupNorm {
    pub(super) fn forward(&self, seen: &Tensor) -> Result<Tensor> {
        self.apply(seen, false)
    }

    /// Followed by SiLU, `x / (1 + exp(-x))`.
    pub(super) fn forward_silu(&self, seen: &Tensor) -> Result<Tensor> {
        self.apply(seen, true)
    }

    fn apply(&self, seen: &Tensor, silu: bool) -> Result<Tensor> {
        if seen.device().is_cpu() && seen.dtype() == DType::F32 {
            let op = OnCpu { groups: self.groups, epsilon: self.epsilon, silu };
            let seen = seen.contiguous()?;
            return Ok(seen.apply_op3_no_bwd(&self.weight, &self.bias, &op)?);
        }
        let made = self.composed(seen)?;
        Ok(if silu { made.silu()? } else { made })
    }

    /// By the operations of candle, on any device. Sums of 16 bits would overflow, so they are of 32.
    fn composed(&self, seen: &Tensor) -> Result<Tensor> {
        let dims = seen.dims().to_vec();
        let dtype = seen.dtype();
        let rows = seen.reshape((dims[0], self.groups, ()))?.to_dtype(DType::F32)?;
        let centered = rows.broadcast_sub(&rows.mean_keepdim(2)?)?;
        let deviation = (centered.sqr()?.mean_keepdim(2)? + self.epsilon)?.sqrt()?;
        let normalized =
            centered.broadcast_div(&deviation)?.to_dtype(dtype)?.reshape(dims.as_slice())?;
        let of_channel = |t: &Tensor| t.reshape((1, (), 1, 1));
        let scaled = normalized.broadcast_mul(&of_channel(&self.weight)?)?;
        Ok(scaled.broadcast_add(&of_channel(&self.bias)?)?)
    }
}

/// In one pass over each group, whose sums are of 64 bits: groups of the autoencoder hold millions of values.
struct OnCpu {
    groups: usize,
    epsilon: f64,
    silu: bool,
}

impl CustomOp3 for OnCpu {
    fn name(&self) -> &'static str {
        "group-norm"
    }

    fn cpu_fwd(
        &self,
        seen: &CpuStorage,
        layout: &Layout,
        weight: &CpuStorage,
        weight_layout: &Layout,
        bias: &CpuStorage,
        bias_layout: &Layout,
    ) -> candle_core::Result<(CpuStorage, Shape)> {
        let seen = slice(seen, layout)?;
        let (weight, bias) = (slice(weight, weight_layout)?, slice(bias, bias_layout)?);
        let dims = layout.dims();
        let channels = weight.len();
        let plane: usize = dims[2..].iter().product();
        let per_group = channels / self.groups * plane;
        let mut out = vec![0.0f32; seen.len()];
        let groups = seen.par_chunks_exact(per_group).zip(out.par_chunks_exact_mut(per_group));
        groups.enumerate().for_each(|(at, (from, to))| {
            let first = at % self.groups * (channels / self.groups);
            let (mean, inverse) = moments(from, self.epsilon);
            let planes = from.chunks_exact(plane).zip(to.chunks_exact_mut(plane));
            for (channel, (from, to)) in planes.enumerate() {
                let scale = inverse * weight[first + channel];
                let shift = bias[first + channel];
                for (value, made) in from.iter().zip(to) {
                    let y = (value - mean) * scale + shift;
                    *made = if self.silu { y / (1.0 + (-y).exp()) } else { y };
                }
            }
        });
        Ok((CpuStorage::F32(out), layout.shape().clone()))
    }
}

/// Sums that run beside each other; their order is fixed.
const LANES: usize = 8;

/// Mean, and one over the deviation.
fn moments(values: &[f32], epsilon: f64) -> (f32, f32) {
    let sum = |term: &dyn Fn(f32) -> f64| -> f64 {
        let mut lanes = [0.0f64; LANES];
        let (chunks, rest) = values.as_chunks::<LANES>();
        for chunk in chunks {
            (0..LANES).for_each(|k| lanes[k] += term(chunk[k]));
        }
        lanes.iter().sum::<f64>() + rest.iter().map(|v| term(*v)).sum::<f64>()
    };
    let count = values.len().max(1) as f64;
    let mean = sum(&|v| f64::from(v)) / count;
    let variance = sum(&|v| (f64::from(v) - mean).powi(2)) / count;
    (mean as f32, (1.0 / (variance + epsilon).sqrt()) as f32)
}

fn slice<'a>(storage: &'a CpuStorage, layout: &Layout) -> candle_core::Result<&'a [f32]> {
    let values = storage.as_slice::<f32>()?;
    match layout.contiguous_offsets() {
        Some((from, to)) => Ok(&values[from..to]),
        None => candle_core::bail!("group normalization of a view"),
    }
}

#[cfg(test)]
mod tests {
    use candle_core::Device;

    use super::*;

    #[test]
    fn both_ways_agree_also_far_from_zero() {
        for (offset, allowed) in [(0.0, 1e-5), (100.0, 1e-3)] {
            let seen = (Tensor::arange(0f32, 2.0 * 6.0 * 35.0, &Device::Cpu).unwrap() * 0.37)
                .unwrap()
                .sin()
                .unwrap();
            let seen = (seen + offset).unwrap().reshape((2, 6, 5, 7)).unwrap();
            let channel = |a: f32| Tensor::arange(a, a + 6.0, &Device::Cpu).unwrap();
            let norm =
                GroupNorm { weight: channel(1.0), bias: channel(-2.0), groups: 3, epsilon: 1e-5 };
            let composed = norm.composed(&seen).unwrap().silu().unwrap();
            let difference = (norm.forward_silu(&seen).unwrap() - composed).unwrap().abs().unwrap();
            let worst: f32 = difference.flatten_all().unwrap().max(0).unwrap().to_scalar().unwrap();
            assert!(worst < allowed, "{offset}: {worst}");
        }
    }

    #[test]
    fn a_group_that_is_even_becomes_its_shift() {
        let even = Tensor::full(1e6f32, (1, 2, 3, 3), &Device::Cpu).unwrap();
        let one = |v: f32| Tensor::full(v, 2, &Device::Cpu).unwrap();
        let norm = GroupNorm { weight: one(3.0), bias: one(0.25), groups: 1, epsilon: 1e-6 };
        let made = norm.forward(&even).unwrap().flatten_all().unwrap().to_vec1::<f32>().unwrap();
        assert!(made.iter().all(|v| *v == 0.25), "{made:?}");
    }
}
