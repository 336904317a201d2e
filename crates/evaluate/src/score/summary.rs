//! Means over views and spreads over models.

use motes_formats::metrics::{Scores, finite};
use motes_scene::Split;

use super::{GateMetric, ViewScore, mean_and_deviation};

/// A scored view.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewRow {
    /// Name of the view.
    pub name: String,
    /// Its role in the capture.
    pub split: Split,
    /// Its scores.
    pub score: ViewScore,
}

impl ViewRow {
    /// The scores as a document holds them: no value instead of one that is not finite.
    pub fn scores(&self) -> Scores {
        Scores {
            psnr: finite(self.score.psnr),
            psnr_float: finite(self.score.psnr_float),
            psnr_color_corrected: finite(self.score.psnr_color_corrected),
            ssim: finite(self.score.ssim),
            lpips: self.score.lpips.and_then(finite),
        }
    }
}

/// Mean and sample standard deviation, score by score. A score that no item has has none; items
/// weigh the same.
pub fn spread(items: &[Scores]) -> (Scores, Scores) {
    let both = |value: fn(&Scores) -> Option<f64>| {
        mean_and_deviation(items.iter().filter_map(value)).unzip()
    };
    let (mut mean, mut deviation) = (Scores::default(), Scores::default());
    (mean.psnr, deviation.psnr) = both(|s| s.psnr);
    (mean.psnr_float, deviation.psnr_float) = both(|s| s.psnr_float);
    (mean.psnr_color_corrected, deviation.psnr_color_corrected) = both(|s| s.psnr_color_corrected);
    (mean.ssim, deviation.ssim) = both(|s| s.ssim);
    (mean.lpips, deviation.lpips) = both(|s| s.lpips);
    (mean, deviation)
}

/// Means over views.
pub fn mean_scores<'a>(rows: impl IntoIterator<Item = &'a ViewRow>) -> Scores {
    let scores: Vec<Scores> = rows.into_iter().map(ViewRow::scores).collect();
    spread(&scores).0
}

/// The score that a gate bounds; `gap` is not one of a single split.
pub fn bounded_value(scores: &Scores, metric: GateMetric) -> Option<f64> {
    match metric {
        GateMetric::Psnr => scores.psnr,
        GateMetric::PsnrFloat => scores.psnr_float,
        GateMetric::PsnrColorCorrected => scores.psnr_color_corrected,
        GateMetric::Ssim => scores.ssim,
        GateMetric::Lpips => scores.lpips,
        GateMetric::Gap => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(psnr: f64, lpips: Option<f64>) -> ViewRow {
        let score = ViewScore {
            psnr,
            psnr_float: psnr + 0.5,
            psnr_color_corrected: psnr + 1.0,
            ssim: 0.5,
            lpips,
            counted_share: 1.0,
        };
        ViewRow { name: "v".into(), split: Split::Test, score }
    }

    #[test]
    fn the_mean_is_one_of_psnrs_and_skips_views_without_pixels() {
        let mean = mean_scores(&[row(20.0, None), row(30.0, None), row(f64::NAN, None)]);
        assert_eq!((mean.psnr, mean.psnr_float), (Some(25.0), Some(25.5)));
        assert_eq!(mean.lpips, None);
        assert_eq!(mean_scores(&[]), Scores::default());
    }

    #[test]
    fn models_give_a_mean_and_a_spread() {
        let models = [mean_scores(&[row(20.0, Some(0.1))]), mean_scores(&[row(22.0, None)])];
        let (mean, deviation) = spread(&models);
        assert_eq!(bounded_value(&mean, GateMetric::Psnr), Some(21.0));
        assert!((deviation.psnr.unwrap() - 2f64.sqrt()).abs() < 1e-12);
        assert_eq!((mean.lpips, deviation.lpips), (Some(0.1), Some(0.0)));
        assert_eq!(bounded_value(&mean, GateMetric::Gap), None);
    }
}
