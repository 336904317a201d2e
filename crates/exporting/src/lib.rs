//! Exporting: splats and decomposed scenes as assets that other programs open.

pub mod html;
