//! Requests to replies.

use std::path::{Path, PathBuf};

use candle_core::{DType, Device};
use motes_formats::images::write_png;
use motes_formats::provider::{
    InstructEditResult, InstructEditTask, ModelDescription, ProviderDescription, ProviderKind,
    ProviderReply, ProviderRequest, RelightResult, RelightTask, Task, TaskResult,
};
use motes_formats::selection::sha256_of_file;
use motes_stage::StageError;

use crate::edit::{CHANNELS, Edit, EditedView, edited, groups, signal_of};
use crate::error::{DiffusionError, Result};
use crate::network::UNet;
use crate::noise::{Keyed, Noise as _};
use crate::options::{Options, Precision};
use crate::parts::{Parts, check, unet};
use crate::pictures::{read, read_foreground, resized, size, working_size};
use crate::relight::{BY_BACKGROUND, BY_PROMPT, Subject, evaluations, on_gray, relit};
use crate::weights::{IC_LIGHT, STABLE_DIFFUSION, TensorFile, part, scheduler};

/// Longest side of a picture, pixels.
const LARGEST_SIDE: u64 = 16_384;

/// Which model the files are.
enum Which {
    /// Files of offsets by the number of their input channels.
    IcLight(Vec<(usize, PathBuf)>),
    InstructPix2Pix,
}

/// The user's files, and what was loaded of them.
pub struct Diffusion {
    folder: PathBuf,
    which: Which,
    options: Options,
    device: Device,
    parts: Option<Parts>,
    unets: Vec<(usize, UNet)>,
}

/// Called at the start of a picture with the evaluations of its network, and after each of them.
pub(crate) type Watch<'a> = &'a dyn Fn(u64) -> Box<dyn Fn() + 'a>;

impl Diffusion {
    /// Finds the files, and compares their heads with the networks. `offsets` are those of IC-Light, a file or a folder.
    ///
    /// # Errors
    /// Files are missing or of another model; a flag is out of range.
    pub fn open(folder: &Path, offsets: Option<&Path>, options: &Options) -> Result<Self> {
        options.check()?;
        let base = part(folder, "unet")?;
        let channels = input_channels(&TensorFile::open(&base.path)?);
        let which = match (channels, offsets) {
            (Some(CHANNELS), None) => Which::InstructPix2Pix,
            (Some(CHANNELS), Some(_)) => {
                let help = "leave out --weights, or give Stable Diffusion 1.5 to --model";
                let cause =
                    "offsets of IC-Light belong to Stable Diffusion 1.5, not to InstructPix2Pix";
                return Err(DiffusionError::weights(cause, &base.path, help));
            }
            (Some(4), Some(path)) => Which::IcLight(variants(path)?),
            (Some(4), None) => {
                let help = format!(
                    "give its files to --weights, or InstructPix2Pix to --model; {IC_LIGHT}"
                );
                let cause = "Stable Diffusion without the offsets of IC-Light";
                return Err(DiffusionError::weights(cause, &base.path, help));
            }
            _ => {
                let cause = "no UNet of Stable Diffusion 1.5 or InstructPix2Pix, whose first convolution has 4 or 8 input channels";
                return Err(DiffusionError::weights(cause, &base.path, STABLE_DIFFUSION));
            }
        };
        let files: Vec<(&Path, usize)> = match &which {
            Which::IcLight(files) => files.iter().map(|(n, path)| (path.as_path(), *n)).collect(),
            Which::InstructPix2Pix => Vec::new(),
        };
        check(folder, &files)?;
        if matches!(which, Which::InstructPix2Pix) {
            signal_of(&scheduler(folder)?)?;
        }
        let device = options.device.open()?;
        let (folder, options) = (folder.to_owned(), options.clone());
        Ok(Self { folder, which, options, device, parts: None, unets: Vec::new() })
    }

    /// What the program says about itself with these files.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn description(&self, license: Option<&str>) -> Result<ProviderDescription> {
        let (name, kind, own, offsets) = match &self.which {
            Which::IcLight(files) => {
                ("iclight", ProviderKind::Relight, "CreativeML OpenRAIL-M", files.as_slice())
            }
            Which::InstructPix2Pix => ("ip2p", ProviderKind::InstructEdit, "MIT", &[][..]),
        };
        let version = format!("{} {}", env!("CARGO_PKG_VERSION"), self.options.said());
        let mut description = ProviderDescription::new(name, &version, &[kind]);
        description.deterministic = self.device.is_cpu();
        description.largest_side_px = LARGEST_SIDE;
        let parts = ["unet", "vae", "text_encoder"].map(|name| part(&self.folder, name));
        let mut paths = Vec::new();
        for found in parts {
            paths.push(found?.path);
        }
        paths.extend(offsets.iter().map(|(_, path)| path.clone()));
        for path in paths {
            description.models.push(ModelDescription {
                id: last_two(&path),
                sha256: Some(sha256_of_file(&path)?),
                license: license.unwrap_or(own).to_owned(),
            });
        }
        Ok(description)
    }

    /// The reply to a request whose files lie in `folder`; pictures are written there.
    ///
    /// # Errors
    /// The request is of another kind or asks for what is not there (usage); pictures or weights are bad; the network fails.
    pub fn answer(
        &mut self,
        request: &ProviderRequest,
        folder: &Path,
        watch: Watch<'_>,
    ) -> anyhow::Result<ProviderReply> {
        let seed = request.seed;
        match (&request.task, &self.which) {
            (Task::Relight(task), Which::IcLight(_)) => {
                self.relit(task, folder, seed, watch).map_err(told)
            }
            (Task::InstructEdit(task), Which::InstructPix2Pix) => {
                self.edited(task, folder, seed, watch).map_err(told)
            }
            (_, which) => {
                let (name, does) = match which {
                    Which::IcLight(_) => ("IC-Light", "relight"),
                    Which::InstructPix2Pix => ("InstructPix2Pix", "instruct-edit"),
                };
                let text = format!("{name} does not do {}", request.kind().name());
                Err(StageError::usage(text).help(format!("it does {does}")).into())
            }
        }
    }

    fn relit(
        &mut self,
        task: &RelightTask,
        folder: &Path,
        seed: u64,
        watch: Watch<'_>,
    ) -> Result<ProviderReply> {
        let picture = read(&folder.join(&task.picture))?;
        let foreground = match &task.foreground {
            Some(name) => Some(read_foreground(&folder.join(name), &picture)?),
            None => None,
        };
        let mut seen = vec![on_gray(&picture, foreground.as_deref())];
        if let Some(name) = &task.background {
            seen.push(read(&folder.join(name))?);
        }
        let channels = if seen.len() > 1 { BY_BACKGROUND } else { BY_PROMPT };
        let passes = self.options.passes(channels);
        let (prompt, negative) = self.options.relight_texts(&task.prompt);
        let working = working_size((picture.width, picture.height), self.options.relight_size());
        let (parts, unet) = self.loaded(channels)?;
        let texts = parts.embedded_pair(&prompt, &negative)?;
        let tick = watch(evaluations(&passes, working, seen.len() > 1));
        let subject = Subject { seen: &seen, texts: &texts, size: working };
        let made = relit((parts, unet), &subject, &passes, &mut Keyed::new(seed), &*tick)?;
        let whole = resized(&made, (picture.width, picture.height));
        write_png(&folder.join("relit.png"), &whole)?;
        let result = RelightResult { picture: "relit.png".into() };
        let mut reply = ProviderReply::new(TaskResult::Relight(result));
        if picture.width.max(picture.height) > 2 * made.width.max(made.height) {
            let (a, b) = (size(&made), size(&picture));
            reply.warnings.push(format!(
                "the model worked at {a} pixels, less than half of {b}: details of the photo are lost"
            ));
        }
        Ok(reply)
    }

    fn edited(
        &mut self,
        task: &InstructEditTask,
        folder: &Path,
        seed: u64,
        watch: Watch<'_>,
    ) -> Result<ProviderReply> {
        let (longer, steps) = self.options.edit_size_and_steps();
        let how = Edit {
            steps,
            text_guidance: self.options.text_guidance,
            picture_guidance: self.options.picture_guidance,
            noise: task.noise,
            signal: signal_of(&scheduler(&self.folder)?)?,
        };
        let mut views = Vec::new();
        for view in &task.views {
            views.push(read_view(folder, &view.original, view.start.as_deref())?);
        }
        let negative = self.options.negative.clone().unwrap_or_default();
        let (joint, keeps) = (self.options.joint, how.keeps());
        let mut pictures: Vec<_> = views.iter().map(|view| view.start.clone()).collect();
        let mut warnings = Vec::new();
        if !keeps {
            let (parts, unet) = self.loaded(CHANNELS)?;
            let texts = [parts.embedded(&task.prompt)?, parts.embedded(&negative)?];
            if views.len() > joint && joint > 1 {
                warnings.push(format!(
                    "{} views are edited in groups of at most {joint}, which agree less (--joint)",
                    views.len()
                ));
            }
            let groups = groups(&views, joint);
            let tick = watch((groups.len() * steps) as u64);
            for group in groups {
                let first = &views[group[0]].photo;
                let working = working_size((first.width, first.height), longer);
                // The same noise for every view and group of a seed: what is edited alone later agrees with what was edited jointly.
                let fresh = Keyed::new(seed).like(&parts.empty(working)?)?;
                let chosen: Vec<&EditedView> = group.iter().map(|i| &views[*i]).collect();
                let texts = (&texts, working);
                let made = edited((parts, unet), &chosen, texts, &how, &fresh, &*tick)?;
                for (i, picture) in group.into_iter().zip(made) {
                    pictures[i] = picture;
                }
            }
        }
        let names: Vec<String> = (0..views.len()).map(|i| format!("edited-{i}.png")).collect();
        for (name, picture) in names.iter().zip(&pictures) {
            write_png(&folder.join(name), picture)?;
        }
        let result = TaskResult::InstructEdit(InstructEditResult { pictures: names });
        Ok(ProviderReply { warnings, ..ProviderReply::new(result) })
    }

    /// The networks for so many input channels, loaded when they are first needed.
    fn loaded(&mut self, channels: usize) -> Result<(&Parts, &UNet)> {
        let offsets = match &self.which {
            Which::InstructPix2Pix => None,
            Which::IcLight(files) => Some(variant(files, channels)?),
        };
        if self.parts.is_none() {
            self.parts = Some(Parts::load(&self.folder, &self.device)?);
        }
        if !self.unets.iter().any(|(n, _)| *n == channels) {
            let dtype: DType = Precision::dtype(self.options.precision, &self.device);
            let made = unet(&self.folder, offsets, (&self.device, dtype))?;
            self.unets.push((channels, made));
        }
        let unet = self.unets.iter().find(|(n, _)| *n == channels);
        match (&self.parts, unet) {
            (Some(parts), Some((_, unet))) => Ok((parts, unet)),
            _ => Err(DiffusionError::NotFinite),
        }
    }
}

/// The file of offsets for so many input channels.
fn variant(files: &[(usize, PathBuf)], channels: usize) -> Result<(&Path, usize)> {
    let found = files.iter().find(|(n, _)| *n == channels);
    found.map(|(n, path)| (path.as_path(), *n)).ok_or_else(|| {
        let (name, why) = match channels {
            BY_BACKGROUND => ("fbc", "a background needs"),
            _ => ("fc", "light by a prompt alone needs"),
        };
        let cause = format!("{why} iclight_sd15_{name}.safetensors");
        let path = files.first().map_or(PathBuf::new(), |(_, path)| path.clone());
        let help = format!("give the folder of both files to --weights; {IC_LIGHT}");
        DiffusionError::weights(cause, &path, help)
    })
}

/// Input channels of the first convolution.
fn input_channels(file: &TensorFile) -> Option<usize> {
    match file.shape("conv_in.weight") {
        [_, channels, _, _] => Some(*channels),
        _ => None,
    }
}

/// Files of offsets of IC-Light by the number of their input channels, in a file or a folder.
fn variants(path: &Path) -> Result<Vec<(usize, PathBuf)>> {
    let mut files = vec![path.to_owned()];
    if path.is_dir() {
        let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
        let is_one = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            name.starts_with("iclight_sd15_") && name.ends_with(".safetensors")
        };
        files = entries.map(|entry| entry.path()).filter(is_one).collect();
        files.sort();
    }
    if files.is_empty() {
        let cause = "no iclight_sd15_fc.safetensors or iclight_sd15_fbc.safetensors";
        return Err(DiffusionError::weights(cause, path, IC_LIGHT));
    }
    let mut found: Vec<(usize, PathBuf)> = Vec::new();
    for file in files {
        let channels = input_channels(&TensorFile::open(&file)?);
        let Some(channels) = channels.filter(|n| [BY_PROMPT, BY_BACKGROUND].contains(n)) else {
            let said =
                channels.map_or("no conv_in.weight".into(), |n| format!("{n} input channels"));
            let cause = format!("no weights of IC-Light: {said}, where 8 or 12 are due");
            return Err(DiffusionError::weights(cause, &file, IC_LIGHT));
        };
        // The first in the order of names: fc, before its variant fcon.
        let at = found.iter().position(|(n, _)| *n == channels);
        let shorter = |a: &Path, b: &Path| a.as_os_str().len() < b.as_os_str().len();
        match at {
            Some(at) if shorter(&file, &found[at].1) => found[at].1 = file,
            Some(_) => {}
            None => found.push((channels, file)),
        }
    }
    Ok(found)
}

fn read_view(folder: &Path, photo: &str, start: Option<&str>) -> Result<EditedView> {
    let photo = read(&folder.join(photo))?;
    let Some(name) = start else { return Ok(EditedView { start: photo.clone(), photo }) };
    let start = read(&folder.join(name))?;
    if (start.width, start.height) != (photo.width, photo.height) {
        let (a, b) = (size(&start), size(&photo));
        let cause = format!("the start {name} has {a} pixels, its photo {b}");
        return Err(DiffusionError::picture(cause, "send both alike"));
    }
    Ok(EditedView { photo, start })
}

/// `unet/diffusion_pytorch_model.safetensors`.
fn last_two(path: &Path) -> String {
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    format!("{}/{}", path.parent().map(name).unwrap_or_default(), name(path))
}

/// The kind of an error: the caller's request, data, or the work.
pub(crate) fn told(error: DiffusionError) -> anyhow::Error {
    let text = error.to_string();
    match error {
        DiffusionError::File(error) => error.into(),
        DiffusionError::Request { .. } => StageError::usage(text).into(),
        DiffusionError::Weights { .. } | DiffusionError::Picture { .. } => {
            StageError::bad_input(text).into()
        }
        DiffusionError::NotFinite | DiffusionError::Computation(_) => anyhow::anyhow!(error),
    }
}
