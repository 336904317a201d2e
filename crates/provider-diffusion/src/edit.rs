//! InstructPix2Pix (Brooks, Holynski, Efros, 2023): guidance by text and by picture, DDIM below a level of noise, views that attend to
//! each other.
//!
//! The level of noise is that of Instruct-NeRF2NeRF (Haque et al., 2023): steps are spread below it. Joint attention is that of
//! MVDream (Shi et al., 2024), whose only change to self-attention is that its tokens are those of all views; it needs no other
//! weights.

use candle_core::{DType, Tensor};
use motes_scene::ImageU8;
use serde_json::Value;

use crate::error::{DiffusionError, Result};
use crate::network::UNet;
use crate::parts::Parts;
use crate::pictures::{resized, unsigned};
use crate::sampler::ddim;
use crate::schedule::{signal, times_below};

/// The byte in the middle of -1 to 1.
const MIDDLE: f32 = 127.5;
/// Input channels: noise and photo.
pub const CHANNELS: usize = 8;

/// A view to edit.
pub struct EditedView {
    /// The photo, which the edit is conditioned on.
    pub photo: ImageU8,
    /// The picture that the edit starts from, of the same size.
    pub start: ImageU8,
}

/// How views are edited.
#[derive(Clone, Debug)]
pub struct Edit {
    /// Denoising steps.
    pub steps: usize,
    /// How closely the text is followed.
    pub text_guidance: f64,
    /// How closely the photo is kept.
    pub picture_guidance: f64,
    /// Share of noise over the start.
    pub noise: f64,
    /// Share of signal at each time step.
    pub signal: Vec<f64>,
}

/// The share of signal at each time step, by the configuration of a scheduler.
///
/// # Errors
/// The model predicts something else than noise, or its schedule is not known.
pub fn signal_of(config: &Value) -> Result<Vec<f64>> {
    let number = |key: &str, default: f64| config[key].as_f64().unwrap_or(default);
    let text =
        |key: &str, default: &'static str| config[key].as_str().unwrap_or(default).to_owned();
    let help = "give the folder of InstructPix2Pix";
    let predicted = text("prediction_type", "epsilon");
    if predicted != "epsilon" {
        let cause = format!("the model predicts {predicted}, not noise");
        return Err(DiffusionError::request(cause, help));
    }
    let linear = match text("beta_schedule", "scaled_linear").as_str() {
        "scaled_linear" => false,
        "linear" => true,
        other => {
            let cause = format!("the scheduler has the schedule {other}, which is not known here");
            return Err(DiffusionError::request(cause, help));
        }
    };
    let count = number("num_train_timesteps", 1000.0);
    let (first, last) = (number("beta_start", 0.00085), number("beta_end", 0.012));
    let fits = (2.0..=100_000.0).contains(&count) && 0.0 < first && first <= last && last < 1.0;
    if !fits {
        return Err(DiffusionError::request("the scheduler has betas that are none", help));
    }
    Ok(signal(linear, first, last, count as usize))
}

impl Edit {
    /// Whether there is so little noise that views stay as they are.
    pub fn keeps(&self) -> bool {
        ((self.noise * self.signal.len() as f64) as usize) < 1
    }
}

/// Numbers of views that are edited jointly: of one size, evenly spread over groups of at most `most`.
pub fn groups(views: &[EditedView], most: usize) -> Vec<Vec<usize>> {
    let mut sizes: Vec<((usize, usize), Vec<usize>)> = Vec::new();
    for (i, view) in views.iter().enumerate() {
        let size = (view.photo.width, view.photo.height);
        match sizes.iter_mut().find(|(found, _)| *found == size) {
            Some((_, alike)) => alike.push(i),
            None => sizes.push((size, vec![i])),
        }
    }
    let split = |(_, alike): ((usize, usize), Vec<usize>)| {
        let count = alike.len().div_ceil(most.max(1));
        (0..count)
            .map(|k| alike.iter().copied().skip(k).step_by(count).collect())
            .collect::<Vec<Vec<usize>>>()
    };
    sizes.into_iter().flat_map(split).collect()
}

/// Views of one size, edited jointly at the working size; pictures have the size of their views. `fresh` is the noise, `texts` are
/// prompt and negative prompt.
///
/// # Errors
/// Memory ran out, or the network answers values that are not finite.
pub fn edited(
    (parts, unet): (&Parts, &UNet),
    views: &[&EditedView],
    (texts, size): (&[Tensor; 2], (usize, usize)),
    how: &Edit,
    fresh: &Tensor,
    tick: &dyn Fn(),
) -> Result<Vec<ImageU8>> {
    let latents = |pictures: Vec<&ImageU8>| -> Result<Tensor> {
        let each = pictures.into_iter().map(|p| parts.latents(&resized(p, size), MIDDLE));
        Ok(Tensor::cat(&each.collect::<Result<Vec<_>>>()?, 0)?)
    };
    let photos = latents(views.iter().map(|view| &view.photo).collect())?;
    let starts = latents(views.iter().map(|view| &view.start).collect())?;
    let starts = (starts * parts.autoencoder.scale())?;
    let made = edited_latents(unet, (&photos, &starts), texts, how, fresh, tick)?;
    let picture = |(k, view): (usize, &&EditedView)| {
        let pixels = unsigned(&parts.pixels(&made.narrow(0, k, 1)?)?)?;
        Ok(resized(&pixels, (view.photo.width, view.photo.height)))
    };
    views.iter().enumerate().map(picture).collect()
}

/// Scaled latents of views. `photos` are not scaled, `starts` are, `fresh` is noise in the shape of one of them.
///
/// # Errors
/// Memory ran out.
pub fn edited_latents(
    unet: &UNet,
    (photos, starts): (&Tensor, &Tensor),
    texts: &[Tensor; 2],
    how: &Edit,
    fresh: &Tensor,
    tick: &dyn Fn(),
) -> Result<Tensor> {
    let times = times_below(how.noise, how.steps, how.signal.len());
    edited_at(unet, &times, (photos, starts), texts, how, fresh, tick)
}

/// [`edited_latents`] at these time steps.
///
/// # Errors
/// Memory ran out.
pub fn edited_at(
    unet: &UNet,
    times: &[usize],
    (photos, starts): (&Tensor, &Tensor),
    texts: &[Tensor; 2],
    how: &Edit,
    fresh: &Tensor,
    tick: &dyn Fn(),
) -> Result<Tensor> {
    let views = photos.dim(0)?;
    let shares = |signal: f64| (signal.sqrt(), (1.0 - signal).sqrt());
    let mut levels: Vec<(f64, f64)> = times.iter().map(|t| shares(how.signal[*t])).collect();
    levels.push((1.0, 0.0));
    let (kept, noisy) = if how.noise >= 1.0 { (0.0, 1.0) } else { levels[0] };
    let fresh = fresh.broadcast_as(starts.shape())?;
    let mut latents = ((starts * kept)? + (fresh * noisy)?)?;
    let expanded = |text: &Tensor, count: usize| -> Result<Tensor> {
        let (_, tokens, channels) = text.dims3()?;
        Ok(text.broadcast_as((count, tokens, channels))?.contiguous()?)
    };
    let [prompt, negative] = texts;
    let text = Tensor::cat(&[expanded(prompt, views)?, expanded(negative, 2 * views)?], 0)?;
    let photos = Tensor::cat(&[photos, photos, &photos.zeros_like()?], 0)?.to_dtype(DType::F32)?;
    for (step, &time) in times.iter().enumerate() {
        let noisy = Tensor::cat(&[&latents, &latents, &latents], 0)?;
        let seen = Tensor::cat(&[&noisy, &photos], 1)?;
        let predicted = unet.forward(&seen, time as f64, &text, views)?;
        let pass = |k: usize| predicted.narrow(0, k * views, views);
        let (toward, picture, none) = (pass(0)?, pass(1)?, pass(2)?);
        // Equation 3 of InstructPix2Pix.
        let by_text = ((toward - &picture)? * how.text_guidance)?;
        let by_picture = ((picture - &none)? * how.picture_guidance)?;
        let predicted = ((none + by_text)? + by_picture)?;
        latents = ddim(&latents, &predicted, levels[step], levels[step + 1])?;
        tick();
    }
    Ok(latents)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn views_are_spread_evenly_over_groups_of_one_size() {
        let view = |w: usize| EditedView {
            photo: ImageU8::filled(w, 2, 3, 0),
            start: ImageU8::filled(w, 2, 3, 0),
        };
        let views: Vec<EditedView> = [4, 4, 5, 4, 4, 4].map(view).into();
        assert_eq!(groups(&views, 2), [vec![0, 4], vec![1, 5], vec![3], vec![2]]);
        assert_eq!(groups(&views, 8), [vec![0, 1, 3, 4, 5], vec![2]]);
    }

    #[test]
    fn other_schedulers_are_refused() {
        assert_eq!(signal_of(&json!({})).unwrap().len(), 1000);
        for (key, value) in [("prediction_type", "v_prediction"), ("beta_schedule", "cosine")] {
            assert!(signal_of(&json!({ key: value })).is_err());
        }
        assert!(signal_of(&json!({"num_train_timesteps": 0})).is_err());
        assert!(signal_of(&json!({"beta_end": 2.0})).is_err());
    }
}
