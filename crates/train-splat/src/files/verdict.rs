//! What a finished fit is worth, in plain words.

use motes_stage::Context;
use rayon::prelude::*;
use serde::Serialize;

use super::failure_words::{contradiction, what_is_wrong};
use super::scores::Held;
use super::session::Session;
use super::start::Start;
use crate::{Baseline, Failure, Health, PoseCheck, SHORTEST_RUN, StartFrom, Target, TrainingImage};

/// Photos whose baseline is measured, evenly chosen.
const LOOKED_AT: usize = 24;
const LOOKED_AT_IN_TIME: usize = 4;
/// dB above a blurred photo from which contradicting matches are only worth a warning.
const CLEARLY_GOOD_DB: f64 = 3.0;

/// Whether a fit is usable, and what it is judged by.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// Where the first Gaussians came from.
    pub start: StartFrom,
    /// Starts that came to nothing before it.
    pub failed_starts: Vec<StartFrom>,
    /// PSNR of a few training photos and of pictures without shape there.
    pub train: Health,
    /// PSNR that pictures without shape reach on the held-out photos.
    pub held_out_baseline: Option<Baseline>,
    /// Whether matches between photos agree with the poses, where it was looked at.
    pub poses: Option<PoseCheck>,
    /// Why the fit has failed; null when it has not.
    pub failure: Option<String>,
}

impl Verdict {
    /// Judges a finished session by its scores of the held-out photos; warns, and says that the gate
    /// is missed when the fit has failed.
    pub(super) fn new(
        session: &mut Session<'_>,
        start: &Start,
        held_out: Option<Held>,
        context: &Context,
    ) -> Self {
        let trainer = &mut session.trainer;
        let steps = trainer.state.step;
        let gaussians = trainer.state.gaussians.len();
        let train = trainer.health();
        let held_out_baseline = baseline(&start.held_out, trainer.background(), start);
        let mut failure = train.failure(gaussians, steps);
        let mut on = "the training photos";
        if let (None, Some(held), Some(baseline)) = (failure, held_out, held_out_baseline)
            && let Some(needed) = baseline.needed(steps)
            && held.psnr < needed
        {
            failure = Some(Failure::BelowBaseline { psnr: held.psnr, needed });
            on = "the held-out photos";
        }
        if failure.is_some() {
            trainer.check_poses(&start.train);
        }
        let state = &trainer.state.model.start;
        let mut verdict = Self {
            start: state.from,
            failed_starts: state.failed.clone(),
            train,
            held_out_baseline,
            poses: state.poses.clone(),
            failure: failure.map(|failure| format!("on {on} {}", what_is_wrong(&failure))),
        };
        verdict.judge_poses(steps, held_out, context);
        if let Some(text) = &verdict.failure {
            let cause = failure.map(|f| format!("; {}", verdict.likely_cause(f)));
            context
                .gate_not_met(format!("the fit has failed: {text}{}", cause.unwrap_or_default()));
        }
        verdict
    }

    /// Contradicting poses fail a fit that is not clearly good all the same.
    fn judge_poses(&mut self, steps: u32, held_out: Option<Held>, context: &Context) {
        let Some(poses) = &self.poses else { return };
        if poses.is_contradiction() && self.failure.is_none() && steps >= SHORTEST_RUN {
            // Training photos can be learned by heart from any pose; photos nobody fitted cannot.
            let acquitted = match (held_out, self.held_out_baseline) {
                (Some(held), Some(baseline)) => held.psnr >= baseline.blurred + CLEARLY_GOOD_DB,
                _ => false,
            };
            let text = contradiction(poses);
            match acquitted {
                true => context.warn(text),
                false => self.failure = Some(text),
            }
        } else if !poses.is_contradiction() && !poses.contradicting.is_empty() {
            let named = poses.contradicting.iter().take(5).cloned().collect::<Vec<_>>().join(", ");
            context.warn(format!(
                "the poses of {} of the {} photos looked at contradict their matches with others: \
                 {named}; leave these out or find their poses again",
                poses.contradicting.len(),
                poses.photos
            ));
        }
    }

    fn likely_cause(&self, failure: Failure) -> String {
        if let Some(poses) = self.poses.as_ref().filter(|poses| poses.is_contradiction()) {
            return format!("likely cause: {}", contradiction(poses));
        }
        match failure {
            Failure::BlankPhotos => {
                "likely cause: blank photos; no shape can be found in them".into()
            }
            _ => match self.poses.as_ref().and_then(PoseCheck::agreement) {
                Some(share) => format!(
                    "the poses are not the cause ({:.0} % of the matches agree with them); likely \
                     causes: too few photos, a subject that moves, or too short a run",
                    100.0 * share
                ),
                None => "likely causes: photos with nothing to match (blank, blurred or \
                         featureless), poses in another convention, or too few photos"
                    .into(),
            },
        }
    }
}

/// What pictures without shape reach on a few of the photos.
fn baseline(photos: &[TrainingImage], background: [f32; 3], start: &Start) -> Option<Baseline> {
    // A run that must end on time has none left for more.
    let most = if start.end.is_some() { LOOKED_AT_IN_TIME } else { LOOKED_AT };
    let take = photos.len().min(most);
    let of = |i: usize| {
        let photo = &photos[i * photos.len() / take];
        let (w, h) = (photo.camera.width, photo.camera.height);
        Baseline::of(&Target::new(photo, w, h, start.options.alpha_mode), background)
    };
    let all: Vec<Baseline> = (0..take).into_par_iter().with_max_len(1).map(of).collect();
    (take > 0).then(|| Baseline::mean(&all))
}
