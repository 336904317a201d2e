//! IC-Light (Zhang, Rao, Agrawala, 2025): a UNet of Stable Diffusion that also sees the foreground, and the background whose light it
//! takes.
//!
//! After the published demonstrations: the foreground on gray, its latents beside the noise in every step, with and without the
//! prompt; then a second pass at a larger size.

use candle_core::Tensor;
use clap::ValueEnum;
use motes_scene::ImageU8;
use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::network::UNet;
use crate::noise::Noise;
use crate::parts::Parts;
use crate::pictures::{multiple, resized, unsigned};
use crate::sampler::Stepper;
use crate::schedule::{Plan, Sampler, Schedule};

/// The byte that becomes 0 in the network: `x / 127 - 1`.
pub const GRAY: f32 = 127.0;
/// Longest side of the second pass, pixels; attention over more does not fit ordinary memory.
const MOST_SIDE: usize = 2048;
/// Input channels: noise and foreground; noise, foreground and background.
pub const BY_PROMPT: usize = 8;
/// See [`BY_PROMPT`].
pub const BY_BACKGROUND: usize = 12;

/// Where light comes from
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "sides")]
pub enum Light {
    /// From where the prompt says
    None,
    Left,
    Right,
    Top,
    Bottom,
}

/// How both passes are made.
#[derive(Clone, Debug)]
pub struct Passes {
    /// The sampler.
    pub sampler: Sampler,
    /// Its betas.
    pub schedule: Schedule,
    /// Denoising steps.
    pub steps: usize,
    /// How closely the prompt is followed.
    pub guidance: f64,
    /// Where light comes from in the first pass.
    pub light: Light,
    /// Share of noise over the gradient of the light.
    pub light_noise: f64,
    /// Size of the second pass; 1 leaves it out.
    pub second_scale: f64,
    /// Share of noise of the second pass.
    pub second_noise: f64,
}

/// What is relit.
pub struct Subject<'a> {
    /// The foreground on gray, then the background where there is one; of any size.
    pub seen: &'a [ImageU8],
    /// Prompt and negative prompt.
    pub texts: &'a [Tensor; 2],
    /// Width and height of the first pass, multiples of 64.
    pub size: (usize, usize),
}

/// The relit picture at the size of the last pass. `tick` is called after every evaluation of the network.
///
/// # Errors
/// Memory ran out, or the network answers values that are not finite.
pub fn relit(
    (parts, unet): (&Parts, &UNet),
    subject: &Subject<'_>,
    passes: &Passes,
    noise: &mut dyn Noise,
    tick: &dyn Fn(),
) -> Result<ImageU8> {
    let conditions = |size| conditions(parts, subject.seen, size);
    let scaled = |picture: &ImageU8| -> Result<Tensor> {
        Ok((parts.latents(picture, GRAY)? * parts.autoencoder.scale())?)
    };
    let size = subject.size;
    let gradient = (passes.light != Light::None && subject.seen.len() == 1)
        .then(|| gradient(passes.light, size, [255.0, 0.0]));
    let start = gradient.as_ref().map(scaled).transpose()?;
    let first = Pass { start, strength: passes.light_noise, conditions: conditions(size)? };
    let mut latents = denoised(unet, &first, subject.texts, passes, noise, tick)?;
    let larger = second_size(size, passes.second_scale);
    if let Some(larger) = larger {
        let again = resized(&unsigned(&parts.pixels(&latents)?)?, larger);
        let start = Some(scaled(&again)?);
        let second = Pass { start, strength: passes.second_noise, conditions: conditions(larger)? };
        latents = denoised(unet, &second, subject.texts, passes, noise, tick)?;
    }
    unsigned(&parts.pixels(&latents)?)
}

/// Evaluations of the network for one picture.
pub fn evaluations(passes: &Passes, size: (usize, usize), with_background: bool) -> u64 {
    let of = |strength: f64| {
        let plan = Plan::new(passes.sampler, passes.schedule, steps_below(passes.steps, strength));
        (plan.len() - plan.first(strength)) as u64
    };
    let first = match passes.light != Light::None && !with_background {
        true => of(passes.light_noise),
        false => passes.steps as u64,
    };
    first + second_size(size, passes.second_scale).map_or(0, |_| of(passes.second_noise))
}

fn second_size((width, height): (usize, usize), scale: f64) -> Option<(usize, usize)> {
    let larger = (multiple(width as f64 * scale), multiple(height as f64 * scale));
    (scale > 1.0 && larger.0.max(larger.1) <= MOST_SIDE).then_some(larger)
}

/// Scaled latents of foreground and background at a size, beside each other.
fn conditions(parts: &Parts, seen: &[ImageU8], size: (usize, usize)) -> Result<Tensor> {
    let latents = seen.iter().map(|picture| parts.latents(&resized(picture, size), GRAY));
    let latents = latents.collect::<Result<Vec<_>>>()?;
    Ok((Tensor::cat(&latents, 1)? * parts.autoencoder.scale())?)
}

/// What a pass begins from.
pub struct Pass {
    /// Scaled latents under a share of noise; none for noise alone.
    pub start: Option<Tensor>,
    /// The share of noise.
    pub strength: f64,
    /// Latents that stand behind the noise in the input.
    pub conditions: Tensor,
}

/// So many steps in all that `steps` are left below a share of noise.
fn steps_below(steps: usize, strength: f64) -> usize {
    ((steps as f64 / strength).round_ties_even() as usize).clamp(1, 1000)
}

/// Latents after all steps.
///
/// # Errors
/// Memory ran out.
pub fn denoised(
    unet: &UNet,
    pass: &Pass,
    texts: &[Tensor; 2],
    how: &Passes,
    noise: &mut dyn Noise,
    tick: &dyn Fn(),
) -> Result<Tensor> {
    let steps = match pass.start {
        Some(_) => steps_below(how.steps, pass.strength),
        None => how.steps,
    };
    let plan = Plan::new(how.sampler, how.schedule, steps);
    let (_, channels, height, width) = pass.conditions.dims4()?;
    let latent_channels = unet.in_channels() - channels;
    let empty = pass.conditions.zeros_like()?;
    let fresh = noise.like(&empty.narrow(1, 0, latent_channels)?)?;
    let fresh = fresh.reshape((1, latent_channels, height, width))?;
    let (first, mut latents) = match &pass.start {
        Some(start) => {
            let first = plan.first(pass.strength);
            (first, plan.noised(first, start, &fresh)?)
        }
        None => (0, plan.pure(&fresh)?),
    };
    let conditions = Tensor::cat(&[&pass.conditions, &pass.conditions], 0)?;
    let text = Tensor::cat(&[&texts[1], &texts[0]], 0)?;
    let mut stepper = Stepper::new(&plan);
    for step in first..plan.len() {
        let seen = plan.seen(step, &latents)?;
        let seen = Tensor::cat(&[&Tensor::cat(&[&seen, &seen], 0)?, &conditions], 1)?;
        let predicted = unet.forward(&seen, plan.times[step], &text, 1)?;
        let (without, toward) = (predicted.narrow(0, 0, 1)?, predicted.narrow(0, 1, 1)?);
        // Classifier-free guidance (Ho and Salimans, 2022).
        let predicted = (&without + ((toward - &without)? * how.guidance)?)?;
        latents = stepper.step(step, &latents, &predicted, noise)?;
        tick();
    }
    Ok(latents)
}

/// The foreground before the gray that the network knows as nothing.
pub fn on_gray(picture: &ImageU8, foreground: Option<&[f32]>) -> ImageU8 {
    let mut made = picture.clone();
    let Some(foreground) = foreground else { return made };
    for (pixel, share) in made.data.chunks_exact_mut(3).zip(foreground) {
        for value in pixel {
            *value = (GRAY + (f32::from(*value) - GRAY) * share).clamp(0.0, 255.0) as u8;
        }
    }
    made
}

/// A light from a side, brightest there.
fn gradient(light: Light, (width, height): (usize, usize), [bright, dark]: [f64; 2]) -> ImageU8 {
    let along = |k: usize, count: usize, from_end: bool| {
        let k = if from_end { count - 1 - k } else { k };
        (bright + (dark - bright) * k as f64 / (count.max(2) - 1) as f64) as u8
    };
    let value = |p: usize| {
        let (x, y) = (p % width, p / width);
        match light {
            Light::Left | Light::None => along(x, width, false),
            Light::Right => along(x, width, true),
            Light::Top => along(y, height, false),
            Light::Bottom => along(y, height, true),
        }
    };
    let pixels = (0..width * height).flat_map(|p| [value(p); 3]).collect();
    ImageU8::from_data(width, height, 3, pixels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gray_is_where_the_mask_is_black_and_light_falls_from_its_side() {
        let picture = ImageU8::from_data(2, 1, 3, vec![200, 0, 255, 200, 0, 255]);
        let made = on_gray(&picture, Some(&[1.0, 0.0]));
        assert_eq!(made.data, [200, 0, 255, 127, 127, 127]);
        assert_eq!(on_gray(&picture, None), picture);
        for (light, bright, dark) in [
            (Light::Left, (0, 2), (3, 0)),
            (Light::Right, (3, 2), (0, 4)),
            (Light::Top, (1, 0), (0, 4)),
            (Light::Bottom, (1, 4), (3, 0)),
        ] {
            let made = gradient(light, (4, 5), [255.0, 0.0]);
            assert_eq!(made.pixel(bright.0, bright.1), [255; 3], "{light:?}");
            assert_eq!(made.pixel(dark.0, dark.1), [0; 3], "{light:?}");
        }
    }

    #[test]
    fn evaluations_are_those_of_the_published_passes() {
        let passes = Passes {
            sampler: Sampler::Dpm,
            schedule: Schedule::Published,
            steps: 25,
            guidance: 2.0,
            light: Light::None,
            light_noise: 0.9,
            second_scale: 1.5,
            second_noise: 0.5,
        };
        assert_eq!(evaluations(&passes, (640, 512), false), 50);
        let lit = Passes { light: Light::Left, second_scale: 1.0, ..passes };
        assert_eq!(evaluations(&lit, (640, 512), false), 25);
        assert_eq!(evaluations(&lit, (640, 512), true), 25);
    }
}
