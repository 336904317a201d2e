//! Clicks, boxes and strokes to a selection that has no place in the plan yet.

use std::sync::Arc;

use glam::DVec3;
use motes_formats::selectors::{
    BoxPrompt, Click, ObjectPrompt, Scribble, SelectStep, Selector, SelectorStep,
};
use motes_scene::{Combine, Selection};
use segment_select::{SceneIndex, select_from};
use serde::Deserialize;

use super::act::ActError;
use super::{Session, Views};

/// Largest difference of color between neighbors that a click without views goes on over, CIE L*a*b*.
const CONNECTED_TOLERANCE: f64 = 12.0;

/// Points of a stroke.
const MOST_POINTS: usize = 2000;

/// A selection in the making.
#[derive(Clone, Debug)]
pub struct Pending {
    /// How it is made, as a plan has it.
    pub steps: Vec<SelectStep>,
    /// What was found.
    pub found: Selection,
    /// Gestures that made it.
    pub gestures: usize,
    /// Seconds that the last answer took.
    pub seconds: f64,
}

/// What somebody did with the pointer.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Gesture {
    /// A click on the object, or beside it.
    Click {
        /// Where.
        #[serde(flatten)]
        at: Where,
        /// On it, or not on it.
        positive: bool,
    },
    /// A rectangle around it in a view, `x0, y0, x1, y1`.
    Box {
        /// Name of the view.
        view: String,
        /// Pixels.
        pixels: [f64; 4],
    },
    /// A stroke over it in a view, or beside it.
    Stroke {
        /// Name of the view.
        view: String,
        /// Corners, pixels.
        points: Vec<[f64; 2]>,
        /// On it, or not on it.
        positive: bool,
    },
}

/// A place that was pointed at.
#[derive(Clone, Debug, Deserialize)]
pub struct Where {
    /// The view that the page shows, when it shows one.
    pub view: Option<String>,
    /// Its pixel.
    pub pixel: Option<[f64; 2]>,
    /// The point in world.
    pub point: Option<[f64; 3]>,
    /// From where it was seen.
    pub eye: Option<[f64; 3]>,
}

impl Session<'_> {
    /// Answers a gesture, which refines the selection in the making.
    ///
    /// # Errors
    /// Nothing is there, or views cannot be prepared.
    pub fn prompt(&self, gesture: &Gesture) -> Result<(), ActError> {
        let _one = self.prompting.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let (state, geometry, before) = {
            let inner = self.lock();
            (Arc::clone(inner.history.state()), inner.geometry, inner.pending.clone())
        };
        let index = match self.scene.capture {
            Some(_) => Some(self.index_of(geometry)?),
            None => None,
        };
        let start = std::time::Instant::now();
        let gestures = before.as_ref().map_or(0, |pending| pending.gestures) + 1;
        let before = before.map(|pending| pending.steps).unwrap_or_default();
        let steps = self.steps(gesture, before, index.as_deref())?;
        let mut source = self.scene.source(&state.gaussians);
        if let Some(index) = index {
            source = source.with_index(index);
        }
        if let Some(segmenter) = self.segmenter {
            source = source.with_segmenter(segmenter);
        }
        let found = select_from(&source, Selection::none(state.len()), &steps)
            .map_err(|error| ActError::Unfit(error.to_string()))?;
        if found.count() == 0 {
            return Err(ActError::Unfit("nothing is selected there".into()));
        }
        let seconds = start.elapsed().as_secs_f64();
        // A plan has `edit` ask the graph cut: what another segmenter found is told by its rows.
        let (steps, found) = match self.segmenter {
            None => (steps, found),
            Some(_) => (steps, Selection::where_true(found.len(), |i| found.contains(i))),
        };
        let mut inner = self.lock();
        if inner.geometry != geometry {
            return Err(ActError::Conflict("the scene changed meanwhile: click again".into()));
        }
        inner.pending = Some(Pending { steps, found, gestures, seconds });
        inner.chosen = None;
        self.tell(&mut inner);
        Ok(())
    }

    /// Drops the selection in the making, and chooses none.
    pub fn clear(&self) {
        let mut inner = self.lock();
        (inner.pending, inner.chosen) = (None, None);
        self.tell(&mut inner);
    }

    /// The views of a geometry, when they are there.
    fn index_of(&self, geometry: u64) -> Result<Arc<SceneIndex>, ActError> {
        let mut inner = self.lock();
        loop {
            if inner.over || inner.geometry != geometry {
                return Err(ActError::Conflict("the scene changed meanwhile: click again".into()));
            }
            match &inner.views {
                Views { geometry: Some(own), index: Some(index), .. } if *own == geometry => {
                    return index.clone().map_err(ActError::Unfit);
                }
                _ => inner = self.wait(inner),
            }
        }
    }

    /// The steps with a gesture more.
    fn steps(
        &self,
        gesture: &Gesture,
        mut steps: Vec<SelectStep>,
        index: Option<&SceneIndex>,
    ) -> Result<Vec<SelectStep>, ActError> {
        let Some(index) = index else {
            steps.push(connected(gesture, steps.is_empty())?);
            return Ok(steps);
        };
        let mut prompt = match steps.pop() {
            Some(SelectStep::Select(SelectorStep {
                selector: Selector::Object(prompt), ..
            })) => prompt,
            _ => ObjectPrompt::default(),
        };
        match gesture.clone() {
            Gesture::Click { at, positive } => {
                let (view, pixel) = self.pixel(&at, index)?;
                prompt.clicks.push(Click { view, pixel, positive });
            }
            Gesture::Box { view, pixels: [x0, y0, x1, y1] } => {
                let pixels = [x0.min(x1), y0.min(y1), x0.max(x1), y0.max(y1)];
                prompt.boxes.push(BoxPrompt { view, pixels });
            }
            Gesture::Stroke { points, .. } if points.len() > MOST_POINTS => {
                let text = format!("a stroke has at most {MOST_POINTS} points");
                return Err(ActError::Unfit(text));
            }
            Gesture::Stroke { view, points, positive } => {
                prompt.scribbles.push(Scribble { view, points, positive });
            }
        }
        let selector = Selector::Object(prompt);
        Ok(vec![SelectStep::Select(SelectorStep { combine: Combine::Set, selector })])
    }

    /// The view and the pixel of it that a click is about: what the page says when that view is prepared, else the prepared
    /// view that sees the point best.
    fn pixel(&self, at: &Where, index: &SceneIndex) -> Result<(String, [f64; 2]), ActError> {
        let Some((capture, _)) = &self.scene.capture else {
            return Err(ActError::Unfit("clicks need views".into()));
        };
        if let (Some(view), Some(pixel)) = (&at.view, at.pixel) {
            let known = capture.view_named(view);
            if known.is_some_and(|v| index.capture_views.contains(&v)) || at.point.is_none() {
                return Ok((view.clone(), pixel));
            }
        }
        let (Some(point), Some(eye)) = (at.point, at.eye) else {
            return Err(ActError::Unfit("a click has a pixel of a view, or a point".into()));
        };
        let seen = index.seen_from(DVec3::from_array(point), DVec3::from_array(eye));
        let (view, [x, y]) =
            seen.ok_or_else(|| ActError::Unfit("no photo shows what is there".into()))?;
        let prepared = index.capture_views.iter().position(|&v| v == view).unwrap_or(0);
        let working = index.views[prepared].camera;
        let Some(full) = capture.cameras[capture.views[view].camera].as_pinhole() else {
            return Err(ActError::Unfit("this view has lens distortion".into()));
        };
        let scaled = |v: f64, from: usize, to: usize| (v * to as f64 / from as f64).floor();
        let pixel = [scaled(x, working.width, full.width), scaled(y, working.height, full.height)];
        Ok((capture.views[view].name.clone(), pixel))
    }
}

/// A click where no photo shows anything: what is connected to the point.
fn connected(gesture: &Gesture, first: bool) -> Result<SelectStep, ActError> {
    let Gesture::Click { at: Where { point: Some(seed), .. }, positive } = gesture else {
        let text = "without --capture there are no views: click on a point";
        return Err(ActError::Unfit(text.into()));
    };
    let combine = match (first, positive) {
        (true, _) => Combine::Set,
        (false, true) => Combine::Add,
        (false, false) => Combine::Subtract,
    };
    let tolerance = Some(CONNECTED_TOLERANCE);
    let selector = Selector::Connected { seed: *seed, distance: None, tolerance };
    Ok(SelectStep::Select(SelectorStep { combine, selector }))
}
