//! The Segment Anything models (Kirillov et al. 2023, Ravi et al. 2024) as a provider of masks.
//!
//! An encoder turns a picture into an embedding, once; a decoder turns the embedding and a prompt into masks, in a tenth of a
//! second. Both are ONNX files of the user, run by `rten` on the CPU. The inputs' names tell the exports apart ([`Convention`]).
//! What lies between a photo and the model is here: [`Frame`] (resizing, padding, where a pixel lands), the prompt, candidates
//! and their scores, and embeddings kept on disk.

mod answer;
pub mod command;
mod convention;
mod decode;
mod embeddings;
mod error;
mod frame;
mod masks;
mod model;
mod prompt;
mod weights;

pub use answer::Sam;
pub use convention::Convention;
pub use decode::{Candidate, Chosen};
pub use error::SamError;
pub use frame::Frame;
pub use masks::stability;
pub use model::Model;
pub use weights::Weights;
