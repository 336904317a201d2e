//! What other tools predicted, one picture per photo.

use std::path::{Path, PathBuf};

use crate::Photo;
use clap::ValueEnum;
use glam::Vec3;
use motes_formats::FormatError;
use motes_formats::environment::read_environment;
use motes_formats::images::read_image;
use motes_math::srgb;
use motes_scene::ImageF32;
use motes_stage::StageError;
use serde::{Deserialize, Serialize};

/// Axes of predicted normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NormalFrame {
    /// The camera's, OpenGL: x right, y up, z toward the viewer; what most predictors write
    #[default]
    CameraGl,
    /// The camera's, OpenCV and COLMAP: x right, y down, z away from the viewer
    CameraCv,
    /// The capture's world
    World,
}

/// Predictions, per photo.
pub(super) struct Priors {
    /// Linear, `[h, w, 3]`.
    pub(super) base_color: Vec<Option<ImageF32>>,
    /// World, `[h, w, 3]`; shorter than 1/2 where nothing was predicted.
    pub(super) normals: Vec<Option<ImageF32>>,
}

impl Priors {
    /// Reads what is named like a photo.
    ///
    /// # Errors
    /// When a file cannot be read, has another size than its photo, or there is none at all.
    pub(super) fn load(
        folder: &Path,
        photos: &[Photo],
        frame: NormalFrame,
    ) -> anyhow::Result<Self> {
        let base_color: Vec<_> =
            photos.iter().map(|p| base_color(folder, p)).collect::<anyhow::Result<_>>()?;
        let normals: Vec<_> =
            photos.iter().map(|p| normals(folder, p, frame)).collect::<anyhow::Result<_>>()?;
        if base_color.iter().chain(&normals).all(Option::is_none) {
            let [albedo, normal] = ["albedo", "normal"].map(|what| name(&photos[0], what, "png"));
            let text = format!(
                "{}: no file is named like a photo, such as {albedo} or {normal}",
                folder.display()
            );
            return Err(StageError::usage(text).into());
        }
        Ok(Self { base_color, normals })
    }
}

fn name(photo: &Photo, what: &str, suffix: &str) -> String {
    let stem = Path::new(&photo.name).with_extension("");
    format!("{}_{what}.{suffix}", stem.to_string_lossy())
}

/// The picture `what` of a photo, EXR before PNG, and whether it is a PNG.
fn picture(folder: &Path, photo: &Photo, what: &str) -> anyhow::Result<Option<(ImageF32, bool)>> {
    let file = |suffix: &str| -> Option<PathBuf> {
        Some(folder.join(name(photo, what, suffix))).filter(|p| p.exists())
    };
    let (path, image, is_png) = if let Some(path) = file("exr") {
        let image = read_environment(&path)?;
        (path, image, false)
    } else if let Some(path) = file("png") {
        let image = read_image(&path)?.to_f32();
        (path, image, true)
    } else {
        return Ok(None);
    };
    let (w, h) = (photo.camera.width, photo.camera.height);
    if (image.width, image.height) != (w, h) || image.channels < 3 {
        let cause = format!(
            "the picture has {}x{} pixels of {} channels and its photo {w}x{h} of 3",
            image.width, image.height, image.channels
        );
        return Err(FormatError::invalid(&path, "", cause)
            .with_remedy("predict from the photos of the capture, at their size")
            .into());
    }
    Ok(Some((image, is_png)))
}

fn base_color(folder: &Path, photo: &Photo) -> anyhow::Result<Option<ImageF32>> {
    Ok(picture(folder, photo, "albedo")?.map(|(mut image, is_png)| {
        if is_png {
            image.data.iter_mut().for_each(|v| *v = srgb::decode(*v));
        }
        image
    }))
}

fn normals(folder: &Path, photo: &Photo, frame: NormalFrame) -> anyhow::Result<Option<ImageF32>> {
    let world_from_camera = photo.camera_from_world.inverse().rotation_matrix().as_mat3();
    let to_world = |n: Vec3| match frame {
        NormalFrame::CameraGl => world_from_camera * Vec3::new(n.x, -n.y, -n.z),
        NormalFrame::CameraCv => world_from_camera * n,
        NormalFrame::World => n,
    };
    Ok(picture(folder, photo, "normal")?.map(|(image, is_png)| {
        let data = image
            .data
            .chunks_exact(image.channels)
            .flat_map(|p| {
                let n = Vec3::from_slice(p);
                to_world(if is_png { 2.0 * n - 1.0 } else { n }).to_array()
            })
            .collect();
        ImageF32::from_data(image.width, image.height, 3, data)
    }))
}
