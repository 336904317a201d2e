//! Instructions: sentences to checked edit plans.
//!
//! - [`card`] says what is in a scene: objects with names, where they are, what they look like, the light.
//! - [`language`] is the interpreter: a grammar over the operations of `edit`, against a card. It never guesses silently: what it does not
//!   understand is an error, what it had to assume is a note.
//! - [`explain`] prints an operation as a sentence.
//! - [`chat`] asks a language model instead, and checks its answer.

pub mod card;
pub mod chat;
pub mod explain;
pub mod files;
pub mod language;
