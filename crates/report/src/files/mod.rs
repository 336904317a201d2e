//! Command lines of `report`, and the folders that its pages are made of.

pub mod lab;
mod lab_folders;
mod page_flags;
pub mod relight;
mod relit_scene;
pub mod table;
