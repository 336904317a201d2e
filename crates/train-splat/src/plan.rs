//! From options to the numbers of one run: presets, and what the number of views decides.

use motes_raster::Sorting;
use motes_scene::Switch;
use serde::Serialize;

use crate::auto::options::ModelChoice;
use crate::auto::rules;
use crate::error::FitError;
use crate::front::{Settings, Stage};
use crate::options::FitOptions;

/// Everything about a run that is fixed before the first step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plan {
    /// Optimizer steps.
    pub iterations: u32,
    /// Most Gaussians at any time.
    pub max_gaussians: usize,
    /// Final SH degree.
    pub sh_degree: u8,
    /// Coarse to fine; shares sum to 1.
    pub stages: Vec<Stage>,
    /// Steps between refinements.
    pub refine_every: u32,
    /// Largest share of dropped Gaussians.
    pub dropout: f32,
    /// Bound of longest over middle axis.
    pub max_anisotropy: f32,
    /// Weight of the mean opacity.
    pub opacity_weight: f32,
    /// Weight of the mean scale over the extent.
    pub scale_weight: f32,
    /// Share of the learning rates left at the end.
    pub lr_final: f64,
    /// Spacing of the matched start points, pixels; 0: none.
    pub dense_step: usize,
    /// Whether the 3D filter is on.
    pub filter_3d: bool,
    /// Views per step.
    pub batch_views: u32,
    /// How many times the steps of the preset these are, by content.
    pub steps_factor: f64,
    /// Most that it may be; 1 when the number of steps was asked for.
    #[serde(skip)]
    pub(crate) longest: f64,
}

/// Up to this many views needles are kept short.
const FEW_VIEWS: usize = 40;
/// Up to this many views Gaussians are dropped at random: with 20 views it costs more than it
/// gains (bundled lab scene, 2500 steps: 28.47 dB held-out without, 27.83 dB with 0.3).
const VERY_FEW_VIEWS: usize = 12;

impl Plan {
    /// Resolves options for `views` training photos.
    pub fn new(options: &FitOptions, views: usize) -> Result<Self, FitError> {
        Self::with_settings(options, &Settings::of(options.preset.unwrap_or_default()), views)
    }

    /// The same with settings in the place of the preset's.
    pub(crate) fn with_settings(
        options: &FitOptions,
        settings: &Settings,
        views: usize,
    ) -> Result<Self, FitError> {
        if options.raster.sort == Sorting::Pixel {
            return Err(FitError::Option {
                flag: "--sort",
                value: "pixel".into(),
                why: "it is for rendering; fit with global or tile".into(),
            });
        }
        let iterations = match options.iterations {
            Some(n) => n,
            None => {
                let steps = settings.iterations * options.steps_scale;
                (steps / f64::from(options.batch_views.max(1))).round().max(1.0) as u32
            }
        };
        let choices = rules::Choices::new(options);
        let regularized = options.model != ModelChoice::Minimal;
        let few = regularized && views < FEW_VIEWS;
        Ok(Self {
            iterations,
            max_gaussians: options.max_gaussians.unwrap_or(settings.max_gaussians.round() as usize),
            sh_degree: choices.sh_degree.unwrap_or_else(|| rules::sh_degree_by_count(views)),
            stages: match &options.resolution_schedule {
                Some(text) => parse_stages(text)?,
                None => settings.stages(),
            },
            refine_every: options
                .refine_every
                .unwrap_or(settings.refine_every.round() as u32)
                .max(1),
            dropout: options
                .dropout
                .unwrap_or(if regularized && views <= VERY_FEW_VIEWS { 0.2 } else { 0.0 })
                .clamp(0.0, 0.9),
            max_anisotropy: options.max_anisotropy.unwrap_or(if few { 10.0 } else { 100.0 }),
            opacity_weight: options.opacity_weight.unwrap_or(0.0),
            scale_weight: options.scale_weight.unwrap_or(0.0),
            lr_final: options.lr_final.unwrap_or(settings.lr_final).clamp(1e-4, 1.0),
            dense_step: options.dense_step.unwrap_or(0),
            filter_3d: options.filter_3d != Switch::Off,
            batch_views: options.batch_views.max(1),
            steps_factor: 1.0,
            longest: if options.iterations.is_some() { 1.0 } else { settings.longest },
        })
    }

    /// Takes `factor` times as many steps, within what the preset allows.
    pub(crate) fn lengthen(&mut self, factor: f64) {
        let factor =
            if factor.is_finite() { factor.clamp(1.0, self.longest.max(1.0)) } else { 1.0 };
        let one = f64::from(self.iterations) / self.steps_factor;
        self.iterations = (one * factor).round() as u32;
        self.steps_factor = factor;
    }

    /// Leaves the last stage out; the others share its steps.
    pub(crate) fn drop_finest_stage(&mut self) {
        self.stages.pop();
        normalize(&mut self.stages);
    }

    /// The schedule as its flag takes it.
    pub(crate) fn schedule(&self) -> String {
        let entries = self.stages.iter().map(|s| format!("{}:{:.3}", s.scale, s.share));
        entries.collect::<Vec<_>>().join(",")
    }

    /// About how much memory a fit takes, bytes: photos of `pixels` each, Gaussians at the most.
    ///
    /// Per pixel of a photo its bytes and those of every resolution; once, for the largest photo, the
    /// rendering, its gradient and the maps of SSIM. Per Gaussian its parameters six times over
    /// (values, gradients, two moments, copies while it grows) and what a view projects and lists.
    pub fn memory_bytes(&self, pixels: &[u64]) -> u64 {
        let levels: f64 = self.stages.iter().map(|s| s.scale * s.scale).sum();
        let photos: f64 = pixels.iter().map(|&n| n as f64 * (4.0 + 4.0 * levels)).sum();
        let largest = pixels.iter().copied().max().unwrap_or(0) as f64;
        let floats = 11.0 + 3.0 * f64::from(self.sh_degree + 1).powi(2);
        let gaussians = self.max_gaussians as f64 * (6.0 * 4.0 * floats + 400.0);
        (photos + largest * 68.0 + gaussians) as u64
    }

    /// Index of the stage at `progress` in [0, 1].
    pub fn stage_at(&self, progress: f64) -> usize {
        let mut end = 0.0;
        for (i, stage) in self.stages.iter().enumerate() {
            end += stage.share;
            if progress < end {
                return i;
            }
        }
        self.stages.len() - 1
    }
}

fn parse_stages(text: &str) -> Result<Vec<Stage>, FitError> {
    let bad = |why: &str| FitError::Option {
        flag: "--resolution-schedule",
        value: text.to_owned(),
        why: why.to_owned(),
    };
    let mut stages = Vec::new();
    for part in text.split(',') {
        let (scale, share) =
            part.split_once(':').ok_or_else(|| bad("each entry is scale:share"))?;
        let number = |s: &str| s.trim().parse::<f64>().map_err(|_| bad("not a number"));
        let stage = Stage { scale: number(scale)?, share: number(share)? };
        if !(stage.scale > 0.0 && stage.scale <= 1.0) {
            return Err(bad("a scale lies above 0 and at most at 1"));
        }
        if !(stage.share > 0.0 && stage.share.is_finite()) {
            return Err(bad("a share is above 0"));
        }
        stages.push(stage);
    }
    normalize(&mut stages);
    Ok(stages)
}

/// Shares that sum to 1.
fn normalize(stages: &mut [Stage]) {
    let sum: f64 = stages.iter().map(|s| s.share).sum();
    for stage in stages {
        stage.share /= sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schedules_parse_and_normalize() {
        let stages = parse_stages("0.25:1, 0.5:1,1:2").unwrap();
        assert_eq!(stages[2], Stage { scale: 1.0, share: 0.5 });
        for bad in ["", "1", "0:1", "2:1", "1:-1", "1:nan", "a:b"] {
            assert!(parse_stages(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn sorting_by_pixel_is_refused() {
        let mut options = FitOptions::default();
        options.raster.sort = Sorting::Pixel;
        let error = Plan::new(&options, 20).unwrap_err().to_string();
        assert!(error.contains("--sort 'pixel'"), "{error}");
    }

    #[test]
    fn progress_walks_through_the_stages() {
        let plan = Plan::new(&FitOptions::default(), 20).unwrap();
        assert_eq!(plan.stage_at(0.0), 0);
        assert_eq!(plan.stage_at(1.0), plan.stages.len() - 1);
        let order: Vec<usize> = (0..=100).map(|i| plan.stage_at(f64::from(i) / 100.0)).collect();
        assert!(order.windows(2).all(|w| w[0] <= w[1]));
    }
}
