//! Learned models in programs of their own, behind one protocol.
//!
//! [`Provider`] finds and starts the program that a command line names, asks it, checks what it answers and keeps the answers.
//! [`serve`] is the other side, for providers in Rust. [`conformance`] tells whether a program keeps the protocol, which
//! `docs/formats/provider.md` describes.

mod answers;
mod asked;
mod checks;
mod client;
mod command;
pub mod conformance;
mod error;
mod flags;
mod process;
pub mod serve;
mod server;

pub use asked::{Answered, Asked};
pub use checks::read_logits;
pub use client::{Provider, ProviderUse};
pub use command::{ProviderCommand, split_words, stage_program};
pub use error::ProviderError;
pub use flags::{ProviderFlags, user_cache};
pub use process::{POLL, end_group};
