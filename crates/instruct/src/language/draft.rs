//! The plan while it is made.

use std::collections::{BTreeMap, BTreeSet};

use edit::ops::{OpDocument, SelectOp, SetEnvironmentOp};
use glam::DVec3;
use motes_formats::scene_card::{ObjectDocument, SceneCardDocument};
use motes_formats::selectors::{SelectStep, Selector, SelectorStep};
use motes_scene::Combine;

use super::error::{Misread, shown};

/// A light of the instruction: several are alternatives, a plan each.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NamedLight {
    pub(crate) name: String,
    pub(crate) op: SetEnvironmentOp,
}

/// The plan while it is made.
pub(crate) struct Draft<'c> {
    pub(crate) card: &'c SceneCardDocument,
    pub(crate) ops: Vec<OpDocument>,
    pub(crate) lights: Vec<NamedLight>,
    pub(crate) notes: Vec<String>,
    /// Whether shadows on a plain splat go with their objects.
    pub(crate) shadows: bool,
    selected: BTreeSet<String>,
    gone: BTreeSet<String>,
    /// What was said of an object: kind of change, and which.
    said: BTreeMap<(String, &'static str), String>,
}

impl<'c> Draft<'c> {
    pub(crate) fn new(card: &'c SceneCardDocument) -> Self {
        Self {
            card,
            ops: Vec::new(),
            lights: Vec::new(),
            notes: Vec::new(),
            shadows: false,
            selected: BTreeSet::new(),
            gone: BTreeSet::new(),
            said: BTreeMap::new(),
        }
    }

    pub(crate) fn object(&self, index: usize) -> &'c ObjectDocument {
        &self.card.objects[index]
    }

    /// The name of the selection of an object, which is selected when it was not before.
    ///
    /// # Errors
    /// It was removed.
    pub(crate) fn target(&mut self, index: usize) -> Result<String, Misread> {
        let object = self.object(index);
        if self.gone.contains(&object.id) {
            let cause = format!("{} was removed before", shown(&object.id));
            return Err(Misread::new(cause, "leave out one of the two"));
        }
        if self.selected.insert(object.id.clone()) {
            let selector = Selector::File { path: object.selection.clone() };
            let step = SelectorStep { combine: Combine::Set, selector };
            let steps = vec![SelectStep::Select(step)];
            let id = Some(object.id.clone());
            self.ops.push(OpDocument::Select(SelectOp { id, from: None, steps }));
        }
        Ok(object.id.clone())
    }

    pub(crate) fn remove(&mut self, id: &str) {
        self.gone.insert(id.to_owned());
    }

    /// Notes that something was said of a target.
    ///
    /// # Errors
    /// The contrary was said before.
    pub(crate) fn says(&mut self, id: &str, kind: &'static str, what: &str) -> Result<(), Misread> {
        let before = self.said.insert((id.to_owned(), kind), what.to_owned());
        match before {
            Some(before) if before != what => Err(Misread::new(
                format!("{} cannot be both: {before} and {what}", shown(id)),
                "say one of the two",
            )),
            _ => Ok(()),
        }
    }

    pub(crate) fn note(&mut self, text: impl Into<String>) {
        self.notes.push(text.into());
    }

    pub(crate) fn right(&self) -> DVec3 {
        DVec3::from_array(self.card.frame.right)
    }

    pub(crate) fn front(&self) -> DVec3 {
        DVec3::from_array(self.card.frame.front)
    }

    pub(crate) fn up(&self) -> DVec3 {
        DVec3::from_array(self.card.frame.up)
    }
}

/// The wider horizontal side of an object, world units.
pub(crate) fn width_of(object: &ObjectDocument) -> f64 {
    object.size.width.max(object.size.depth)
}

/// Numbers of a plan are rounded: a person reads them, and nobody measures a scene to nine digits.
pub(crate) fn rounded(value: f64) -> f64 {
    let digits = 6 - value.abs().max(1e-6).log10().ceil() as i32;
    let factor = 10f64.powi(digits.clamp(0, 12));
    let rounded = (value * factor).round() / factor;
    // Never -0.
    if rounded == 0.0 { 0.0 } else { rounded }
}

pub(crate) fn rounded3(v: DVec3) -> [f64; 3] {
    v.to_array().map(rounded)
}
