//! What is decided without a probe: by flags, and by the number of views where there is nothing to
//! hold out.

use super::options::{BackgroundModel, ExposureModel, ModelChoice};
use crate::options::FitOptions;

/// Fewer training views leave none to hold out for a decision.
pub(crate) const MIN_VIEWS: usize = 6;
/// One view in so many is held out until everything is decided.
const HELD_OUT_EVERY: usize = 8;
/// What is known before the first step; `None` waits for evidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Choices {
    pub(crate) sh_degree: Option<u8>,
    pub(crate) exposure: Option<ExposureModel>,
    pub(crate) background: Option<BackgroundModel>,
}

impl Choices {
    /// From the flags; those that were given win over `--model`.
    pub(crate) fn new(options: &FitOptions) -> Self {
        let by_model = match options.model {
            ModelChoice::Auto => Self { sh_degree: None, exposure: None, background: None },
            ModelChoice::Full => Self {
                sh_degree: Some(3),
                exposure: Some(ExposureModel::Affine),
                background: Some(BackgroundModel::Shell),
            },
            ModelChoice::Minimal => Self {
                sh_degree: Some(0),
                exposure: Some(ExposureModel::None),
                background: Some(BackgroundModel::None),
            },
        };
        let exposure = Some(options.exposure).filter(|e| *e != ExposureModel::Auto);
        Self {
            sh_degree: options.sh_degree.or(by_model.sh_degree),
            exposure: exposure.or(by_model.exposure),
            background: options.background_model.or(by_model.background),
        }
    }

    /// Whether anything waits for evidence.
    pub(crate) fn is_open(&self) -> bool {
        self.sh_degree.is_none() || self.exposure.is_none() || self.background.is_none()
    }
}

/// SH degree by the number of views: with few, view-dependent color hides wrong geometry.
pub(crate) fn sh_degree_by_count(views: usize) -> u8 {
    if views < 8 { 1 } else { 3 }
}

/// The training views that are held out until everything is decided, spread over the capture.
pub(crate) fn held_out(views: usize) -> Vec<u32> {
    let first = views.min(HELD_OUT_EVERY) / 2;
    (first..views).step_by(HELD_OUT_EVERY).map(|i| i as u32).collect()
}

/// Most Gaussians that the photos can determine: no more parameters (14 at SH degree 0) than
/// numbers in the photos.
pub(crate) fn most_gaussians(pixels: usize) -> usize {
    (3 * pixels / 14).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_win_over_the_model() {
        let options = FitOptions {
            model: ModelChoice::Full,
            sh_degree: Some(1),
            exposure: ExposureModel::None,
            ..FitOptions::default()
        };
        let choices = Choices::new(&options);
        assert_eq!(choices.sh_degree, Some(1));
        assert_eq!(choices.exposure, Some(ExposureModel::None));
        assert_eq!(choices.background, Some(BackgroundModel::Shell));
        assert!(!choices.is_open() && Choices::new(&FitOptions::default()).is_open());
    }

    #[test]
    fn held_out_views_are_every_eighth() {
        assert_eq!(held_out(6), [3]);
        assert_eq!(held_out(21), [4, 12, 20]);
        assert_eq!(held_out(100).len(), 12);
    }
}
