//! Latents from a level of noise to the next.

use candle_core::Tensor;

use crate::error::Result;
use crate::noise::Noise;
use crate::schedule::{Plan, Sampler};

/// Follows a plan; remembers what a sampler needs of the step before.
pub struct Stepper<'a> {
    plan: &'a Plan,
    /// The clean latents that the step before predicted.
    before: Option<Tensor>,
}

impl Plan {
    /// Latents of pure noise.
    ///
    /// # Errors
    /// Memory ran out.
    pub fn pure(&self, noise: &Tensor) -> Result<Tensor> {
        Ok(match self.sampler {
            Sampler::EulerA => (noise * self.sigmas[0])?,
            _ => noise.clone(),
        })
    }

    /// Clean latents under the noise of a step.
    ///
    /// # Errors
    /// Memory ran out.
    pub fn noised(&self, step: usize, clean: &Tensor, noise: &Tensor) -> Result<Tensor> {
        let (signal, noisy) = match self.sampler {
            Sampler::EulerA => (1.0, self.sigmas[step]),
            _ => shares(self.sigmas[step]),
        };
        Ok(((clean * signal)? + (noise * noisy)?)?)
    }

    /// Latents as the network sees them.
    ///
    /// # Errors
    /// Memory ran out.
    pub fn seen(&self, step: usize, latents: &Tensor) -> Result<Tensor> {
        Ok(match self.sampler {
            Sampler::EulerA => (latents / self.sigmas[step].hypot(1.0))?,
            _ => latents.clone(),
        })
    }
}

/// Signal and noise of variance one for a ratio of them.
fn shares(sigma: f64) -> (f64, f64) {
    let signal = 1.0 / sigma.hypot(1.0);
    (signal, sigma * signal)
}

impl<'a> Stepper<'a> {
    /// Before the first step.
    pub fn new(plan: &'a Plan) -> Self {
        Self { plan, before: None }
    }

    /// Latents after a step, from the noise that the network predicts in them.
    ///
    /// # Errors
    /// Memory ran out.
    pub fn step(
        &mut self,
        step: usize,
        latents: &Tensor,
        predicted: &Tensor,
        noise: &mut dyn Noise,
    ) -> Result<Tensor> {
        let (now, then) = (self.plan.sigmas[step], self.plan.sigmas[step + 1]);
        match self.plan.sampler {
            Sampler::Ddim => ddim(latents, predicted, shares(now), shares(then)),
            Sampler::EulerA => {
                // The noise that is added afresh, and the level that the step goes down to before.
                let up = (then * then * (now * now - then * then) / (now * now)).max(0.0).sqrt();
                let down = (then * then - up * up).max(0.0).sqrt();
                let fresh = noise.like(latents)?;
                Ok(((latents + (predicted * (down - now))?)? + (fresh * up)?)?)
            }
            Sampler::Dpm => self.dpm(step, latents, predicted, noise),
        }
    }

    /// DPM-Solver++ 2M, SDE (Lu et al., 2022), by midpoints.
    fn dpm(
        &mut self,
        step: usize,
        latents: &Tensor,
        predicted: &Tensor,
        noise: &mut dyn Noise,
    ) -> Result<Tensor> {
        let sigmas = &self.plan.sigmas;
        let (now, then) = (sigmas[step], sigmas[step + 1]);
        let ((signal, noisy), (next_signal, next_noisy)) = (shares(now), shares(then));
        let clean = ((latents - (predicted * noisy)?)? / signal)?;
        let fresh = noise.like(latents)?;
        let before = self.before.replace(clean.clone());
        if then == 0.0 {
            return Ok(clean);
        }
        // Half the logarithm of signal over noise grows by this.
        let gain = (now / then).ln();
        let (decay, share) = ((-gain).exp(), 1.0 - (-2.0 * gain).exp());
        let toward = (&clean * (next_signal * share))?;
        let mut made = ((latents * (next_noisy / noisy * decay))? + toward)?;
        if let Some(before) = before {
            let ratio = (sigmas[step - 1] / now).ln() / gain;
            made = (made + ((clean - before)? * (0.5 * next_signal * share / ratio))?)?;
        }
        Ok((made + (fresh * (next_noisy * share.max(0.0).sqrt()))?)?)
    }
}

/// One deterministic step of DDIM (Song et al., 2021), from a level of signal and noise to the next.
///
/// # Errors
/// Memory ran out.
pub fn ddim(
    latents: &Tensor,
    predicted: &Tensor,
    (signal, noisy): (f64, f64),
    (next_signal, next_noisy): (f64, f64),
) -> Result<Tensor> {
    let clean = ((latents - (predicted * noisy)?)? / signal)?;
    Ok(((clean * next_signal)? + (predicted * next_noisy)?)?)
}
