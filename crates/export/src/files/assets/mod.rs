//! What `export` makes besides files of Gaussians: a page, a mesh with its light, a shadow.

mod html;
mod mesh;
mod options;
mod photos;
mod report;
mod shadow;

pub use options::{Asset, AssetOptions};
pub use photos::photo;
pub use report::AssetReport;

use motes_formats::standard_stream::is_standard_stream;
use std::path::{Path, PathBuf};

use motes_stage::{Context, StageError};

use super::InputOptions;
use relight::files::LoadedScene;

/// A request for an asset.
pub struct AssetJob<'a> {
    /// What to make.
    pub asset: Asset,
    /// Gaussians or a scene folder.
    pub input: &'a InputOptions,
    /// Cameras and photos.
    pub capture: Option<&'a Path>,
    /// The parameters.
    pub options: &'a AssetOptions,
    /// Of the random numbers.
    pub seed: u64,
}

/// Makes an asset at `output`, an output that was claimed already.
///
/// # Errors
/// When an input is missing or unfit, or a file cannot be written.
pub fn write_asset(
    job: &AssetJob<'_>,
    output: &Path,
    context: &Context,
) -> anyhow::Result<AssetReport> {
    match job.asset {
        Asset::Html => html::write(job, output, context),
        Asset::Mesh => mesh::write(job, output, context),
        Asset::ShadowPlane => shadow::write(job, output, context),
    }
}

impl AssetJob<'_> {
    /// The scene folder that a mesh and a shadow need.
    fn scene(&self, context: &Context) -> anyhow::Result<LoadedScene> {
        let Some(folder) = &self.input.scene else {
            let text = "Gaussians alone have no surface and no material";
            return Err(StageError::usage(text)
                .help("run decompose and give its folder as --scene, or export a splat")
                .into());
        };
        LoadedScene::load(folder, context)
    }
}

/// `output` with another ending, claimed as an output too.
fn beside(output: &Path, suffix: &str, context: &Context) -> anyhow::Result<PathBuf> {
    if is_standard_stream(output) {
        let text = format!("the file {suffix} beside the product needs a name");
        return Err(StageError::usage(text).help("give --output a file").into());
    }
    context.output(output.with_extension(suffix))
}
