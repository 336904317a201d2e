//! `shading/NNNN.exr`: radiance of every pixel of a photo as a linear function of its base color.

use std::path::{Path, PathBuf};

use crate::{Photo, PixelShading, State};
use anyhow::Context as _;
use glam::Vec3;
use motes_formats::FormatError;
use motes_formats::exr_aov::{AovChannel, AovImage, AovSamples, open_exr, write_exr};
use rayon::prelude::*;

const AXES: [&str; 3] = ["R", "G", "B"];
const SHARE: &str = "part.A";

fn file(folder: &Path, k: usize) -> PathBuf {
    folder.join(format!("{k:04}.exr"))
}

fn photos<'a>(state: &State<'a>) -> Vec<&'a Photo> {
    state.inputs.photos.iter().chain(state.inputs.held_out).collect()
}

pub(super) fn write(folder: &Path, state: &State<'_>, made_by: &str) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let all: Vec<(&Photo, &PixelShading)> = photos(state).into_iter().zip(&state.shading).collect();
    all.par_iter().enumerate().try_for_each(|(k, (photo, shading))| {
        let layer = |name: &str, of: &dyn Fn(usize) -> Vec3| {
            let count = shading.count();
            let channel = |c: usize| {
                let values = (0..count).map(|i| of(i)[c]).collect();
                AovChannel::float(format!("{name}.{}", AXES[c]), values)
            };
            [channel(0), channel(1), channel(2)]
        };
        let mut channels = Vec::with_capacity(10);
        channels.extend(layer("slope", &|i| shading.slope(i)));
        channels.extend(layer("offset", &|i| shading.offset(i)));
        channels.extend(layer("part", &|i| shading.uniform(i).1));
        let share = (0..shading.count()).map(|i| shading.uniform(i).0).collect();
        channels.push(AovChannel::float(SHARE, share));
        let attributes = [("motes made by", made_by), ("motes view", &photo.name)]
            .map(|(k, v)| (k.into(), v.into()));
        let (width, height) = (photo.camera.width, photo.camera.height);
        write_exr(&file(folder, k), width, height, &channels, &attributes)
    })?;
    Ok(())
}

pub(super) fn read(folder: &Path, state: &State<'_>) -> anyhow::Result<Vec<PixelShading>> {
    let photos = photos(state);
    if file(folder, photos.len()).exists() || !file(folder, photos.len() - 1).exists() {
        let cause =
            format!("it was made with other held-out photos, not {}", state.inputs.held_out.len());
        let remedy = "give --most-held-out as then, or use another --work";
        return Err(FormatError::invalid(folder, "", cause).with_remedy(remedy).into());
    }
    let all: Result<Vec<_>, FormatError> = photos
        .par_iter()
        .enumerate()
        .map(|(k, photo)| {
            let path = file(folder, k);
            let image = open_exr(&path)?;
            let (width, height) = (photo.camera.width, photo.camera.height);
            if (image.width, image.height) != (width, height) {
                let cause = format!(
                    "{}x{} pixels, but the photo \"{}\" has {width}x{height}",
                    image.width, image.height, photo.name
                );
                return Err(FormatError::invalid(&path, "", cause));
            }
            let triples = |name: &str| -> Result<Vec<Vec3>, FormatError> {
                let [r, g, b] = AXES.map(|axis| floats(&image, &path, &format!("{name}.{axis}")));
                let (r, g, b) = (r?, g?, b?);
                Ok((0..r.len()).map(|i| Vec3::new(r[i], g[i], b[i])).collect())
            };
            let share = floats(&image, &path, SHARE)?;
            let uniform: Vec<(f32, Vec3)> = share.iter().copied().zip(triples("part")?).collect();
            Ok(PixelShading::new(&triples("slope")?, &triples("offset")?, &uniform))
        })
        .collect();
    Ok(all?)
}

fn floats<'a>(image: &'a AovImage, path: &Path, name: &str) -> Result<&'a [f32], FormatError> {
    match image.channel(name).map(|channel| &channel.samples) {
        Some(AovSamples::F32(values)) => Ok(values),
        _ => Err(FormatError::invalid(path, name, "there is no such channel of 32-bit floats")),
    }
}
