//! Which segmenter answers clicks, boxes and strokes, and the provider behind it.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use clap::{Args, ValueEnum};
use motes_formats::FormatError;
use motes_formats::atomic::ScratchFolder;
use motes_formats::exr_aov::{AovChannel, write_finite_exr};
use motes_formats::images::{read_mask, write_png};
use motes_formats::provider::{
    PointPrompt, ProviderKind, ProviderRequest, SegmentTask, Task, TaskResult,
};
use motes_math::resample::{Filter, resize};
use motes_protocol::{Provider, ProviderCommand, ProviderError, ProviderFlags, ProviderUse};
use motes_stage::{Context, StageError};
use serde::Serialize;

use crate::error::SelectError;
use crate::picture_segmenter::{PictureMask, PicturePrompt, PictureSegmenter};
use crate::projected::ProjectedPrompts;
use crate::source::SelectSource;

/// Who makes masks from clicks, boxes and strokes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Segmenter {
    /// Graph cuts on color and geometry; needs nothing
    #[default]
    GraphCut,
    /// SAM, MobileSAM or SAM 2.1 with the weights of --model
    Sam,
    /// The program of --provider
    Provider,
}

/// Who answers prompts.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Provider (expert)")]
pub struct SegmenterFlags {
    /// Who answers clicks, boxes and strokes. Only the command line can choose another than graph-cut
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Segmenter::GraphCut)]
    pub segmenter: Segmenter,

    /// Weights for --segmenter sam: a folder with encoder and decoder, or one of both beside the other (ONNX)
    #[arg(long, value_name = "PATH")]
    pub model: Option<PathBuf>,

    /// The program, when it is another.
    #[command(flatten)]
    #[serde(flatten)]
    pub provider: ProviderFlags,
}

impl SegmenterFlags {
    /// The program of the segmenter, when it is one.
    ///
    /// # Errors
    /// A flag is missing or of another segmenter; a file of `--config` chose it; there is no such program.
    pub fn command(&self, context: &Context) -> anyhow::Result<Option<ProviderCommand>> {
        let usage = |text: &str, help: &str| Err(StageError::usage(text).help(help).into());
        if self.segmenter != Segmenter::Sam && self.model.is_some() {
            return usage("--model is for --segmenter sam", "add --segmenter sam");
        }
        if self.segmenter != Segmenter::Provider && self.provider.provider.is_some() {
            return usage("--provider is for --segmenter provider", "add --segmenter provider");
        }
        if self.segmenter != Segmenter::GraphCut && context.is_from_config("segmenter") {
            let text = "a file of --config may not choose a segmenter that starts a program";
            return usage(text, "type --segmenter on the command line");
        }
        let command = match self.segmenter {
            Segmenter::GraphCut => return Ok(None),
            Segmenter::Sam => {
                let Some(model) = &self.model else {
                    let help =
                        "give --model with your ONNX files; docs/stages/provider-sam.md says which";
                    return usage("--segmenter sam needs weights", help);
                };
                context.input("model", model)?;
                let model = model.to_string_lossy().into_owned();
                let sam = ProviderCommand::new("sam").map_err(StageError::from)?;
                sam.with_arguments(["--model".into(), model])
            }
            Segmenter::Provider => match self.provider.command(context)? {
                Some(command) => command,
                None => return usage("--segmenter provider needs a program", "give --provider"),
            },
        };
        Ok(Some(command))
    }

    /// Starts the program of [`Self::command`].
    ///
    /// # Errors
    /// It does not start, or is no segmenter.
    pub fn open<'a>(
        &self,
        command: Option<ProviderCommand>,
        context: &'a Context,
    ) -> anyhow::Result<Option<ProjectedPrompts<ByProvider<'a>>>> {
        let Some(command) = command else { return Ok(None) };
        let provider = self.provider.open(command, ProviderKind::Segment, context)?;
        let provider = Mutex::new(provider);
        Ok(Some(ProjectedPrompts::new(ByProvider { provider, context })))
    }
}

/// A segmenter of pictures that is another program.
pub struct ByProvider<'a> {
    provider: Mutex<Provider>,
    context: &'a Context,
}

impl ByProvider<'_> {
    /// Who answered, and how often.
    pub fn used(&self) -> ProviderUse {
        self.provider.lock().unwrap_or_else(PoisonError::into_inner).used().clone()
    }
}

impl PictureSegmenter for ByProvider<'_> {
    fn segment(
        &self,
        source: &SelectSource<'_>,
        view: usize,
        prompt: &PicturePrompt,
    ) -> Result<Vec<PictureMask>, SelectError> {
        let scratch = ScratchFolder::new().map_err(|e| FormatError::io("temporary folder", e))?;
        let folder = scratch.path();
        let (camera, _, picture) = source.segmented_picture(view)?;
        write_png(&folder.join("picture.png"), &picture.to_u8())?;
        // Prompts and masks have the working size.
        let working = SelectSource::working(&camera);
        let scale = camera.width as f64 / working.width as f64;
        let (w, h) = (camera.width as f64, camera.height as f64);
        let inside = |[x, y]: [f64; 2]| [(x * scale).clamp(0.0, w), (y * scale).clamp(0.0, h)];
        let point = |&(at, positive): &([f64; 2], bool)| {
            let [x, y] = inside(at);
            PointPrompt { x, y, positive }
        };
        let mut task = SegmentTask {
            picture: "picture.png".into(),
            points: prompt.points.iter().map(point).collect(),
            around: prompt.around.map(|b| {
                let ([x0, y0], [x1, y1]) = (inside([b[0], b[1]]), inside([b[2], b[3]]));
                [x0, y0, x1, y1]
            }),
            logits: None,
            candidates: 3,
        };
        if let Some((columns, rows, logits)) = &prompt.logits {
            let channels = [AovChannel::float("Y", logits.clone())];
            write_finite_exr(&folder.join("logits.exr"), *columns, *rows, &channels, &[])?;
            task.logits = Some("logits.exr".into());
        }
        let request = ProviderRequest::new(Task::Segment(task), 0);
        let mut provider = self.provider.lock().unwrap_or_else(PoisonError::into_inner);
        let stopped = || self.context.interrupted();
        let reply = provider.ask(folder, &request, &stopped).map_err(|error| match error {
            ProviderError::Stopped => SelectError::Interrupted,
            error => SelectError::Segmenter(error.to_string()),
        })?;
        for warning in reply.warnings {
            tracing::debug!("{warning}");
        }
        let TaskResult::Segment(result) = reply.result else { return Ok(Vec::new()) };
        let mask = |m: &motes_formats::provider::SegmentMask| -> Result<PictureMask, SelectError> {
            let image = read_mask(&folder.join(&m.mask))?.to_f32();
            let (size, new_size) =
                ((image.width, image.height, 1), (working.width, working.height));
            let mask = resize(&image.data, size, new_size, Filter::Triangle);
            Ok(PictureMask { mask, predicted_iou: m.predicted_iou })
        };
        result.masks.iter().map(mask).collect()
    }
}
