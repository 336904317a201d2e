//! What people do: keep a selection, change it, light it, take it back.

use std::fmt;

use edit::ops::{OpDocument, SelectOp};
use motes_formats::selectors::{SelectStep, Selector, SelectorStep};
use motes_scene::{Combine, Selection};

use super::history::Step;
use super::{Inner, Pending, Session};

/// Why an act was not done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ActError {
    /// It does not fit; a sentence.
    Unfit(String),
    /// Somebody else was faster; a sentence.
    Conflict(String),
}

impl fmt::Display for ActError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Unfit(text) | Self::Conflict(text)) = self;
        f.write_str(text)
    }
}

/// An act.
#[derive(Clone, Debug)]
pub struct Act {
    /// What is done to the selection, or to the light. Its `target` is set here.
    pub op: OpDocument,
    /// Whether it takes the place of the last act of the plan when that is of the same kind: while something is dragged.
    pub replace: bool,
}

impl Session<'_> {
    /// Does it. What is selected but not in the plan yet comes first.
    ///
    /// # Errors
    /// It does not fit.
    pub fn act(&self, act: Act) -> Result<(), ActError> {
        let Act { mut op, replace } = act;
        let mut inner = self.lock();
        let mut added: Vec<Step> = Vec::new();
        if let Some(target) = target_of(&mut op)? {
            match (&inner.pending, &inner.chosen) {
                (Some(pending), _) => added.push(self.kept(pending, None)),
                (None, Some(name)) => *target = self.named_target(&inner, name),
                (None, None) => {
                    return Err(ActError::Unfit("select something first".into()));
                }
            }
        }
        let last = inner.history.steps().last();
        let same = added.is_empty() && last.is_some_and(|last| is_same_kind(&last.op, &op));
        let instead = usize::from(replace && same);
        let light = matches!(op, OpDocument::SetEnvironment(_));
        let deletes = matches!(op, OpDocument::Delete(_));
        let selects = !added.is_empty();
        added.push(Step { op, found: None });
        inner.history.act(added, instead, &self.scene).map_err(ActError::Unfit)?;
        if selects {
            (inner.pending, inner.chosen) = (None, Some(String::new()));
        }
        if deletes {
            (inner.pending, inner.chosen) = (None, None);
        }
        inner.revision += 1;
        inner.geometry += u64::from(!light);
        self.tell(&mut inner);
        Ok(())
    }

    /// Does the operations of a plan that was saved before.
    ///
    /// # Errors
    /// One does not fit; nothing is done then.
    pub fn reopen(&self, ops: Vec<OpDocument>) -> Result<(), String> {
        let mut inner = self.lock();
        let changes = ops.iter().filter(|op| !matches!(op, OpDocument::Select(_)));
        let moves = changes.clone().any(|op| !matches!(op, OpDocument::SetEnvironment(_)));
        let changed = changes.count() > 0;
        let steps = ops.into_iter().map(|op| Step { op, found: None }).collect();
        inner.history.act(steps, 0, &self.scene)?;
        inner.revision += u64::from(changed);
        inner.geometry += u64::from(moves);
        self.tell(&mut inner);
        Ok(())
    }

    /// Puts the selection in the making into the plan, under a name.
    ///
    /// # Errors
    /// There is none, or the name is taken.
    pub fn keep(&self, name: &str) -> Result<(), ActError> {
        let mut inner = self.lock();
        let Some(pending) = inner.pending.clone() else {
            return Err(ActError::Unfit("select something first".into()));
        };
        let name = name.trim();
        let step = self.kept(&pending, Some(name).filter(|name| !name.is_empty()));
        inner.history.act(vec![step], 0, &self.scene).map_err(ActError::Unfit)?;
        (inner.pending, inner.chosen) = (None, Some(name.to_owned()));
        self.tell(&mut inner);
        Ok(())
    }

    /// Chooses a selection of the plan by its name.
    ///
    /// # Errors
    /// There is none of that name, or nothing of it is left.
    pub fn choose(&self, name: &str) -> Result<(), ActError> {
        let mut inner = self.lock();
        let found = inner.history.state().selections.get(name);
        let is_left = found.is_some_and(|found| found.count() > 0);
        if !is_left {
            return Err(ActError::Unfit(format!("nothing is left of \"{name}\"")));
        }
        (inner.pending, inner.chosen) = (None, Some(name.to_owned()));
        self.tell(&mut inner);
        Ok(())
    }

    /// Takes back the last act, or repeats the one that was taken back last.
    ///
    /// # Errors
    /// There is none.
    pub fn undo(&self, again: bool) -> Result<(), ActError> {
        let mut inner = self.lock();
        let done = match again {
            false => inner.history.undo(&self.scene),
            true => inner.history.redo(&self.scene),
        };
        let op = done.map_err(ActError::Unfit)?;
        inner.pending = None;
        let state = inner.history.state();
        let left = |name: &String| state.selections.get(name).is_some_and(|s| s.count() > 0);
        inner.chosen = state.current.clone().filter(left);
        if !matches!(op, OpDocument::Select(_)) {
            inner.revision += 1;
            inner.geometry += u64::from(!matches!(op, OpDocument::SetEnvironment(_)));
        }
        self.tell(&mut inner);
        Ok(())
    }

    /// A selection as an act of the plan.
    fn kept(&self, pending: &Pending, name: Option<&str>) -> Step {
        let steps = match self.segmenter {
            None => pending.steps.clone(),
            Some(_) => {
                let selector = Selector::Ids { ids: pending.found.rows() };
                vec![SelectStep::Select(SelectorStep { combine: Combine::Set, selector })]
            }
        };
        let op = SelectOp { id: name.map(str::to_owned), from: None, steps };
        Step { op: OpDocument::Select(op), found: Some(pending.found.clone()) }
    }

    /// The key `target` of a selection: none for the one made last.
    fn named_target(&self, inner: &Inner, name: &str) -> Option<String> {
        let current = inner.history.state().current.as_deref() == Some(name);
        (!current).then(|| name.to_owned())
    }
}

impl Inner {
    /// The selection that acts are about, and its name where it has one.
    pub(crate) fn selection(&self) -> Option<(&Selection, Option<&str>)> {
        match (&self.pending, &self.chosen) {
            (Some(pending), _) => Some((&pending.found, None)),
            (None, Some(name)) => {
                let found = self.history.state().selections.get(name)?;
                let name = Some(name.as_str()).filter(|name| !name.is_empty());
                (found.count() > 0).then_some((found, name))
            }
            (None, None) => None,
        }
    }
}

/// The key `target` of an act that a page may do; `None` for one about the light.
fn target_of(op: &mut OpDocument) -> Result<Option<&mut Option<String>>, ActError> {
    match op {
        OpDocument::Transform(op) => Ok(Some(&mut op.target)),
        OpDocument::Delete(op) => Ok(Some(&mut op.target)),
        OpDocument::Duplicate(op) => Ok(Some(&mut op.target)),
        OpDocument::SetMaterial(op) => Ok(Some(&mut op.target)),
        OpDocument::Recolor(op) => Ok(Some(&mut op.target)),
        OpDocument::SetEnvironment(_) => Ok(None),
        op => Err(ActError::Unfit(format!("a page does not \"{}\"", op.name()))),
    }
}

fn is_same_kind(last: &OpDocument, op: &OpDocument) -> bool {
    use OpDocument::{SetEnvironment, SetMaterial, Transform};
    match (last, op) {
        (SetEnvironment(_), SetEnvironment(_)) => true,
        (SetMaterial(a), SetMaterial(b)) => a.target == b.target,
        (Transform(a), Transform(b)) => a.target == b.target,
        _ => false,
    }
}
