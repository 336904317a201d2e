//! What files and folders are and hold: kind, sizes, bounds, columns, non-finite values, who made them.
//!
//! [`Description`] is what is said about one path, [`measure`] counts in arrays; recognizing and reading are `files`.

mod description;
pub mod files;
pub mod measure;

pub use description::{Bounds, Description, Kind};
