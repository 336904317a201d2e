//! Held-out likelihood against added parameters.
//!
//! Residuals of the held-out views are taken as Gaussian with a variance estimated from
//! themselves, so replacing model 0 by model 1 changes the log-likelihood of `n` independent
//! residuals by `n/2 · ln(S0 / S1)`, `S` the sums of squares. Neighboring residuals are alike:
//! `n` counts values over `τ_x τ_y τ_c`, with `τ = 1 + 2 Σ ρ(lag)` the integrated autocorrelation
//! along rows and columns (up to the first below 0.05) and `τ_c = 1 + 2 ρ` for the channels. The gain per
//! residual is extended to the residuals of all training photos at the probe's resolution:
//!
//! `evidence = n_all/2 · ln(S0 / S1)`
//!
//! Parameters that all views share (exposures, one color) cost what the Bayesian information
//! criterion asks (Schwarz 1978), `k/2 · ln n_all`. Parameters that come with each Gaussian cannot be
//! charged that way: there are more of them than independent residuals and most are hardly
//! determined, so the criterion would refuse every Gaussian. What they overfit the held-out views
//! already charge; on top they pay rent for memory and time, [`RENT_DB`] decibels per doubling of
//! the parameters.
//!
//! `cost = k_shared/2 · ln n_all + n_all · RENT_DB · ln(10)/20 · log2(k1 / k0)`
//!
//! A component is kept when `evidence - cost` exceeds one standard error of the evidence, from the
//! spread of paired sums of squares over blocks of 8×8 pixels (larger than the correlation).

use motes_raster::Planes;

use crate::target::Target;

/// Held-out gain that doubling the parameters must bring, dB: all three bands of view-dependent
/// color (about four times the parameters) must bring 0.1 dB.
pub(crate) const RENT_DB: f64 = 0.05;
/// Margin in standard errors.
pub(crate) const MARGIN: f64 = 1.0;
/// Side of a block of the error estimate, pixels.
const BLOCK: usize = 8;
/// Longest lag of the autocorrelation, pixels.
const LAGS: usize = 12;

/// Squared residuals of one variant on the held-out views.
#[derive(Clone, Debug, Default)]
pub(crate) struct Residuals {
    /// Sum of squares per block, all views.
    blocks: Vec<f64>,
    /// Values counted.
    count: f64,
    /// `Σ r(x) r(x + lag)` along rows and along columns; lag 0 first.
    lagged: [[f64; LAGS + 1]; 2],
    /// `Σ r_c r_d` over the three pairs of channels.
    channels: f64,
}

/// Which blocks count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Colors {
    /// All, colors as they are.
    Raw,
    /// A gain and an offset per channel are fitted on every other block (a checkerboard) and the
    /// rest counts: the exposure of a view nobody fitted is unknown.
    Corrected,
}

impl Residuals {
    /// Adds one view; the rendering counts with all colors times `gain`.
    pub(crate) fn add(&mut self, render: &Planes, gain: f32, target: &Target, colors: Colors) {
        let metadata_gain = gain;
        let (w, h) = (target.width, target.height);
        let white = |x: usize, y: usize| (x / BLOCK + y / BLOCK).is_multiple_of(2);
        let counts = |x: usize, y: usize| {
            let at = y * w + x;
            target.weight.as_ref().is_none_or(|m| m[at] > 0)
                && target.alpha.as_ref().is_none_or(|a| a[at] == 255)
        };
        let mut residual = vec![0.0f32; 3 * w * h];
        for c in 0..3 {
            let pairs = || {
                (0..h).flat_map(move |y| {
                    let rows = render.row(c, y).iter().zip(target.row(c, y)).enumerate();
                    rows.map(move |(x, (&a, &b))| {
                        (x, y, f64::from(metadata_gain * a), f64::from(b) / 255.0)
                    })
                })
            };
            let (gain, offset) = match colors {
                Colors::Raw => (1.0, 0.0),
                Colors::Corrected => {
                    affine(pairs().filter(|p| white(p.0, p.1) && counts(p.0, p.1)))
                }
            };
            for (x, y, a, b) in pairs() {
                let used = colors == Colors::Raw || !white(x, y);
                if used && counts(x, y) {
                    residual[(c * h + y) * w + x] = (gain * a + offset - b) as f32;
                    self.count += 1.0;
                }
            }
        }
        self.add_sums(&residual, w, h);
    }

    fn add_sums(&mut self, residual: &[f32], w: usize, h: usize) {
        let columns = w.div_ceil(BLOCK);
        let mut blocks = vec![0.0; columns * h.div_ceil(BLOCK)];
        let at = |c: usize, x: usize, y: usize| f64::from(residual[(c * h + y) * w + x]);
        for y in 0..h {
            for x in 0..w {
                let r: [f64; 3] = std::array::from_fn(|c| at(c, x, y));
                blocks[y / BLOCK * columns + x / BLOCK] += r.iter().map(|v| v * v).sum::<f64>();
                self.channels += r[0] * r[1] + r[1] * r[2] + r[0] * r[2];
                for (c, &v) in r.iter().enumerate().filter(|(_, v)| **v != 0.0) {
                    for lag in 0..=LAGS {
                        if x + lag < w {
                            self.lagged[0][lag] += v * at(c, x + lag, y);
                        }
                        if y + lag < h {
                            self.lagged[1][lag] += v * at(c, x, y + lag);
                        }
                    }
                }
            }
        }
        self.blocks.extend(blocks);
    }

    /// Sum of squares.
    fn sum(&self) -> f64 {
        self.blocks.iter().sum()
    }

    /// Values that count, not corrected for correlation.
    pub(crate) fn count(&self) -> f64 {
        self.count
    }

    /// dB of the mean squared residual.
    pub(crate) fn psnr(&self) -> f64 {
        let mse = self.sum() / self.count.max(1.0);
        if mse > 0.0 { (-10.0 * mse.log10()).min(128.0) } else { 128.0 }
    }

    /// How many values one independent residual is spread over.
    pub(crate) fn correlation(&self) -> f64 {
        let along = |sums: &[f64; LAGS + 1]| {
            let terms = sums[1..].iter().map(|s| s / sums[0].max(1e-300));
            1.0 + 2.0 * terms.take_while(|rho| *rho > 0.05).sum::<f64>()
        };
        let channel = (self.channels / self.sum().max(1e-300)).clamp(0.0, 1.0);
        (along(&self.lagged[0]) * along(&self.lagged[1]) * (1.0 + 2.0 * channel)).max(1.0)
    }
}

/// Least squares `b ≈ gain · a + offset`; the identity when nothing is known.
fn affine(pairs: impl Iterator<Item = (usize, usize, f64, f64)>) -> (f64, f64) {
    let mut s = [0.0; 5];
    for (_, _, a, b) in pairs {
        for (sum, term) in s.iter_mut().zip([1.0, a, b, a * a, a * b]) {
            *sum += term;
        }
    }
    let [n, a, b, aa, ab] = s;
    let variance = n * aa - a * a;
    if !(variance > 1e-9 * n * n) {
        return (1.0, if n > 0.0 { (b - a) / n } else { 0.0 });
    }
    let gain = (n * ab - a * b) / variance;
    (gain, (b - gain * a) / n)
}

/// Evidence for one model over another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Evidence {
    /// Gain of log-likelihood over all photos, nats.
    pub(crate) nats: f64,
    /// Its standard error.
    pub(crate) error: f64,
    /// Independent residuals of all photos.
    pub(crate) independent: f64,
}

impl Evidence {
    /// Of `with` over `without`; `photos` training photos, of which `held_out` were looked at.
    pub(crate) fn new(without: &Residuals, with: &Residuals, photos: f64, held_out: f64) -> Self {
        let independent = without.count / without.correlation() * photos / held_out.max(1.0);
        let (s0, s1) = (without.sum(), with.sum());
        if !(s0 > 0.0 && s1 > 0.0) {
            return Self { nats: 0.0, error: f64::INFINITY, independent };
        }
        let ratio = s0 / s1;
        let spread: f64 =
            without.blocks.iter().zip(&with.blocks).map(|(a, b)| (a - ratio * b).powi(2)).sum();
        Self {
            nats: 0.5 * independent * ratio.ln(),
            error: 0.5 * independent * spread.sqrt() / s0,
            independent,
        }
    }

    /// What `shared` common parameters and a model grown by the factor `growth` cost, nats.
    pub(crate) fn cost(&self, shared: usize, growth: f64) -> f64 {
        let per_db = self.independent * std::f64::consts::LN_10 / 20.0;
        let rent = per_db * RENT_DB * growth.max(1.0).log2();
        0.5 * shared as f64 * self.independent.max(1.0).ln() + rent
    }

    /// Whether the gain exceeds `cost` by the margin.
    pub(crate) fn exceeds(&self, cost: f64) -> bool {
        self.nats - cost > MARGIN * self.error
    }
}

#[cfg(test)]
mod tests;
