//! What the stage `segment-select` says when it is done.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::{ProjectedPrompts, SelectSource, notes};
use motes_formats::selection::{BoxDocument, PlaneDocument};
use motes_protocol::ProviderUse;
use motes_scene::Capture;
use serde::Serialize;

use super::{Answer, ByProvider};

/// Share of the Gaussians from which on an answer is hardly one object.
const MUCH: f64 = 1.0 / 3.0;

/// One of the nested answers.
#[derive(Clone, Debug, Serialize)]
pub struct CandidateReport {
    /// `whole`, `part` or `subpart`.
    pub name: &'static str,
    /// Gaussians.
    pub count: usize,
    /// How little holds it to the rest, 0 to 1; of another segmenter, the intersection over union that it expects.
    pub score: f32,
    /// Intersection over union of the rendered selection and the masks of the views.
    pub agreement: f32,
    /// Share inside the masks from which a Gaussian belongs.
    pub threshold: f32,
}

/// Who answered, when it was not the graph cut.
#[derive(Clone, Debug, Serialize)]
pub struct SegmenterReport {
    /// The program and its models.
    pub provider: ProviderUse,
    /// Views that were asked.
    pub views_asked: Vec<String>,
    /// Views whose answers contradict the others and were left out.
    pub views_left_out: Vec<String>,
}

impl SegmenterReport {
    /// Of a segmenter that answered about a capture.
    pub fn new(
        segmenter: &ProjectedPrompts<ByProvider<'_>>,
        capture: Option<&(Capture, PathBuf)>,
    ) -> Self {
        let names = |views: Vec<usize>| {
            let name = |v: usize| Some(capture?.0.views[v].name.clone());
            views.into_iter().filter_map(name).collect()
        };
        let resolved = segmenter.resolved();
        Self {
            provider: segmenter.segmenter().used(),
            views_asked: names(resolved.asked),
            views_left_out: names(resolved.left_out),
        }
    }
}

/// The report.
#[derive(Clone, Debug, Serialize)]
pub struct SelectReport {
    /// Where the selection is.
    pub output: PathBuf,
    /// Gaussians that belong.
    pub count: usize,
    /// Gaussians in all.
    pub gaussians: usize,
    /// Bounds of all but the outermost selected centers, world.
    pub object_box: Option<BoxDocument>,
    /// What it stands on, where one was found.
    pub support_plane: Option<PlaneDocument>,
    /// Answers to a prompt, the whole object first.
    pub candidates: Vec<CandidateReport>,
    /// Who answered, when it was not the graph cut.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segmenter: Option<SegmenterReport>,
    /// Seconds for the views: made, or read from the cache.
    pub seconds_prepare: f64,
    /// Seconds for the answer.
    pub seconds_answer: f64,
}

impl SelectReport {
    /// Of an answer.
    pub fn new(source: &SelectSource<'_>, answer: &Answer, output: &Path) -> Self {
        let notes = notes(source, &answer.selection, &[]);
        let names = ["whole", "part", "subpart"];
        let candidate = |(name, p): (&'static str, &crate::Proposal)| CandidateReport {
            name,
            count: p.selection.count(),
            score: p.score,
            agreement: p.agreement,
            threshold: p.threshold,
        };
        Self {
            output: output.to_owned(),
            count: answer.selection.count(),
            gaussians: answer.selection.len(),
            object_box: notes.object_box,
            support_plane: notes.support_plane,
            candidates: names.into_iter().zip(&answer.proposals).map(candidate).collect(),
            segmenter: None,
            seconds_prepare: 0.0,
            seconds_answer: 0.0,
        }
    }

    /// What to do where a prompt selected more than was probably meant.
    pub fn doubt(&self) -> Option<String> {
        let share = self.count as f64 / self.gaussians.max(1) as f64;
        (!self.candidates.is_empty() && share >= MUCH).then(|| {
            format!(
                "the selection holds {:.0} % of the Gaussians; if less was meant, draw a --box around the object, or take --candidate \
                 part or subpart",
                100.0 * share
            )
        })
    }
}

impl fmt::Display for SelectReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let share = 100.0 * self.count as f64 / self.gaussians.max(1) as f64;
        let Self { count, gaussians, .. } = self;
        writeln!(f, "{count} of {gaussians} Gaussians ({share:.1} %): {}", self.output.display())?;
        if let Some(BoxDocument { min, max }) = self.object_box {
            let size = [0, 1, 2].map(|k| max[k] - min[k]);
            writeln!(f, "from {min:.3?} to {max:.3?}, size {size:.3?}")?;
        }
        for c in &self.candidates {
            writeln!(
                f,
                "{}: {} Gaussians, score {:.4}, views agree to {:.3}",
                c.name, c.count, c.score, c.agreement
            )?;
        }
        if let Some(SegmenterReport { provider, views_asked, views_left_out }) = &self.segmenter {
            let (asked, out) = (views_asked.len(), views_left_out.len());
            let models: Vec<String> =
                provider.models.iter().map(|m| format!("{} ({})", m.id, m.license)).collect();
            writeln!(
                f,
                "{} with {}: {asked} views asked, {out} left out",
                provider.name,
                models.join(", ")
            )?;
        }
        write!(f, "views {:.2} s, answer {:.2} s", self.seconds_prepare, self.seconds_answer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_of_half_the_scene_is_doubted_and_a_shape_is_not() {
        let whole = CandidateReport {
            name: "whole",
            count: 50,
            score: 0.99,
            agreement: 0.9,
            threshold: 0.5,
        };
        let mut report = SelectReport {
            output: "selection.json".into(),
            count: 50,
            gaussians: 100,
            object_box: None,
            support_plane: None,
            candidates: vec![whole],
            segmenter: None,
            seconds_prepare: 0.0,
            seconds_answer: 0.0,
        };
        assert!(report.doubt().unwrap().starts_with("the selection holds 50 % of the Gaussians"));
        report.count = 20;
        assert_eq!(report.doubt(), None);
        report.count = 100;
        report.candidates.clear();
        assert_eq!(report.doubt(), None);
    }
}
