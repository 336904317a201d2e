//! Adam's memory, one array per parameter class, kept in step with the Gaussians.

use motes_math::adam::{AdamOptions, adam_step, adam_step_columns};
use motes_raster::GaussianGradients;
use motes_scene::Gaussians;
use rayon::prelude::*;

use crate::options::{FitOptions, FreezeGroup};

/// Learning rates of one step; 0 leaves a class alone.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    /// World units.
    pub means: f32,
    /// Of the quaternions.
    pub rotations: f32,
    /// Of the logarithms.
    pub log_scales: f32,
    /// Of the logits.
    pub opacity_logits: f32,
    /// Of band 0.
    pub sh0: f32,
    /// Of the other bands.
    pub sh_rest: f32,
}

impl Rates {
    /// Those of `options` when a share `progress` of the steps is done. `extent` is what centers are measured by, world
    /// units; `late` the factor on all other rates, which centers have their own of (1 % at the end, exponentially).
    pub fn at(options: &FitOptions, extent: f64, late: f64, progress: f64) -> Self {
        use FreezeGroup::{Colors, Means, Opacities, Rotations, Scales};
        let rate = |group, value: f64| if options.is_frozen(group) { 0.0 } else { value as f32 };
        Self {
            means: rate(Means, options.lr_means * extent * 0.01f64.powf(progress)),
            rotations: rate(Rotations, options.lr_rotations * late),
            log_scales: rate(Scales, options.lr_scales * late),
            opacity_logits: rate(Opacities, options.lr_opacities * late),
            sh0: rate(Colors, options.lr_sh0 * late),
            sh_rest: rate(Colors, options.lr_sh_rest * late),
        }
    }
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
        fn pick<T: Copy + Default + Send + Sync>(
            values: &[T],
            rows: &[u32],
            fresh: &[bool],
        ) -> Vec<T> {
            let row = |(&from, &fresh): (&u32, &bool)| {
                if fresh { T::default() } else { values[from as usize] }
            };
            rows.par_iter().zip(fresh).with_min_len(GATHER_CHUNK).map(row).collect()
        }
        let mut sh = vec![0.0; rows.len() * sh_row];
        sh.par_chunks_mut(sh_row.max(1)).zip(rows).zip(fresh).with_min_len(GATHER_CHUNK).for_each(
            |((out, &from), &fresh)| {
                if !fresh {
                    let from = from as usize * sh_row;
                    out.copy_from_slice(&self.sh[from..from + sh_row]);
                }
            },
        );
        Self {
            means: pick(&self.means, rows, fresh),
            rotations: pick(&self.rotations, rows, fresh),
            log_scales: pick(&self.log_scales, rows, fresh),
            opacity_logits: pick(&self.opacity_logits, rows, fresh),
            sh,
        }
    }
}

/// Rows per task when rows move.
const GATHER_CHUNK: usize = 1024;

/// Both moments of every parameter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moments {
    /// Decaying mean of the gradients.
    pub first: MomentColumns,
    /// Decaying mean of their squares.
    pub second: MomentColumns,
}

impl Moments {
    /// Before the first step.
    pub fn zeros(gaussians: &Gaussians) -> Self {
        let zeros = MomentColumns::zeros(gaussians.len(), gaussians.sh.len());
        Self { first: zeros.clone(), second: zeros }
    }

    /// Follows [`Gaussians::with_sh_degree`]: higher bands are dropped or start at zero.
    pub(crate) fn set_sh_coefficients(&mut self, old: usize, new: usize) {
        for columns in [&mut self.first, &mut self.second] {
            let mut sh = vec![0.0; columns.sh.len() / old * new];
            let kept = 3 * old.min(new);
            for (to, from) in sh.chunks_exact_mut(3 * new).zip(columns.sh.chunks_exact(3 * old)) {
                to[..kept].copy_from_slice(&from[..kept]);
            }
            columns.sh = sh;
        }
    }

    /// Follows [`Gaussians::gather`]; rows marked `fresh` start from zero.
    pub(crate) fn gather(&mut self, rows: &[u32], fresh: &[bool], sh_row: usize) {
        self.first = self.first.gather(rows, fresh, sh_row);
        self.second = self.second.gather(rows, fresh, sh_row);
    }

    /// One Adam step on all parameters.
    pub fn apply(
        &mut self,
        gaussians: &mut Gaussians,
        gradients: &GaussianGradients,
        rates: &Rates,
        update: &Update,
    ) {
        let options = AdamOptions { sparse: update.sparse, ..AdamOptions::default() };
        let (first, second) = (&mut self.first, &mut self.second);
        let classes = [
            Class {
                values: gaussians.means.as_flattened_mut(),
                gradients: gradients.means.as_flattened(),
                first: first.means.as_flattened_mut(),
                second: second.means.as_flattened_mut(),
                rate: rates.means,
            },
            Class {
                values: gaussians.rotations.as_flattened_mut(),
                gradients: gradients.rotations.as_flattened(),
                first: first.rotations.as_flattened_mut(),
                second: second.rotations.as_flattened_mut(),
                rate: rates.rotations,
            },
            Class {
                values: gaussians.log_scales.as_flattened_mut(),
                gradients: gradients.log_scales.as_flattened(),
                first: first.log_scales.as_flattened_mut(),
                second: second.log_scales.as_flattened_mut(),
                rate: rates.log_scales,
            },
            Class {
                values: &mut gaussians.opacity_logits,
                gradients: &gradients.opacity_logits,
                first: &mut first.opacity_logits,
                second: &mut second.opacity_logits,
                rate: rates.opacity_logits,
            },
        ];
        for class in classes {
            class.step(update.step, &options);
        }
        let row = 3 * ((gaussians.sh_degree as usize + 1).pow(2));
        let mut sh_rates = vec![rates.sh_rest; row];
        sh_rates[..3].fill(rates.sh0);
        // Bands that are not in use yet have neither gradients nor moments: leaving them out is exact.
        let used = row.min(3 * (update.sh_degree as usize + 1).pow(2));
        let every = u64::from(update.sh_every.max(1));
        let parts = match every {
            1 => [(0..used, update.step), (0..0, 1)],
            _ if update.step.is_multiple_of(every) => {
                [(0..3, update.step), (3..used, update.step / every)]
            }
            _ => [(0..3, update.step), (0..0, 1)],
        };
        for (columns, step) in parts.into_iter().filter(|(columns, _)| !columns.is_empty()) {
            let chunk = SH_CHUNK * row;
            gaussians
                .sh
                .par_chunks_mut(chunk)
                .zip(gradients.sh.par_chunks(chunk))
                .zip(first.sh.par_chunks_mut(chunk))
                .zip(second.sh.par_chunks_mut(chunk))
                .for_each(|(((values, gradients), first), second)| {
                    let columns = columns.clone();
                    adam_step_columns(
                        values, gradients, first, second, &sh_rates, columns, step, &options,
                    );
                });
        }
    }
}

/// Rows of spherical harmonics per task.
const SH_CHUNK: usize = 512;

/// Which of the parameters one step changes, and its number.
#[derive(Clone, Copy, Debug)]
pub struct Update {
    /// Counts from 1.
    pub step: u64,
    /// Spherical harmonics in use.
    pub sh_degree: u8,
    /// Bands above 0 change every so many steps.
    pub sh_every: u32,
    /// Parameters without a gradient keep their moments.
    pub sparse: bool,
}

/// One parameter class: its values and all that Adam keeps or needs for them.
struct Class<'a> {
    values: &'a mut [f32],
    gradients: &'a [f32],
    first: &'a mut [f32],
    second: &'a mut [f32],
    rate: f32,
}

impl Class<'_> {
    fn step(self, step: u64, options: &AdamOptions) {
        const CHUNK: usize = 8192;
        self.values
            .par_chunks_mut(CHUNK)
            .zip(self.gradients.par_chunks(CHUNK))
            .zip(self.first.par_chunks_mut(CHUNK))
            .zip(self.second.par_chunks_mut(CHUNK))
            .for_each(|(((values, gradients), first), second)| {
                adam_step(values, gradients, first, second, &[self.rate], step, options);
            });
    }
}
