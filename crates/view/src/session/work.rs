//! The workers: light that follows, and views for the next click.

use std::sync::Arc;
use std::time::Instant;

use edit::EditState;
use edit::reshade::{ReshadeOptions, settle};

use super::shown::{Quality, Shown};
use super::{Session, Views};

/// Directions toward the light of a preview.
const PREVIEW_SAMPLES: u32 = 8;
/// Directions that newly shaded Gaussians of a preview are seen from.
const PREVIEW_DIRECTIONS: u32 = 12;

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
        let seed = self.scene.seed;
        let options = match quality {
            Quality::Standard => ReshadeOptions { seed, ..Default::default() },
            Quality::Preview => ReshadeOptions {
                samples: PREVIEW_SAMPLES,
                bake_directions: PREVIEW_DIRECTIONS,
                quality: relight::Quality::Preview,
                seed,
                ..Default::default()
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
        while let Some((state, geometry)) = self.next_views() {
            let start = Instant::now();
            let source = self.scene.source(&state.gaussians);
            let index = source.shared_index().map(Arc::clone).map_err(|error| error.to_string());
            let seconds = start.elapsed().as_secs_f64();
            let mut inner = self.lock();
            inner.views = Views { geometry: Some(geometry), index: Some(index), seconds };
            self.tell(&mut inner);
        }
    }

    fn next_views(&self) -> Option<(Arc<EditState>, u64)> {
        let mut inner = self.lock();
        loop {
            if inner.over {
                return None;
            }
            // Whoever changed something waits for its preview, not for the next click.
            let drawn =
                inner.shown.revision == inner.revision || inner.failed == Some(inner.revision);
            if drawn && inner.views.geometry != Some(inner.geometry) {
                return Some((Arc::clone(inner.history.state()), inner.geometry));
            }
            inner = self.wait(inner);
        }
    }
}
