//! The session around a fit: photos in, steps with progress and checkpoints, report out.

mod checkpoint;
mod photos;
mod report;
mod scores;
mod session;
mod start;

pub use report::{HistoryRow, TrainReport};
pub use scores::{Held, Target};
pub use session::{Session, SessionEnd, default_checkpoint};
pub use start::{Start, StartRequest};
