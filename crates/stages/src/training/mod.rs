//! The session around a fit: photos in, steps with progress and checkpoints, report out.

mod checkpoint;
mod photos;
mod report;
mod scores;
mod session;

pub use checkpoint::{Checkpoint, read_checkpoint, write_checkpoint};
pub use photos::{load_training_images, sha256_of};
pub use report::{HistoryRow, TrainReport};
pub use scores::{Held, Target};
pub use session::{Session, SessionEnd, default_checkpoint};
