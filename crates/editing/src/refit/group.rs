//! Values of one kind, of the rows that are fitted.

use motes_math::adam::{AdamOptions, adam_step};
use motes_raster::GaussianGradients;
use motes_scene::Gaussians;

/// Rate of band 0; the other bands have a twentieth. Rates are twice those of training: some hundred steps have to do.
const RATE_SH: f32 = 2e-2;
const RATE_SH_REST: f32 = 1e-3;
/// Per step, of the logarithm.
const RATE_SCALE: f32 = 2e-2;
const RATE_ROTATION: f32 = 4e-3;
const RATE_OPACITY: f32 = 5e-2;
/// Share of the usual size of what is fitted.
const RATE_MEAN: f32 = 2e-2;

/// What a Gaussian has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Sh,
    LogScale,
    Rotation,
    Opacity,
    Mean,
}

impl Kind {
    /// All values of the kind.
    pub(super) fn of(self, gaussians: &mut Gaussians) -> &mut [f32] {
        match self {
            Self::Sh => &mut gaussians.sh,
            Self::LogScale => gaussians.log_scales.as_flattened_mut(),
            Self::Rotation => gaussians.rotations.as_flattened_mut(),
            Self::Opacity => &mut gaussians.opacity_logits,
            Self::Mean => gaussians.means.as_flattened_mut(),
        }
    }

    fn gradient(self, gradients: &GaussianGradients) -> &[f32] {
        match self {
            Self::Sh => &gradients.sh,
            Self::LogScale => gradients.log_scales.as_flattened(),
            Self::Rotation => gradients.rotations.as_flattened(),
            Self::Opacity => &gradients.opacity_logits,
            Self::Mean => gradients.means.as_flattened(),
        }
    }

    /// Rate per column.
    fn rates(self, sh_coefficients: usize, usual_size: f32) -> Vec<f32> {
        match self {
            Self::Sh => {
                let rate = |k| if k < 3 { RATE_SH } else { RATE_SH_REST };
                (0..3 * sh_coefficients).map(rate).collect()
            }
            Self::LogScale => vec![RATE_SCALE; 3],
            Self::Rotation => vec![RATE_ROTATION; 4],
            Self::Opacity => vec![RATE_OPACITY],
            Self::Mean => vec![RATE_MEAN * usual_size; 3],
        }
    }
}

/// The values and what Adam knows about them.
pub(super) struct Group {
    kind: Kind,
    /// Per column.
    rates: Vec<f32>,
    pub(super) values: Vec<f32>,
    first: Vec<f32>,
    second: Vec<f32>,
}

impl Group {
    /// All kinds, of some rows, whose usual size is in world units.
    pub(super) fn all(gaussians: &mut Gaussians, rows: &[usize], usual_size: f32) -> Vec<Self> {
        let bands = gaussians.sh_coefficients();
        let kinds = [Kind::Sh, Kind::LogScale, Kind::Rotation, Kind::Opacity, Kind::Mean];
        let of_kind = |kind: Kind| {
            let rates = kind.rates(bands, usual_size);
            let values = picked(kind.of(gaussians), rows, rates.len());
            let zeros = vec![0.0; values.len()];
            Self { kind, rates, values, first: zeros.clone(), second: zeros }
        };
        kinds.map(of_kind).into()
    }

    /// Steps down the gradient, with rates times `share`; `step` counts from 1.
    pub(super) fn step(
        &mut self,
        gradients: &GaussianGradients,
        rows: &[usize],
        share: f32,
        step: u64,
    ) {
        let gradient = picked(self.kind.gradient(gradients), rows, self.rates.len());
        let rates: Vec<f32> = self.rates.iter().map(|rate| rate * share).collect();
        // What a view does not show does not move.
        let options = AdamOptions { sparse: true, ..AdamOptions::default() };
        let Self { values, first, second, .. } = self;
        adam_step(values, &gradient, first, second, &rates, step, &options);
    }

    /// Puts the values into rows.
    pub(super) fn put(&self, gaussians: &mut Gaussians, rows: impl Iterator<Item = usize>) {
        let width = self.rates.len();
        let to = self.kind.of(gaussians);
        for (row, values) in rows.zip(self.values.chunks_exact(width)) {
            to[row * width..][..width].copy_from_slice(values);
        }
    }
}

fn picked(values: &[f32], rows: &[usize], width: usize) -> Vec<f32> {
    rows.iter().flat_map(|row| values[row * width..][..width].iter().copied()).collect()
}
