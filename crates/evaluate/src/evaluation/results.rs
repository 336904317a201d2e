//! What an evaluation found: means, spreads, gaps, bounds, and the document of it all.

use motes_formats::documents::Document as _;
use motes_formats::metrics::{
    MetricsDocument, Protocol, Scores, SeedMetrics, SeedRow, ViewMetrics,
};
use motes_scene::SplitChoice;

use crate::page::ModelScores;
use crate::score::{Gate, GateMetric, ViewRow, bounded_value, mean_and_deviation, spread};

/// A bound and the value it was held against.
#[derive(Clone, Debug, PartialEq)]
pub struct GateResult {
    /// The bound.
    pub gate: Gate,
    /// The value; `None` when it was not measured.
    pub value: Option<f64>,
    /// Whether the bound is met; never without a value.
    pub met: bool,
}

/// Scores of all contestants.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Results {
    /// The split asked for.
    pub split: SplitChoice,
    /// One per contestant.
    pub models: Vec<ModelScores>,
}

impl Results {
    fn means(&self, split: SplitChoice) -> Vec<Scores> {
        self.models.iter().filter_map(|model| model.mean_of(split)).collect()
    }

    /// Mean over contestants and sample deviation, for a split; `None` where it was not scored.
    pub fn spread(&self, split: SplitChoice) -> Option<(Scores, Scores)> {
        let means = self.means(split);
        (!means.is_empty()).then(|| spread(&means))
    }

    /// Mean over contestants of train PSNR minus test PSNR, dB.
    pub fn gap(&self) -> Option<f64> {
        mean_and_deviation(self.models.iter().filter_map(ModelScores::gap)).map(|(mean, _)| mean)
    }

    /// Holds the means against bounds.
    pub fn check(&self, gates: &[Gate]) -> Vec<GateResult> {
        let mean = self.spread(self.split).unwrap_or_default().0;
        let result = |&gate: &Gate| {
            let value = match gate.metric {
                GateMetric::Gap => self.gap(),
                metric => bounded_value(&mean, metric),
            };
            GateResult { gate, value, met: value.is_some_and(|value| gate.is_met_by(value)) }
        };
        gates.iter().map(result).collect()
    }

    /// The `motes/metrics` document: means over contestants, views of the first one.
    pub fn to_document(&self, protocol: Protocol) -> MetricsDocument {
        let mean_of = |split| self.spread(split).map(|(mean, _)| mean);
        let (mean, deviation) = self.spread(self.split).unwrap_or_default();
        let row = |model: &ModelScores| SeedRow {
            seed: None,
            gaussians: model.name.clone(),
            scores: model.mean_of(self.split).unwrap_or_default(),
            gap: model.gap(),
        };
        let seeds = (self.models.len() > 1).then(|| SeedMetrics {
            rows: self.models.iter().map(row).collect(),
            mean,
            deviation,
        });
        let first = self.models.first();
        MetricsDocument {
            format: MetricsDocument::FORMAT.into(),
            version: MetricsDocument::version(),
            split: self.split,
            mean,
            gap: self.gap(),
            protocol,
            gaussians: first.and_then(|model| model.gaussians).map(|n| n as u64),
            views: first.iter().flat_map(|model| &model.rows).map(view_metrics).collect(),
            train: mean_of(SplitChoice::Train),
            test: mean_of(SplitChoice::Test),
            seeds,
        }
    }
}

fn view_metrics(row: &ViewRow) -> ViewMetrics {
    ViewMetrics {
        name: row.name.clone(),
        split: row.split,
        scores: row.scores(),
        counted_share: row.score.counted_share,
    }
}

impl GateResult {
    /// One line for the user.
    pub fn sentence(&self) -> String {
        let verdict = if self.met { "met" } else { "not met" };
        match self.value {
            Some(value) => format!("{} {verdict}: {} is {value:.4}", self.gate, self.gate.metric),
            None => format!("{} {verdict}: {} was not measured", self.gate, self.gate.metric),
        }
    }
}

#[cfg(test)]
mod tests {
    use motes_scene::Split;

    use super::*;
    use crate::score::ViewScore;

    fn rows(split: Split, psnrs: &[f64]) -> Vec<ViewRow> {
        let row = |&psnr: &f64| ViewRow {
            name: "v".into(),
            split,
            score: ViewScore {
                psnr,
                psnr_float: psnr,
                psnr_color_corrected: psnr,
                ssim: 0.9,
                lpips: None,
                counted_share: 1.0,
            },
        };
        psnrs.iter().map(row).collect()
    }

    fn results() -> Results {
        let model = |test: &[f64], train: &[f64]| ModelScores {
            rows: [rows(Split::Test, test), rows(Split::Train, train)].concat(),
            ..ModelScores::default()
        };
        let models = vec![model(&[20.0, 24.0], &[30.0]), model(&[26.0], &[34.0])];
        Results { split: SplitChoice::Test, models }
    }

    #[test]
    fn seeds_are_averaged_after_views() {
        let (mean, deviation) = results().spread(SplitChoice::Test).unwrap();
        assert_eq!(mean.psnr, Some(24.0));
        assert!((deviation.psnr.unwrap() - 8f64.sqrt()).abs() < 1e-12);
        assert_eq!(results().gap(), Some(8.0));
    }

    #[test]
    fn bounds_are_held_against_means() {
        let gates = ["psnr>=24", "gap<=7", "lpips<=1"].map(|text| text.parse().unwrap());
        let checked = results().check(&gates);
        assert_eq!(checked.iter().map(|g| g.met).collect::<Vec<_>>(), [true, false, false]);
        assert_eq!(checked[1].sentence(), "gap<=7 not met: gap is 8.0000");
        assert!(checked[2].sentence().contains("was not measured"));
    }

    #[test]
    fn a_split_that_was_not_scored_has_no_mean_and_no_gap() {
        let mut results = results();
        for model in &mut results.models {
            model.rows.retain(|row| row.split == Split::Test);
        }
        assert_eq!(results.gap(), None);
        assert_eq!(results.spread(SplitChoice::Train), None);
        assert!(results.spread(SplitChoice::All).is_some());
    }
}
