//! The files around an edit: a splat or a scene folder in, the same kind out, a plan from a file or from flags.

mod answer;
mod command;
mod flags;
mod input;
mod output;
mod outputs;
mod session;
mod source;

pub use answer::EditAnswer;
pub use command::{Args, plan_schema, run};
pub use flags::OpFlags;
pub use session::{EditJob, ReshadeFlags, run_edit};
