//! The files around an instruction: a scene, labels and assets in; a card, plans and edited scenes out.

mod apply;
mod assets;
mod command;
mod inputs;
mod names;
mod products;
mod provider;
mod report;

pub use command::{Args, run};
