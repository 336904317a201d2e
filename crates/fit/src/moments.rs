//! Adam's memory, one array per parameter class, kept in step with the Gaussians.

use motes_math::adam::{AdamOptions, adam_step};
use motes_raster::GaussianGradients;
use motes_scene::Gaussians;
use rayon::prelude::*;

/// Learning rates of one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rates {
    pub(crate) means: f32,
    pub(crate) rotations: f32,
    pub(crate) log_scales: f32,
    pub(crate) opacity_logits: f32,
    pub(crate) sh0: f32,
    pub(crate) sh_rest: f32,
}

/// First or second moments in the shapes of [`Gaussians`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MomentColumns {
    /// `[N, 3]`
    pub means: Vec<[f32; 3]>,
    /// `[N, 4]`
    pub rotations: Vec<[f32; 4]>,
    /// `[N, 3]`
    pub log_scales: Vec<[f32; 3]>,
    /// `[N]`
    pub opacity_logits: Vec<f32>,
    /// `[N, K, 3]`
    pub sh: Vec<f32>,
}

impl MomentColumns {
    pub(crate) fn zeros(n: usize, sh_values: usize) -> Self {
        Self {
            means: vec![[0.0; 3]; n],
            rotations: vec![[0.0; 4]; n],
            log_scales: vec![[0.0; 3]; n],
            opacity_logits: vec![0.0; n],
            sh: vec![0.0; sh_values],
        }
    }

    /// Row `r` of the result is row `rows[r]`, or zero where `fresh[r]`.
    fn gather(&self, rows: &[u32], fresh: &[bool], sh_row: usize) -> Self {
        let mut out = Self::zeros(rows.len(), rows.len() * sh_row);
        for (to, (&from, _)) in rows.iter().zip(fresh).enumerate().filter(|(_, (_, f))| !**f) {
            let from = from as usize;
            out.means[to] = self.means[from];
            out.rotations[to] = self.rotations[from];
            out.log_scales[to] = self.log_scales[from];
            out.opacity_logits[to] = self.opacity_logits[from];
            out.sh[to * sh_row..(to + 1) * sh_row]
                .copy_from_slice(&self.sh[from * sh_row..(from + 1) * sh_row]);
        }
        out
    }
}

/// Both moments of every parameter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moments {
    /// Decaying mean of the gradients.
    pub first: MomentColumns,
    /// Decaying mean of their squares.
    pub second: MomentColumns,
}

impl Moments {
    pub(crate) fn zeros(gaussians: &Gaussians) -> Self {
        let zeros = MomentColumns::zeros(gaussians.len(), gaussians.sh.len());
        Self { first: zeros.clone(), second: zeros }
    }

    /// Follows [`Gaussians::gather`]; rows marked `fresh` start from zero.
    pub(crate) fn gather(&mut self, rows: &[u32], fresh: &[bool], sh_row: usize) {
        self.first = self.first.gather(rows, fresh, sh_row);
        self.second = self.second.gather(rows, fresh, sh_row);
    }

    /// One Adam step on all parameters; `step` counts from 1.
    pub(crate) fn apply(
        &mut self,
        gaussians: &mut Gaussians,
        gradients: &GaussianGradients,
        rates: &Rates,
        step: u64,
    ) {
        let options = AdamOptions::default();
        let (first, second) = (&mut self.first, &mut self.second);
        let mut sh_rates = vec![rates.sh_rest; 3 * gaussians.sh_coefficients()];
        sh_rates[..3].fill(rates.sh0);
        let classes = [
            Class {
                values: gaussians.means.as_flattened_mut(),
                gradients: gradients.means.as_flattened(),
                first: first.means.as_flattened_mut(),
                second: second.means.as_flattened_mut(),
                rates: &[rates.means],
            },
            Class {
                values: gaussians.rotations.as_flattened_mut(),
                gradients: gradients.rotations.as_flattened(),
                first: first.rotations.as_flattened_mut(),
                second: second.rotations.as_flattened_mut(),
                rates: &[rates.rotations],
            },
            Class {
                values: gaussians.log_scales.as_flattened_mut(),
                gradients: gradients.log_scales.as_flattened(),
                first: first.log_scales.as_flattened_mut(),
                second: second.log_scales.as_flattened_mut(),
                rates: &[rates.log_scales],
            },
            Class {
                values: &mut gaussians.opacity_logits,
                gradients: &gradients.opacity_logits,
                first: &mut first.opacity_logits,
                second: &mut second.opacity_logits,
                rates: &[rates.opacity_logits],
            },
            Class {
                values: &mut gaussians.sh,
                gradients: &gradients.sh,
                first: &mut first.sh,
                second: &mut second.sh,
                rates: &sh_rates,
            },
        ];
        for class in classes {
            class.step(step, &options);
        }
    }
}

/// One parameter class: its values and all that Adam keeps or needs for them.
struct Class<'a> {
    values: &'a mut [f32],
    gradients: &'a [f32],
    first: &'a mut [f32],
    second: &'a mut [f32],
    rates: &'a [f32],
}

impl Class<'_> {
    fn step(self, step: u64, options: &AdamOptions) {
        // Whole rows per chunk, so that the pattern of rates starts anew in each.
        let chunk = 4096 * self.rates.len();
        self.values
            .par_chunks_mut(chunk)
            .zip(self.gradients.par_chunks(chunk))
            .zip(self.first.par_chunks_mut(chunk))
            .zip(self.second.par_chunks_mut(chunk))
            .for_each(|(((values, gradients), first), second)| {
                adam_step(values, gradients, first, second, self.rates, step, options);
            });
    }
}
