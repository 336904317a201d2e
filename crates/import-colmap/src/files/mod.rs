//! Command line of `import-colmap`.

mod command;

pub use command::{Args, run};
