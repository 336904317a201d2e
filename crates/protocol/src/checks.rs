//! Whether a reply is one to its request: files that are there, sizes that agree, values that are finite.

use std::path::Path;

use motes_formats::exr_aov::{AovImage, open_exr};
use motes_formats::images::{image_dimensions, read_image, read_mask};
use motes_formats::provider::{
    EnvironmentResult, InstructEditResult, NovelViewResult, PredictResult, PredictedMap,
    ProviderReply, ProviderRequest, Quantity, SegmentResult, Task, TaskResult,
};
use motes_scene::ImageF32;

/// How far from 1 the length of a normal may be.
const NORMAL_SLACK: f32 = 0.05;

/// The first thing that is wrong with a reply, as a sentence about "it". `pictures` is the folder of the request, `folder` that of
/// the reply.
pub(crate) fn check(
    pictures: &Path,
    folder: &Path,
    request: &ProviderRequest,
    reply: &ProviderReply,
) -> Result<(), String> {
    let document = folder.join("reply.json");
    for file in reply.files(&document).map_err(first_line)? {
        if !folder.join(&file).is_file() {
            return Err(format!("its reply names {}, which is not there", file.display()));
        }
    }
    let size = |name: &str| image_dimensions(&pictures.join(name)).map_err(first_line);
    match (&request.task, &reply.result) {
        (Task::Segment(task), TaskResult::Segment(result)) => {
            segment(folder, size(&task.picture)?, task.candidates, result)
        }
        (Task::Relight(task), TaskResult::Relight(result)) => {
            picture(folder, &result.picture, size(&task.picture)?)
        }
        (Task::InstructEdit(task), TaskResult::InstructEdit(result)) => {
            let InstructEditResult { pictures } = result;
            counted("pictures", pictures.len(), task.views.len())?;
            let mut pairs = task.views.iter().zip(pictures);
            pairs.try_for_each(|(view, name)| picture(folder, name, size(&view.original)?))
        }
        (Task::Predict(task), TaskResult::Predict(result)) => {
            let PredictResult { maps } = result;
            counted("maps", maps.len(), task.pictures.len() * task.quantities.len())?;
            for (i, name) in task.pictures.iter().enumerate() {
                for &quantity in &task.quantities {
                    let is_it = |m: &&PredictedMap| m.picture == i as u64 && m.quantity == quantity;
                    let map = maps.iter().find(is_it);
                    let map = map.ok_or(format!("it has no map {quantity:?} of picture {i}"))?;
                    predicted(folder, map, size(name)?)?;
                }
            }
            Ok(())
        }
        (Task::Environment(_), TaskResult::Environment(EnvironmentResult { environment })) => {
            let image = linear(folder, environment)?;
            let (width, height) = (image.width, image.height);
            if width != 2 * height {
                return Err(format!("its panorama has {width}x{height} pixels, not 2:1"));
            }
            within(environment, &image.data, 0.0, f32::MAX)
        }
        (Task::NovelView(task), TaskResult::NovelView(result)) => {
            let NovelViewResult { picture: name, confidence } = result;
            let size = size(&task.rendering)?;
            picture(folder, name, size)?;
            confidence.as_ref().map_or(Ok(()), |name| trusted(folder, name, size))
        }
        (Task::Chat(_), TaskResult::Chat(result)) => match result.content.is_null() {
            true => Err("its answer is null".into()),
            false => Ok(()),
        },
        (task, result) => {
            let (asked, found) = (task.kind().name(), result.kind().name());
            Err(format!("it was asked for {asked} and answers {found}"))
        }
    }
}

fn first_line(error: motes_formats::FormatError) -> String {
    error.to_string().lines().next().unwrap_or_default().to_owned()
}

fn counted(what: &str, found: usize, wanted: usize) -> Result<(), String> {
    match found == wanted {
        true => Ok(()),
        false => Err(format!("its reply has {found} {what} where {wanted} are due")),
    }
}

fn sized(name: &str, found: (usize, usize), wanted: (usize, usize)) -> Result<(), String> {
    if found == wanted {
        return Ok(());
    }
    let ((a, b), (c, d)) = (found, wanted);
    Err(format!("{name} has {a}x{b} pixels where the picture has {c}x{d}"))
}

/// Refuses NaN, too.
fn within(name: &str, values: &[f32], least: f32, most: f32) -> Result<(), String> {
    match values.iter().find(|v| !(**v >= least && **v <= most)) {
        None => Ok(()),
        Some(v) if !v.is_finite() => Err(format!("{name} has values that are not finite ({v})")),
        Some(v) => Err(format!("{name} has the value {v}, which is not from {least} to {most}")),
    }
}

fn segment(
    folder: &Path,
    size: (usize, usize),
    candidates: u8,
    result: &SegmentResult,
) -> Result<(), String> {
    if result.masks.len() > usize::from(candidates) {
        let found = result.masks.len();
        return Err(format!("its reply has {found} masks where {candidates} are due"));
    }
    if result.best >= result.masks.len() as u64 {
        return Err(format!(
            "its best mask is {}, the last is {}",
            result.best,
            result.masks.len() - 1
        ));
    }
    for mask in &result.masks {
        let image = read_mask(&folder.join(&mask.mask)).map_err(first_line)?;
        sized(&mask.mask, (image.width, image.height), size)?;
        if let Some(name) = &mask.logits {
            read_logits(&folder.join(name))?;
        }
    }
    Ok(())
}

/// The logits that a reply or request names, one channel: width, height, values.
///
/// # Errors
/// In a sentence: the file cannot be read, has not one channel, or values that are not finite.
pub fn read_logits(path: &Path) -> Result<(usize, usize, Vec<f32>), String> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let image = open_exr(path).map_err(first_line)?;
    let [channel] = image.channels.as_slice() else {
        return Err(format!("{name} has {} channels, logits have one", image.channels.len()));
    };
    let values = channel.to_f32();
    within(&name, &values, f32::MIN, f32::MAX)?;
    Ok((image.width, image.height, values))
}

/// A picture: 8 bits, or OpenEXR with finite values.
fn picture(folder: &Path, name: &str, size: (usize, usize)) -> Result<(), String> {
    if name.ends_with(".exr") {
        let image = linear(folder, name)?;
        sized(name, (image.width, image.height), size)?;
        return within(name, &image.data, f32::MIN, f32::MAX);
    }
    let image = read_image(&folder.join(name)).map_err(first_line)?;
    sized(name, (image.width, image.height), size)
}

/// Linear R, G, B of an OpenEXR file.
fn linear(folder: &Path, name: &str) -> Result<ImageF32, String> {
    let image = open_exr(&folder.join(name)).map_err(first_line)?;
    channels(&image, name, &["R", "G", "B"])
}

fn channels(image: &AovImage, name: &str, wanted: &[&str]) -> Result<ImageF32, String> {
    let mut planes = Vec::new();
    for channel in wanted {
        let found = image.channel(channel);
        planes.push(found.ok_or(format!("{name} has no channel {channel}"))?.to_f32());
    }
    let pixels = image.width * image.height;
    let data = (0..pixels).flat_map(|p| planes.iter().map(move |plane| plane[p])).collect();
    Ok(ImageF32::from_data(image.width, image.height, planes.len(), data))
}

fn predicted(folder: &Path, map: &PredictedMap, size: (usize, usize)) -> Result<(), String> {
    let name = &map.map;
    let wanted: &[&str] = match map.quantity {
        Quantity::Normal => &["X", "Y", "Z"],
        Quantity::Depth => &["Z"],
        Quantity::BaseColor => &["R", "G", "B"],
        Quantity::Roughness | Quantity::Metallic => &["Y"],
    };
    let file = open_exr(&folder.join(name)).map_err(first_line)?;
    let image = channels(&file, name, wanted)?;
    sized(name, (image.width, image.height), size)?;
    match map.quantity {
        Quantity::Normal => {
            within(name, &image.data, f32::MIN, f32::MAX)?;
            let lengths = image.data.chunks_exact(3).map(|n| n.iter().map(|v| v * v).sum::<f32>());
            let odd = lengths.map(f32::sqrt).find(|l| !((l - 1.0).abs() <= NORMAL_SLACK));
            if let Some(length) = odd {
                return Err(format!("{name} has a normal of length {length}"));
            }
        }
        Quantity::Depth => within(name, &image.data, 0.0, f32::MAX)?,
        _ => within(name, &image.data, 0.0, 1.0)?,
    }
    map.confidence.as_ref().map_or(Ok(()), |name| trusted(folder, name, size))
}

/// How far a picture or map can be trusted: 0 to 1.
fn trusted(folder: &Path, name: &str, size: (usize, usize)) -> Result<(), String> {
    let file = open_exr(&folder.join(name)).map_err(first_line)?;
    let image = channels(&file, name, &["Y"])?;
    sized(name, (image.width, image.height), size)?;
    within(name, &image.data, 0.0, 1.0)
}
