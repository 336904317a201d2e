//! HTML pages and contact sheets of a lab run and of a relit scene, and tables of scores.
//!
//! - [`pages`]: contents in, one HTML document out.
//! - [`scores`]: scores of several runs in, one table out.
//! - [`files`]: the command lines, and the folders that the pages are made of.
//!
//! Invariants: a page is one file that needs no network; a value that is not finite never reaches
//! a page.

pub mod files;
pub mod pages;
pub mod scores;
