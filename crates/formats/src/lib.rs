//! Files and scene types: the on-disk contract of motes.
//!
//! Every layout is described in `docs/formats`. Readers trust nothing: a malformed file ends in
//! one [`FormatError`] that names the file, the place and the cause, and no number in a file
//! decides how much memory is taken. Writers go through [`atomic::write_atomic`], so a product is
//! whole or absent.

pub mod atomic;
pub mod budget;
pub mod camera_path;
pub mod capture;
pub mod colmap;
pub mod decomposition;
pub mod documents;
pub mod environment;
pub mod error;
pub mod event_file;
pub mod exr_aov;
pub mod finite;
pub mod images;
pub mod labels;
pub mod metrics;
pub mod named_weight;
pub mod ply;
pub mod posed;
pub mod provider;
pub mod run_record;
pub mod scene_card;
pub mod schemas;
pub mod selection;
pub mod selectors;
pub mod standard_stream;
pub mod statistics;
pub mod tensors;
pub mod train_report;
pub mod transforms;

pub use error::{FormatError, Result};
