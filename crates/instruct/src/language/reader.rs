//! What is known while an instruction is read.

use motes_formats::scene_card::SceneCardDocument;

use super::cursor::Cursor;
use super::draft::Draft;
use super::error::Misread;
use super::reference::{Finder, Referent};
use super::tokens::Token;

/// What a clause does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verb {
    Relight,
    Move,
    Lift,
    Lower,
    Put,
    Rotate,
    Turn,
    Flip,
    Scale,
    Enlarge,
    Shrink,
    Double,
    Halve,
    Delete,
    /// "take ... away": the words behind the object say that it goes.
    Take,
    Keep,
    Copy,
    Swap,
    Insert,
    Paint,
    Make,
    Cover,
    Give,
    Change,
    Clean,
}

/// Reads an instruction.
pub(crate) struct Reader<'c, 't> {
    pub(crate) cursor: Cursor<'t>,
    pub(crate) finder: Finder<'c>,
    pub(crate) draft: Draft<'c>,
    /// What "it" is.
    pub(crate) last: Vec<usize>,
    /// What "it" was before.
    pub(crate) before_last: Vec<usize>,
    pub(crate) verb: Option<Verb>,
}

impl<'c, 't> Reader<'c, 't> {
    pub(crate) fn new(card: &'c SceneCardDocument, text: &'t str, tokens: &'t [Token]) -> Self {
        Self {
            cursor: Cursor::new(text, tokens),
            finder: Finder::new(card),
            draft: Draft::new(card),
            last: Vec::new(),
            before_last: Vec::new(),
            verb: None,
        }
    }

    /// The objects at the cursor; they become "it".
    pub(crate) fn objects(&mut self, what: &str, with_place: bool) -> Result<Vec<usize>, Misread> {
        let from = self.cursor.at;
        match self.finder.referents(&mut self.cursor, &self.last, with_place)? {
            Some(Referent::Objects(found)) => {
                self.before_last = std::mem::replace(&mut self.last, found.clone());
                Ok(found)
            }
            Some(Referent::Scene) => Err(Misread::new(
                format!(
                    "{} is the whole scene, and only objects can do that",
                    self.cursor.since(from)
                ),
                self.finder.help(),
            )),
            None => {
                let rest = self.cursor.rest();
                let cause = match self.cursor.word() {
                    Some(_) => format!("{rest} does not say {what}"),
                    None => format!("it is not said {what}"),
                };
                Err(Misread::new(cause, self.finder.help()))
            }
        }
    }

    pub(crate) fn begins_object(&self) -> bool {
        let mut ahead = self.cursor.clone();
        matches!(self.finder.referent(&mut ahead, &self.last, true), Ok(Some(_)) | Err(_))
    }
}
