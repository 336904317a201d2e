//! Weights of the user: where they lie, whether they are whole, and whether they are those of the network.
//!
//! Nothing is fetched. Every tensor of a file is accounted for before a network runs: one of another model, cut short, with tensors
//! missing or too many, or with values that are not finite is one error that says which.

mod compare;
mod file;
mod folder;
mod source;

pub use compare::{Shapes, compare};
pub use file::TensorFile;
pub use folder::{Part, part, read_json, scheduler};
pub use source::{Place, Source};

/// Where the weights come from and their license, by model.
pub(crate) const STABLE_DIFFUSION: &str = "weights come from stable-diffusion-v1-5/stable-diffusion-v1-5 of Hugging Face (license: CreativeML OpenRAIL-M); motes fetches none";
pub(crate) const IC_LIGHT: &str = "weights come from lllyasviel/ic-light of Hugging Face (license: CreativeML OpenRAIL-M); motes fetches none";
pub(crate) const AGAIN: &str = "get the file again, and compare its size";
