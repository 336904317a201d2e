//! What the stage `export` reads, makes and says. One module per kind of product.

mod assets;
mod batch;
mod cameras;
mod command;
mod format;
mod input;
mod report;
mod splat;
mod verify;

pub use assets::{Asset, AssetJob, AssetOptions, AssetReport, photo, write_asset};
pub use batch::BatchReport;
pub use cameras::{CameraFormat, CameraOptions, CameraSource};
pub use command::{Args, run};
pub use format::ExportFormat;
pub use input::{InputOptions, Source};
pub use report::{CameraReport, ExportReport, Outcome};
pub use splat::{SplatOptions, write_splat};
pub use verify::{VerifyOptions, VerifyReport, verify};
