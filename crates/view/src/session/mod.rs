//! What everybody who has the page open works on: a scene, the plan so far, and the selection that is being made.
//!
//! [`Session`] is the lock around it. Acts change the plan at once; two workers follow: one makes the light follow (a preview
//! with few samples, then what `edit` computes), one prepares the views for the next click. Nothing is computed under the
//! lock that takes longer than copying the Gaussians.

mod act;
mod history;
mod light;
mod mask;
mod prompt;
mod scene;
mod shown;
mod work;

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use edit::EditState;
use segment_select::{MaskProvider, SceneIndex};

pub use act::{Act, ActError};
pub use history::History;
pub use light::LightWish;
pub use mask::bits;
pub use prompt::{Gesture, Pending, Where};
pub use scene::{OfferedMap, OwnLight, Scene};
pub use shown::{Quality, Shown};

/// The views that clicks are answered on.
#[derive(Clone, Default)]
pub(crate) struct Views {
    /// Of which geometry.
    pub(crate) geometry: Option<u64>,
    /// Those of the Gaussians before the first act.
    pub(crate) start: Option<Arc<SceneIndex>>,
    /// Prepared views, or why there are none.
    pub(crate) index: Option<Result<Arc<SceneIndex>, String>>,
    /// Seconds that it took.
    pub(crate) seconds: f64,
}

/// What the lock guards.
pub(crate) struct Inner {
    pub(crate) history: History,
    /// Grows with every change that anybody may want to know of.
    pub(crate) serial: u64,
    /// Of what is drawn: grows with every act but selections.
    pub(crate) revision: u64,
    /// Of what clicks see: grows with every act but selections and light.
    pub(crate) geometry: u64,
    pub(crate) views: Views,
    pub(crate) pending: Option<Pending>,
    /// The selection that acts are about when none is pending: its name, empty for the last one without.
    pub(crate) chosen: Option<String>,
    pub(crate) original: Arc<Shown>,
    pub(crate) shown: Arc<Shown>,
    /// Words of the command line that makes the same edit.
    pub(crate) command: Vec<String>,
    /// The revision that light cannot follow.
    pub(crate) failed: Option<u64>,
    /// The last thing that went wrong behind the scenes.
    pub(crate) notice: Option<String>,
    pub(crate) over: bool,
}

/// A scene that is being looked at and edited.
pub struct Session<'s> {
    /// What does not change.
    pub scene: Scene,
    segmenter: Option<&'s dyn MaskProvider>,
    inner: Mutex<Inner>,
    changed: Condvar,
    /// One prompt is answered at a time.
    prompting: Mutex<()>,
}

impl<'s> Session<'s> {
    /// Starts on a scene, which `command` edits by a plan; `segmenter` answers clicks when it is not the graph cut.
    pub fn new(
        scene: Scene,
        state: EditState,
        command: Vec<String>,
        segmenter: Option<&'s dyn MaskProvider>,
    ) -> Self {
        let original = Arc::new(Shown::new(&state, &state, Quality::Standard, 0, 0));
        let inner = Inner {
            history: History::new(state, scene.template.clone()),
            serial: 0,
            revision: 0,
            geometry: 0,
            views: Views::default(),
            pending: None,
            chosen: None,
            shown: Arc::clone(&original),
            original,
            command,
            failed: None,
            notice: None,
            over: false,
        };
        let (inner, changed) = (Mutex::new(inner), Condvar::new());
        Self { scene, segmenter, inner, changed, prompting: Mutex::new(()) }
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Says that something changed.
    pub(crate) fn tell(&self, inner: &mut Inner) {
        inner.serial += 1;
        self.changed.notify_all();
    }

    /// Waits for a change.
    pub(crate) fn wait<'g>(&self, guard: MutexGuard<'g, Inner>) -> MutexGuard<'g, Inner> {
        self.changed.wait(guard).unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until the serial number is above `after`, at most `patience`.
    pub fn wait_for_news(&self, after: u64, patience: Duration) {
        let until = Instant::now() + patience;
        let mut inner = self.lock();
        while inner.serial <= after && !inner.over {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            let (guard, _) =
                self.changed.wait_timeout(inner, left).unwrap_or_else(PoisonError::into_inner);
            inner = guard;
        }
    }

    /// What is drawn now, and what was drawn at the start.
    pub fn drawn(&self) -> [Arc<Shown>; 2] {
        let inner = self.lock();
        [Arc::clone(&inner.shown), Arc::clone(&inner.original)]
    }

    /// The plan so far.
    pub fn plan(&self) -> edit::plan::EditPlanDocument {
        self.lock().history.plan()
    }

    /// Grows with every change.
    pub fn serial(&self) -> u64 {
        self.lock().serial
    }

    /// Acts in the plan.
    pub fn acts(&self) -> usize {
        self.lock().history.steps().len()
    }

    /// Whether nothing was done yet that another file would make meaningless.
    pub fn is_pristine(&self) -> bool {
        self.lock().history.is_empty()
    }

    /// Starts over with other Gaussians, as a file that was written anew has them. `false` when somebody acted meanwhile.
    pub fn replace(&self, state: EditState, command: Vec<String>) -> bool {
        // Packing takes its time, and nobody shall wait for it.
        let mut shown = Shown::new(&state, &state, Quality::Standard, 0, 0);
        let mut inner = self.lock();
        if !inner.history.is_empty() {
            return false;
        }
        inner.command = command;
        shown.id = inner.shown.id + 1;
        (inner.revision, inner.geometry) = (inner.revision + 1, inner.geometry + 1);
        shown.revision = inner.revision;
        inner.shown = Arc::new(shown);
        inner.original = Arc::clone(&inner.shown);
        inner.views = Views::default();
        inner.history = History::new(state, self.scene.template.clone());
        (inner.pending, inner.chosen, inner.notice) = (None, None, None);
        self.tell(&mut inner);
        true
    }

    /// Says what went wrong behind the scenes, once.
    pub fn notice(&self, text: String) {
        let mut inner = self.lock();
        if inner.notice.replace(text.clone()) == Some(text) {
            return;
        }
        self.tell(&mut inner);
    }

    /// Ends the workers and everybody who waits.
    pub fn end(&self) {
        let mut inner = self.lock();
        inner.over = true;
        self.tell(&mut inner);
    }
}
