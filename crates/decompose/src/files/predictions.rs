//! Normals and base colors predicted by a learned model in a program of its own.

use std::path::Path;

use anyhow::anyhow;
use clap::ValueEnum;
use glam::Vec3;
use motes_formats::atomic::ScratchFolder;
use motes_formats::exr_aov::open_exr;
use motes_formats::images::write_png;
use motes_formats::provider::{
    PredictResult, PredictTask, PredictedMap, ProviderKind, ProviderRequest, Quantity, Task,
    TaskResult,
};
use motes_math::srgb;
use motes_protocol::{ProviderCommand, ProviderFlags, ProviderUse};
use motes_scene::ImageF32;
use motes_stage::Context;
use serde::{Deserialize, Serialize};

use super::priors::Priors;
use crate::Photo;

/// Confidence below which a pixel of a map predicts nothing.
const LEAST_CONFIDENCE: f32 = 0.5;

/// What a provider predicts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Predicted {
    /// Normals
    Normal,
    /// Base colors
    BaseColor,
}

impl Predicted {
    fn quantity(self) -> Quantity {
        match self {
            Self::Normal => Quantity::Normal,
            Self::BaseColor => Quantity::BaseColor,
        }
    }
}

/// Asks the provider for maps of every photo.
///
/// # Errors
/// It cannot be started, fails, or answers what nobody asked for; the user asked to stop.
pub(super) fn predict(
    command: ProviderCommand,
    flags: &ProviderFlags,
    wanted: &[Predicted],
    photos: &[Photo],
    context: &Context,
) -> anyhow::Result<(Priors, ProviderUse)> {
    let mut provider = flags.open(command, ProviderKind::Predict, context)?;
    let progress = context.progress("predicting", photos.len() as u64);
    let mut priors = Priors { base_color: Vec::new(), normals: Vec::new() };
    for (done, photo) in photos.iter().enumerate() {
        context.check_interrupted()?;
        let scratch = ScratchFolder::new()?;
        let folder = scratch.path();
        let mut picture = photo.radiance_linear.image();
        picture.data.iter_mut().for_each(|v| *v = srgb::encode(*v));
        write_png(&folder.join("photo.png"), &picture.to_u8())?;
        let quantities = wanted.iter().map(|what| what.quantity()).collect();
        let task = PredictTask { pictures: vec!["photo.png".into()], quantities };
        let request = ProviderRequest::new(Task::Predict(task), 0);
        let reply = provider.ask(folder, &request, &|| context.interrupted())?;
        reply.warnings.iter().for_each(|warning| context.warn(warning.clone()));
        let TaskResult::Predict(PredictResult { maps }) = reply.result else {
            anyhow::bail!("the provider answered another kind");
        };
        let of = |quantity| maps.iter().find(|map| map.quantity == quantity);
        let base = of(Quantity::BaseColor).map(|map| read(folder, map, ["R", "G", "B"], -1.0));
        priors.base_color.push(base.transpose()?);
        let normals = of(Quantity::Normal).map(|map| read(folder, map, ["X", "Y", "Z"], 0.0));
        priors.normals.push(normals.transpose()?.map(|map| to_world(map, photo)));
        progress.set(done as u64 + 1);
    }
    Ok((priors, provider.used().clone()))
}

/// Three channels of a map, `[h, w, 3]`; `nothing` where it is not sure.
fn read(
    folder: &Path,
    map: &PredictedMap,
    names: [&str; 3],
    nothing: f32,
) -> anyhow::Result<ImageF32> {
    let file = open_exr(&folder.join(&map.map))?;
    let plane = |name: &str| {
        let channel = file.channel(name).ok_or_else(|| anyhow!("{} has no {name}", map.map))?;
        Ok::<_, anyhow::Error>(channel.to_f32())
    };
    let planes = [plane(names[0])?, plane(names[1])?, plane(names[2])?];
    let sure = match &map.confidence {
        Some(name) => open_exr(&folder.join(name))?.channel("Y").map(|channel| channel.to_f32()),
        None => None,
    };
    let is_sure = |i: usize| sure.as_ref().is_none_or(|sure| sure[i] >= LEAST_CONFIDENCE);
    let pixels = 0..file.width * file.height;
    let data = pixels.flat_map(|i| match is_sure(i) {
        true => [0, 1, 2].map(|c| planes[c][i]),
        false => [nothing; 3],
    });
    Ok(ImageF32::from_data(file.width, file.height, 3, data.collect()))
}

/// From the camera (x right, y down, z forward) to the world.
fn to_world(mut map: ImageF32, photo: &Photo) -> ImageF32 {
    let world_from_camera = photo.camera_from_world.inverse().rotation_matrix().as_mat3();
    for pixel in map.data.chunks_exact_mut(3) {
        let n = world_from_camera * Vec3::from_slice(pixel);
        pixel.copy_from_slice(&n.to_array());
    }
    map
}
