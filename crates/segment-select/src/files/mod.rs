//! The files around a selection: Gaussians, views and prompts in; a selection, overlays and labels out.

mod cached_view;
mod command;
mod flags;
mod inputs;
mod pictures;
mod products;
mod report;
mod segmenter;
mod view_cache;

pub use command::{Args, run};
pub use flags::PromptFlags;
pub use inputs::Inputs;
pub use products::{Answer, ExtraProducts, Outputs, answer, write_products};
pub use report::{SegmenterReport, SelectReport};
pub use segmenter::{ByProvider, Segmenter, SegmenterFlags};
pub use view_cache::usual_folder;
