//! Requests to replies.

use std::path::{Path, PathBuf};

use motes_formats::exr_aov::{AovChannel, write_finite_exr};
use motes_formats::images::{read_image, write_png};
use motes_formats::provider::{
    ModelDescription, ProviderDescription, ProviderKind, ProviderReply, ProviderRequest,
    SegmentMask, SegmentResult, SegmentTask, Task, TaskResult,
};
use motes_formats::selection::sha256_of_file;
use motes_scene::ImageU8;
use motes_stage::StageError;

use crate::decode::Chosen;
use crate::embeddings::{Embeddings, Kept};
use crate::model::Model;
use crate::prompt::Prompt;
use crate::{Frame, SamError, Weights};

/// A loaded model that answers requests.
pub struct Sam {
    model: Model,
    kept: Option<Kept>,
    /// The picture of the last request by its SHA-256, for the next one.
    last: Option<(String, Embeddings)>,
}

/// What the program says about itself with these weights.
///
/// # Errors
/// A file cannot be read.
pub(crate) fn description(
    weights: &Weights,
    license: &str,
) -> Result<ProviderDescription, SamError> {
    let version = env!("CARGO_PKG_VERSION");
    let mut description = ProviderDescription::new("sam", version, &[ProviderKind::Segment]);
    description.deterministic = true;
    for path in [&weights.encoder, &weights.decoder] {
        description.models.push(ModelDescription {
            id: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            sha256: Some(Weights::sha256(path)?),
            license: license.to_owned(),
        });
    }
    Ok(description)
}

impl Sam {
    /// Loads weights; embeddings are kept in `cache` where a folder is given.
    ///
    /// # Errors
    /// As [`Model::load`].
    pub fn load(
        weights: &Weights,
        threads: usize,
        cache: Option<&PathBuf>,
    ) -> Result<Self, SamError> {
        let model = Model::load(weights, threads)?;
        let kept = match cache {
            Some(folder) => Some(Kept::new(folder, &Weights::sha256(&weights.encoder)?)),
            None => None,
        };
        Ok(Self { model, kept, last: None })
    }

    /// The reply to a request whose files lie in `folder`; masks and logits are written there.
    ///
    /// # Errors
    /// The request is not one for masks or its prompt is none (usage); the model fails.
    pub fn answer(
        &mut self,
        request: &ProviderRequest,
        folder: &Path,
    ) -> anyhow::Result<ProviderReply> {
        let Task::Segment(task) = &request.task else {
            let text = format!("SAM does not do {}", request.kind().name());
            return Err(StageError::usage(text).help("it does segment").into());
        };
        let (chosen, frame, warnings) = self.chosen(task, folder).map_err(told)?;
        let mut reply = write(&chosen, &frame, folder).map_err(told)?;
        reply.warnings = warnings;
        Ok(reply)
    }

    /// The candidates of a request.
    ///
    /// # Errors
    /// As [`Self::answer`].
    pub fn chosen(
        &mut self,
        task: &SegmentTask,
        folder: &Path,
    ) -> Result<(Chosen, Frame, Vec<String>), SamError> {
        let path = folder.join(&task.picture);
        let picture = read_image(&path)?;
        let size = (picture.width, picture.height);
        let frame = Frame::new(self.model.convention, size, self.model.side);
        let abilities = self.model.abilities();
        let prompt = Prompt::new(task, folder, &frame, self.model.convention, abilities)?;
        let sha256 = sha256_of_file(&path)?;
        self.embed(&sha256, &picture, &frame)?;
        let embeddings = self.last.as_ref().map_or(&[][..], |(_, embeddings)| embeddings);
        let count = usize::from(task.candidates);
        let chosen = self.model.decode(embeddings, &prompt, &frame, count)?;
        Ok((chosen, frame, prompt.warnings))
    }

    fn embed(&mut self, sha256: &str, picture: &ImageU8, frame: &Frame) -> Result<(), SamError> {
        if self.last.as_ref().is_some_and(|(last, _)| last == sha256) {
            return Ok(());
        }
        let names = self.model.convention.embeddings();
        let embeddings = match self.kept.as_ref().and_then(|kept| kept.find(sha256, names)) {
            Some(found) => found,
            None => {
                let made = self.model.embed(picture, frame)?;
                self.kept.iter().for_each(|kept| kept.keep(sha256, &made));
                made
            }
        };
        self.last = Some((sha256.to_owned(), embeddings));
        Ok(())
    }
}

/// The kind of an error: the caller's prompt, or data.
pub(crate) fn told(error: SamError) -> anyhow::Error {
    let text = error.to_string();
    match error {
        SamError::NoPrompt | SamError::Prompt(_) => StageError::usage(text).into(),
        _ => StageError::bad_input(text).into(),
    }
}

fn write(chosen: &Chosen, frame: &Frame, folder: &Path) -> Result<ProviderReply, SamError> {
    let mut masks = Vec::new();
    for (k, candidate) in chosen.candidates.iter().enumerate() {
        let (mask, logits) = (format!("mask-{k}.png"), format!("logits-{k}.exr"));
        let white = |v: &f32| if *v > 0.0 { 255 } else { 0 };
        let pixels = candidate.logits.iter().map(white).collect();
        let picture = ImageU8::from_data(frame.size.0, frame.size.1, 1, pixels);
        write_png(&folder.join(&mask), &picture)?;
        let ((width, height), values) = frame.cropped(&candidate.grid, chosen.grid);
        let channels = [AovChannel::float("Y", values)];
        write_finite_exr(&folder.join(&logits), width, height, &channels, &[])?;
        masks.push(SegmentMask {
            mask,
            predicted_iou: candidate.predicted_iou,
            stability: candidate.stability,
            logits: Some(logits),
        });
    }
    let best = chosen.best as u64;
    Ok(ProviderReply::new(TaskResult::Segment(SegmentResult { masks, best })))
}
