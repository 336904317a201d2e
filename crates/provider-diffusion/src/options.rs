//! What a user may choose.

use clap::Args;
use serde::Serialize;

pub use crate::device::{DeviceChoice, Precision};
use crate::error::{DiffusionError, Result};
use crate::relight::{BY_BACKGROUND, Light, Passes};
use crate::schedule::{Sampler, Schedule};

/// What follows every prompt of IC-Light, and what is avoided, as published.
const QUALITY: &str = "best quality";
const NEGATIVE: &str = "lowres, bad anatomy, bad hands, cropped, worst quality";
/// Longer sides that the models work in, pixels.
const RELIGHT_SIZE: usize = 640;
const EDIT_SIZE: usize = 512;
const EDIT_STEPS: usize = 20;

/// How pictures are made.
#[derive(Args, Clone, Debug, Serialize)]
pub struct Options {
    /// Longer side that the model works in, pixels; sides become multiples of 64 [default: 640, InstructPix2Pix 512]
    #[arg(long, value_name = "PIXELS", help_heading = "Quality")]
    pub size: Option<usize>,

    /// Denoising steps [default: 25 by prompt, 20 by background, InstructPix2Pix 20]
    #[arg(long, value_name = "N", help_heading = "Quality")]
    pub steps: Option<usize>,

    /// IC-Light: how closely the prompt is followed [default: 2 by prompt, 7 by background]
    #[arg(long, value_name = "SCALE", help_heading = "Model", hide_short_help = true)]
    pub guidance: Option<f64>,

    /// IC-Light: where light comes from, without a background
    #[arg(long, value_enum, default_value = "none", help_heading = "Light")]
    pub light: Light,

    /// IC-Light: share of noise over the gradient of --light
    #[arg(
        long,
        value_name = "SHARE",
        default_value_t = 0.9,
        help_heading = "Light",
        hide_short_help = true
    )]
    pub light_noise: f64,

    /// IC-Light: size of the second pass relative to the first; 1 leaves it out
    #[arg(long, value_name = "FACTOR", default_value_t = 1.5, help_heading = "Quality")]
    pub second_scale: f64,

    /// IC-Light: share of noise of the second pass
    #[arg(
        long,
        value_name = "SHARE",
        default_value_t = 0.5,
        help_heading = "Quality",
        hide_short_help = true
    )]
    pub second_noise: f64,

    /// IC-Light: how noise is removed
    #[arg(long, value_enum, default_value = "dpm", help_heading = "Model", hide_short_help = true)]
    pub sampler: Sampler,

    /// IC-Light: variances of the noise
    #[arg(
        long,
        value_enum,
        default_value = "published",
        help_heading = "Model",
        hide_short_help = true
    )]
    pub schedule: Schedule,

    /// IC-Light: what follows every prompt
    #[arg(long, value_name = "TEXT", default_value = QUALITY, help_heading = "Model", hide_short_help = true)]
    pub added_prompt: String,

    /// What the picture shall not be [default: IC-Light "lowres, bad anatomy, bad hands, cropped, worst quality", InstructPix2Pix nothing]
    #[arg(long, value_name = "TEXT", help_heading = "Model", hide_short_help = true)]
    pub negative: Option<String>,

    /// InstructPix2Pix: how closely the text is followed
    #[arg(
        long,
        value_name = "SCALE",
        default_value_t = 7.5,
        help_heading = "Model",
        hide_short_help = true
    )]
    pub text_guidance: f64,

    /// InstructPix2Pix: how closely the photo is kept
    #[arg(
        long,
        value_name = "SCALE",
        default_value_t = 1.5,
        help_heading = "Model",
        hide_short_help = true
    )]
    pub picture_guidance: f64,

    /// InstructPix2Pix: views that attend to each other at most; memory grows with the square. 1: each alone
    #[arg(
        long,
        value_name = "VIEWS",
        default_value_t = 8,
        help_heading = "Model",
        hide_short_help = true
    )]
    pub joint: usize,

    /// Where the networks run
    #[arg(long, value_enum, default_value = "auto", help_heading = "Model")]
    pub device: DeviceChoice,

    /// Numbers of the UNet [default: f32 on a CPU, f16 on a GPU]
    #[arg(long, value_enum, help_heading = "Model", hide_short_help = true)]
    pub precision: Option<Precision>,
}

impl Options {
    /// Refuses what is out of range.
    ///
    /// # Errors
    /// It says which flag.
    pub fn check(&self) -> Result<()> {
        let finite = |v: f64| (-100.0..=100.0).contains(&v);
        let share = |v: f64| v > 0.0 && v <= 1.0;
        let rules = [
            ("--size", "64 to 2048", self.size.is_none_or(|v| (64..=2048).contains(&v))),
            ("--steps", "1 to 1000", self.steps.is_none_or(|v| (1..=1000).contains(&v))),
            ("--guidance", "-100 to 100", self.guidance.is_none_or(finite)),
            ("--light-noise", "above 0 to 1", share(self.light_noise)),
            ("--second-noise", "above 0 to 1", share(self.second_noise)),
            ("--second-scale", "1 to 4", (1.0..=4.0).contains(&self.second_scale)),
            ("--text-guidance", "-100 to 100", finite(self.text_guidance)),
            ("--picture-guidance", "-100 to 100", finite(self.picture_guidance)),
            ("--joint", "1 to 64", (1..=64).contains(&self.joint)),
        ];
        match rules.iter().find(|(_, _, fits)| !fits) {
            Some((flag, range, _)) => {
                let help = format!("{flag} takes {range}");
                Err(DiffusionError::request(format!("{flag} is out of range"), help))
            }
            None => Ok(()),
        }
    }

    /// The passes of IC-Light with so many input channels.
    pub fn passes(&self, channels: usize) -> Passes {
        let (steps, guidance) = if channels == BY_BACKGROUND { (20, 7.0) } else { (25, 2.0) };
        Passes {
            sampler: self.sampler,
            schedule: self.schedule,
            steps: self.steps.unwrap_or(steps),
            guidance: self.guidance.unwrap_or(guidance),
            light: self.light,
            light_noise: self.light_noise,
            second_scale: self.second_scale,
            second_noise: self.second_noise,
        }
    }

    /// Prompt and negative prompt of IC-Light.
    pub fn relight_texts(&self, prompt: &str) -> (String, String) {
        let parts = [prompt.trim(), &self.added_prompt];
        let given: Vec<&str> = parts.into_iter().filter(|text| !text.is_empty()).collect();
        (given.join(", "), self.negative.clone().unwrap_or_else(|| NEGATIVE.into()))
    }

    /// Longer side and steps of InstructPix2Pix.
    pub fn edit_size_and_steps(&self) -> (usize, usize) {
        (self.size.unwrap_or(EDIT_SIZE), self.steps.unwrap_or(EDIT_STEPS))
    }

    /// Longer side of the first pass of IC-Light.
    pub fn relight_size(&self) -> usize {
        self.size.unwrap_or(RELIGHT_SIZE)
    }

    /// What answers depend on, for the description.
    pub fn said(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }
}
