//! The workers: light that follows, and views for the next click.

use std::sync::Arc;
use std::time::Instant;

use edit::EditState;
use edit::reshade::{ReshadeOptions, settle};
use segment_select::SceneIndex;

use super::Session;
use super::shown::{Quality, Shown};

/// Directions toward the light of a preview.
const PREVIEW_SAMPLES: u32 = 8;
/// Directions that newly shaded Gaussians of a preview are seen from.
const PREVIEW_DIRECTIONS: u32 = 12;

/// Views that are to be prepared.
struct Wanted {
    state: Arc<EditState>,
    geometry: u64,
    /// Whether they are those before the first act.
    at_start: bool,
    /// When they were prepared before.
    known: Option<Arc<SceneIndex>>,
}

impl Session<'_> {
    /// Lets light follow, preview first, until the session ends.
    pub fn follow_light(&self) {
        while let Some((state, revision, quality)) = self.next_light() {
            let start = Instant::now();
            let lit = self.lit(&state, quality);
            let (lit, warnings) = match lit {
                Ok(done) => done,
                Err(why) => {
                    let mut inner = self.lock();
                    inner.failed = Some(revision);
                    inner.notice = Some(format!("the light cannot follow: {why}"));
                    self.tell(&mut inner);
                    continue;
                }
            };
            let mut shown = Shown::new(&state, &lit, quality, revision, 0);
            (shown.warnings, shown.seconds) = (warnings, start.elapsed().as_secs_f64());
            let mut inner = self.lock();
            // Nobody waits for the last word about what was changed meanwhile.
            if quality == Quality::Preview || inner.revision == revision {
                shown.id = inner.shown.id + 1;
                inner.shown = Arc::new(shown);
                self.tell(&mut inner);
            }
        }
    }

    /// What is to be lit next; `None` at the end.
    fn next_light(&self) -> Option<(Arc<EditState>, u64, Quality)> {
        let mut inner = self.lock();
        loop {
            if inner.over {
                return None;
            }
            let (revision, shown) = (inner.revision, &inner.shown);
            let old = shown.revision != revision;
            if (old || shown.quality != Quality::Standard) && inner.failed != Some(revision) {
                let state = Arc::clone(inner.history.state());
                let follows = state.parts.is_some() && !state.change().is_empty();
                let quality = if old && follows { Quality::Preview } else { Quality::Standard };
                return Some((state, revision, quality));
            }
            inner = self.wait(inner);
        }
    }

    fn lit(&self, state: &EditState, quality: Quality) -> Result<(EditState, Vec<String>), String> {
        let seed = self.scene.template.seed;
        let usual = ReshadeOptions { seed, ..Default::default() };
        let samples = self.scene.template.reshade_samples.unwrap_or(usual.samples);
        let options = match quality {
            Quality::Standard => ReshadeOptions { samples, ..usual },
            Quality::Preview => ReshadeOptions {
                samples: PREVIEW_SAMPLES.min(samples),
                bake_directions: PREVIEW_DIRECTIONS,
                quality: relight::Quality::Preview,
                ..usual
            },
        };
        let mut lit = state.clone();
        let settled = settle(&mut lit, &options).map_err(|error| error.to_string())?;
        let mut warnings = settled.report.as_ref().map_or(Vec::new(), |r| r.warnings.clone());
        warnings.extend(settled.report.into_iter().flat_map(|report| report.unfilled));
        Ok((lit, warnings))
    }

    /// Prepares the views that clicks are answered on, until the session ends.
    pub fn prepare_views(&self) {
        if self.scene.capture.is_none() {
            return;
        }
        while let Some(Wanted { state, geometry, at_start, known }) = self.next_views() {
            let start = Instant::now();
            let index = match known {
                Some(known) => Ok(known),
                None => self.index(&state, geometry),
            };
            let seconds = start.elapsed().as_secs_f64();
            let mut inner = self.lock();
            // Other Gaussians may have been read meanwhile.
            if let (true, Ok(index)) = (at_start && inner.geometry == geometry, &index) {
                inner.views.start = Some(Arc::clone(index));
            }
            let views = &mut inner.views;
            (views.geometry, views.index, views.seconds) = (Some(geometry), Some(index), seconds);
            self.tell(&mut inner);
        }
    }

    fn index(&self, state: &EditState, geometry: u64) -> Result<Arc<SceneIndex>, String> {
        let mut source = self.scene.source(&state.gaussians);
        // What was read is on disk under its hash; what was made of it is not.
        if let Some(cache) = self.scene.cache.as_ref().filter(|_| geometry == 0) {
            source = source.bound_to(self.scene.bound.clone()).with_cache(cache);
        }
        source.shared_index().map(Arc::clone).map_err(|error| error.to_string())
    }

    fn next_views(&self) -> Option<Wanted> {
        let mut inner = self.lock();
        loop {
            if inner.over {
                return None;
            }
            // Whoever changed something waits for its preview, not for the next click.
            let drawn =
                inner.shown.revision == inner.revision || inner.failed == Some(inner.revision);
            if drawn && inner.views.geometry != Some(inner.geometry) {
                let (history, geometry) = (&inner.history, inner.geometry);
                let (state, at_start) = (Arc::clone(history.state()), history.is_at_start());
                let known = inner.views.start.clone().filter(|_| at_start);
                return Some(Wanted { state, geometry, at_start, known });
            }
            inner = self.wait(inner);
        }
    }
}
