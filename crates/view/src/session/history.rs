//! The plan so far, and the state that it leads to.
//!
//! The state is that of [`edit`] in the middle of a plan: light has not followed. Taking back applies the remaining acts to
//! the first state anew; selections are kept as they were found, so that no view is prepared again.

use std::sync::Arc;

use edit::EditState;
use edit::ops::OpDocument;
use edit::plan::{EditPlanDocument, Prepared, check_plan, run_plan};
use motes_scene::Selection;

use super::scene::{Scene, sentence};

/// An act of the plan.
#[derive(Clone, Debug)]
pub struct Step {
    /// As the plan has it.
    pub op: OpDocument,
    /// Of a selection: what it found.
    pub found: Option<Selection>,
}

/// Acts and what came of them.
pub struct History {
    base: Arc<EditState>,
    state: Arc<EditState>,
    steps: Vec<Step>,
    undone: Vec<Step>,
    /// The plan without operations: what holds for all of them.
    template: EditPlanDocument,
}

impl History {
    /// Before the first act of a plan, of which all but the operations is known.
    pub fn new(state: EditState, template: EditPlanDocument) -> Self {
        let base = Arc::new(state);
        Self { state: Arc::clone(&base), base, steps: Vec::new(), undone: Vec::new(), template }
    }

    /// After the last act, before light followed.
    pub fn state(&self) -> &Arc<EditState> {
        &self.state
    }

    /// Whether the state is the one before the first act.
    pub fn is_at_start(&self) -> bool {
        Arc::ptr_eq(&self.base, &self.state)
    }

    /// The acts.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// Whether there is nothing to take back.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Acts that can be repeated.
    pub fn undone(&self) -> usize {
        self.undone.len()
    }

    /// The plan of the acts.
    pub fn plan(&self) -> EditPlanDocument {
        plan_of(&self.template, &self.steps)
    }

    /// Adds acts, all or none; the last `instead` acts of the plan are replaced by them.
    ///
    /// # Errors
    /// A sentence that says why an act does not fit.
    pub fn act(&mut self, added: Vec<Step>, instead: usize, scene: &Scene) -> Result<(), String> {
        let kept = self.steps.len().saturating_sub(instead);
        let mut steps = self.steps[..kept].to_vec();
        let mut state = match instead {
            0 => (*self.state).clone(),
            _ => self.replayed(&mut steps, scene)?,
        };
        let first = steps.len();
        steps.extend(added);
        apply(&mut steps, first, &mut state, &self.template, scene)?;
        (self.steps, self.state) = (steps, Arc::new(state));
        self.undone.clear();
        Ok(())
    }

    /// Takes back the last act, which is returned.
    ///
    /// # Errors
    /// There is none.
    pub fn undo(&mut self, scene: &Scene) -> Result<OpDocument, String> {
        let Some((last, rest)) = self.steps.split_last() else {
            return Err("there is nothing to undo".into());
        };
        let (last, mut rest) = (last.clone(), rest.to_vec());
        self.state = match rest.is_empty() {
            true => Arc::clone(&self.base),
            false => Arc::new(self.replayed(&mut rest, scene)?),
        };
        self.steps = rest;
        let op = last.op.clone();
        self.undone.push(last);
        Ok(op)
    }

    /// Repeats the act that was taken back last, which is returned.
    ///
    /// # Errors
    /// There is none.
    pub fn redo(&mut self, scene: &Scene) -> Result<OpDocument, String> {
        let Some(step) = self.undone.pop() else { return Err("there is nothing to redo".into()) };
        let (rest, op) = (std::mem::take(&mut self.undone), step.op.clone());
        let done = self.act(vec![step], 0, scene);
        self.undone = rest;
        done.map(|()| op)
    }

    fn replayed(&self, steps: &mut [Step], scene: &Scene) -> Result<EditState, String> {
        let mut state = (*self.base).clone();
        apply(steps, 0, &mut state, &self.template, scene)?;
        Ok(state)
    }
}

fn plan_of(template: &EditPlanDocument, steps: &[Step]) -> EditPlanDocument {
    let ops = steps.iter().map(|step| step.op.clone()).collect();
    EditPlanDocument { ops, ..template.clone() }
}

/// Applies the steps from `first` on, as a plan of all of them does. Selections note what they found.
fn apply(
    steps: &mut [Step],
    first: usize,
    state: &mut EditState,
    template: &EditPlanDocument,
    scene: &Scene,
) -> Result<(), String> {
    let plan = plan_of(template, steps);
    check_plan(&plan, &scene.plan_name).map_err(|error| error.to_string())?;
    for (at, step) in steps.iter_mut().enumerate().skip(first) {
        if let (OpDocument::Select(op), Some(found)) = (&step.op, &step.found) {
            if found.count() == 0 {
                return Err("the selection is empty".into());
            }
            state.keep_selection(op.id.as_deref(), found.clone());
            continue;
        }
        let prepared = Prepared { effective: vec![at], undone: Vec::new() };
        let done = scene.with_resources(|all| run_plan(&plan, &prepared, state, all));
        let record = done.map_err(|error| sentence(&error))?.record;
        // What an act of a plan only notes, somebody at a page is told.
        if let Some(skipped) = record.skipped.first() {
            return Err(skipped.why.clone());
        }
        if matches!(step.op, OpDocument::Select(_)) {
            let current = state.current.as_ref();
            step.found = current.and_then(|name| state.selections.get(name)).cloned();
        }
    }
    Ok(())
}
