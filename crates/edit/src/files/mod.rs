//! The files around an edit: a splat or a scene folder in, the same kind out, a plan from a file or from flags.

mod answer;
mod asset;
mod command;
pub(crate) mod editor;
mod flags;
mod input;
mod output;
mod outputs;
mod photos;
mod plan_file;
mod prepare;
mod provider_editor;
mod resources;
mod session;
mod source;

pub use answer::EditAnswer;
pub use command::{Args, plan_schema, run};
pub use flags::OpFlags;
pub use input::Input;
pub use plan_file::read_edit_plan;
pub use prepare::{Reach, prepare};
pub use session::{EditJob, ReshadeFlags, run_edit};
