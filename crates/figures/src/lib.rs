//! Pictures for people: values in, bytes or text out.
//!
//! - [`canvas`], [`colormap`], [`contact_sheet`], [`error_map`]: raster pictures with text.
//! - [`svg_plot`]: line plots.
//! - [`html`]: pages of one file that need no network.

pub mod canvas;
pub mod colormap;
pub mod contact_sheet;
pub mod error_map;
pub mod html;
pub mod svg_plot;
