//! Where a network gets its tensors from.

use std::cell::RefCell;
use std::fmt::Display;

use candle_core::{DType, Device, Tensor};
use motes_math::rng::keyed_rng;
use rand::RngExt as _;

use super::{Shapes, TensorFile, compare};
use crate::error::Result;

/// Tensors by name.
pub struct Source {
    kind: Kind,
    device: Device,
    dtype: DType,
    asked: RefCell<Shapes>,
}

enum Kind {
    Shapes,
    Random(u64),
    Files(Box<Files>),
}

struct Files {
    base: TensorFile,
    /// Names in the network and in the file, sorted.
    renamed: Vec<(String, String)>,
    offsets: Option<TensorFile>,
}

impl Source {
    /// Tensors without values, to learn what a network asks for.
    pub fn shapes() -> Self {
        Self::new(Kind::Shapes, &Device::Cpu, DType::F32)
    }

    /// Small random values: for measurements of time.
    pub fn random(seed: u64, device: &Device, dtype: DType) -> Self {
        Self::new(Kind::Random(seed), device, dtype)
    }

    fn new(kind: Kind, device: &Device, dtype: DType) -> Self {
        Self { kind, device: device.clone(), dtype, asked: RefCell::default() }
    }

    /// The tensors of a file, each the sum of that of `base` and of `offsets`. `network` builds the network, `rename` gives a stored
    /// name that of the network, or none for what is left out; `of` says in errors what it is.
    ///
    /// A tensor with fewer input channels than the network has is filled up with zeros where `offsets` are given, and one of the same
    /// number of values is reshaped.
    ///
    /// # Errors
    /// The files have not exactly the tensors that `network` asks for.
    pub fn files(
        base: TensorFile,
        offsets: Option<TensorFile>,
        (device, dtype): (&Device, DType),
        of: &str,
        rename: impl Fn(&str) -> Option<String>,
        network: impl Fn(&Place<'_>) -> Result<()>,
    ) -> Result<Self> {
        let plan = Self::shapes();
        network(&plan.root())?;
        let wanted = plan.asked.into_inner();
        let (mut found, mut renamed) = (Shapes::new(), Vec::new());
        for (stored, shape) in base.shapes() {
            let Some(name) = rename(&stored) else { continue };
            let fits = wanted.get(&name).filter(|w| fills(&shape, w, offsets.is_some()));
            found.insert(name.clone(), fits.cloned().unwrap_or(shape));
            renamed.push((name, stored));
        }
        renamed.sort();
        compare(&found, &wanted, &base.path, of)?;
        if let Some(offsets) = &offsets {
            let of = format!("{of} that it is added to");
            compare(&offsets.shapes(), &wanted, &offsets.path, &of)?;
        }
        Ok(Self::new(Kind::Files(Box::new(Files { base, renamed, offsets })), device, dtype))
    }

    /// The names that begin with nothing.
    pub fn root(&self) -> Place<'_> {
        Place { source: self, prefix: String::new() }
    }

    /// The shapes that were asked for so far.
    pub fn asked(&self) -> Shapes {
        self.asked.borrow().clone()
    }

    fn tensor(&self, name: String, shape: &[usize]) -> Result<Tensor> {
        let tensor = match &self.kind {
            // Strides of zero: nothing is allocated.
            Kind::Shapes => Tensor::zeros(1, DType::F32, &Device::Cpu)?.broadcast_as(shape)?,
            Kind::Random(seed) => {
                let count: usize = shape.iter().product();
                let reach = (3.0 / (count / shape[0]).max(1) as f32).sqrt();
                let mut rng = keyed_rng(*seed, count as u64, name.len() as u64);
                let values: Vec<f32> =
                    (0..count).map(|_| reach * (2.0 * rng.random::<f32>() - 1.0)).collect();
                Tensor::from_vec(values, shape, &self.device)?.to_dtype(self.dtype)?
            }
            Kind::Files(files) => {
                let Files { base, renamed, offsets } = &**files;
                let at = renamed.binary_search_by(|(n, _)| n.as_str().cmp(&name));
                let stored = at.map_or(name.as_str(), |at| renamed[at].1.as_str());
                let mut values = widened(base.read(stored)?, base.shape(stored), shape);
                if let Some(offsets) = offsets {
                    let added = offsets.read(&name)?;
                    values.iter_mut().zip(added).for_each(|(value, offset)| *value += offset);
                }
                Tensor::from_vec(values, shape, &self.device)?.to_dtype(self.dtype)?
            }
        };
        self.asked.borrow_mut().insert(name, shape.to_vec());
        Ok(tensor)
    }
}

/// Whether a stored tensor becomes one of the shape `wanted`: the same number of values, or more input channels.
fn fills(stored: &[usize], wanted: &[usize], may_widen: bool) -> bool {
    let same = stored.iter().product::<usize>() == wanted.iter().product::<usize>();
    let squeezed =
        |shape: &[usize]| -> Vec<usize> { shape.iter().copied().filter(|n| *n != 1).collect() };
    let wider = may_widen
        && stored.len() == 4
        && wanted.len() == 4
        && stored[1] < wanted[1]
        && [0, 2, 3].iter().all(|&k| stored[k] == wanted[k]);
    wider || (same && squeezed(stored) == squeezed(wanted))
}

/// Values of `stored` as those of `wanted`, whose further input channels are zero.
fn widened(values: Vec<f32>, stored: &[usize], wanted: &[usize]) -> Vec<f32> {
    let count: usize = wanted.iter().product();
    if values.len() == count {
        return values;
    }
    let (row, wide) = (values.len() / stored[0].max(1), count / wanted[0].max(1));
    let mut out = vec![0.0; count];
    for (from, to) in values.chunks_exact(row.max(1)).zip(out.chunks_exact_mut(wide.max(1))) {
        to[..row].copy_from_slice(from);
    }
    out
}

/// Tensors whose names begin alike.
#[derive(Clone)]
pub struct Place<'a> {
    source: &'a Source,
    prefix: String,
}

impl Place<'_> {
    /// The place below.
    #[must_use]
    pub fn at(&self, name: impl Display) -> Self {
        Self { source: self.source, prefix: format!("{}{name}.", self.prefix) }
    }

    /// The tensor of this name.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn tensor(&self, name: &str, shape: &[usize]) -> Result<Tensor> {
        self.source.tensor(format!("{}{name}", self.prefix), shape)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_input_channels_are_zero_and_flat_convolutions_are_matrices() {
        assert!(
            fills(&[2, 1, 1, 1], &[2, 2, 1, 1], true)
                && !fills(&[2, 1, 1, 1], &[2, 2, 1, 1], false)
        );
        assert!(fills(&[2, 3, 1, 1], &[2, 3], false) && !fills(&[2, 3], &[3, 2], false));
        assert_eq!(widened(vec![1.0, 2.0], &[2, 1, 1, 1], &[2, 2, 1, 1]), [1.0, 0.0, 2.0, 0.0]);
    }
}
