//! What a stage binary needs beside the libraries and its own page: the session around a fit, the
//! files around a decomposition, a relighting, a selection and an export.
//!
//! The binaries are in `src/bin`. Nothing here is shared between them (that belongs into a library
//! crate) and nothing here computes.

pub mod decomposing;
pub mod edit;
pub mod export;
pub mod relight;
pub mod rendering;
pub mod selecting;
pub mod training;
