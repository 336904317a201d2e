//! Cameras and poses of a capture or a camera path for other programs.

use std::path::{Path, PathBuf};

use clap::Args;
use motes_formats::camera_path::read_camera_path;
use motes_formats::capture::read_capture;
use motes_formats::colmap::Layout;
use motes_formats::posed::{PosedViews, write_colmap_model, write_gltf_cameras, write_transforms};
use motes_stage::{Context, StageError};
use serde::Serialize;

/// What cameras are written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraFormat {
    /// nerfstudio's `transforms.json`.
    Transforms,
    /// A folder with a COLMAP model.
    Colmap(Layout),
    /// Nodes of a glTF, a path also as an animation.
    Gltf,
}

/// The flags that choose cameras.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Cameras")]
pub struct CameraOptions {
    /// Capture whose cameras are written, or used by --verify; an HTML page shows its photos
    #[arg(long, value_name = "FILE")]
    pub capture: Option<PathBuf>,

    /// Camera path whose poses are written
    #[arg(long, value_name = "FILE", conflicts_with = "capture")]
    pub path: Option<PathBuf>,
}

/// Cameras to write.
pub struct CameraSource {
    views: PosedViews,
    /// Folder that names of pictures are relative to, and its file of points.
    folder: Option<PathBuf>,
    points: Option<&'static str>,
}

/// Name of the points beside a capture.
const POINTS: &str = "points.ply";

impl CameraOptions {
    /// Reads the capture or the path.
    ///
    /// # Errors
    /// When neither was given, or it cannot be read.
    pub fn load(&self, context: &Context) -> anyhow::Result<CameraSource> {
        if let Some(path) = &self.path {
            context.input("path", path)?;
            let path = read_camera_path(path)?;
            let views = PosedViews::of_path(&path.frames, path.fps);
            return Ok(CameraSource { views, folder: None, points: None });
        }
        let Some(file) = &self.capture else {
            return Err(StageError::usage("cameras are exported from --capture or --path").into());
        };
        context.input("capture", file)?;
        let capture = read_capture(file)?;
        let folder = file.parent().unwrap_or(Path::new("")).to_owned();
        let points = folder.join(POINTS).is_file().then_some(POINTS);
        if capture.world_origin != glam::DVec3::ZERO {
            context.warn(format!(
                "poses are in the world of the capture; its source's coordinates are those plus {}",
                capture.world_origin
            ));
        }
        let views = PosedViews::of_capture(&capture);
        Ok(CameraSource { views, folder: Some(folder), points })
    }
}

impl CameraSource {
    /// Number of poses.
    pub fn len(&self) -> usize {
        self.views.views.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.views.views.is_empty()
    }

    /// Writes them.
    ///
    /// # Errors
    /// When a file cannot be written or a camera has no place in the format.
    pub fn write(
        &self,
        format: CameraFormat,
        output: &Path,
        context: &Context,
    ) -> anyhow::Result<()> {
        match format {
            CameraFormat::Transforms => {
                let here = output.parent().unwrap_or(Path::new(""));
                let same = |folder: &PathBuf| {
                    folder.canonicalize().ok() == here.canonicalize().ok() || folder == here
                };
                if self.folder.as_ref().is_some_and(|folder| !same(folder)) {
                    context.warn(
                        "names of pictures are relative to the capture: move transforms.json beside it",
                    );
                }
                write_transforms(output, &self.views, self.points)?;
            }
            CameraFormat::Colmap(layout) => write_colmap_model(output, &self.views, layout)?,
            CameraFormat::Gltf => write_gltf_cameras(output, &self.views)?,
        }
        Ok(())
    }
}
