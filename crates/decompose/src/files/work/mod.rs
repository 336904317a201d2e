//! The work folder: every step with what it changed, so that a run can stop after a step, go on from one, and read what another
//! program put in place of one. `docs/formats/decompose-work.md` describes the files.

mod documents;
mod materials;
mod sections;
mod shading;

use std::cell::OnceCell;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use crate::pipeline::{STEPS, step_named};
use crate::{Inputs, Pipeline};
use anyhow::Context as _;
use clap::Args;
use clap::builder::PossibleValuesParser;
use motes_formats::FormatError;
use motes_formats::documents::{Parsed, read_document, write_document};
use motes_formats::selection::sha256_of_file;
use motes_stage::{Context, StageError};
use serde::Serialize;

use super::errors::explained;
use documents::{InputDocument, StepDocument};
use sections::Section;

/// Which steps are run, and where they are kept.
#[derive(Clone, Debug, Args, Serialize)]
pub struct StepArgs {
    /// Folder that keeps the results of every step: a folder per step with PLY, EXR, JSON and
    /// safetensors files
    #[arg(long, value_name = "DIR", help_heading = "Pipeline")]
    pub work: Option<PathBuf>,

    /// Stop after this step; only the work folder is written
    #[arg(long, value_name = "STEP", requires = "work", conflicts_with = "output",
        value_parser = names(), help_heading = "Pipeline")]
    pub until: Option<String>,

    /// Continue from this step, with the results of the steps before it in the work folder
    #[arg(long, value_name = "STEP", requires = "work", value_parser = names(), help_heading = "Pipeline")]
    pub from: Option<String>,
}

fn names() -> PossibleValuesParser {
    PossibleValuesParser::new(STEPS.iter().map(|step| step.name))
}

impl StepArgs {
    /// Indices of the steps that are run.
    pub fn range(&self) -> RangeInclusive<usize> {
        let index = |name: &Option<String>| name.as_deref().and_then(step_named);
        index(&self.from).unwrap_or(0)..=index(&self.until).unwrap_or(STEPS.len() - 1)
    }
}

/// A work folder and the run that uses it.
#[derive(Debug)]
pub(super) struct WorkFolder<'a> {
    /// The folder.
    pub path: &'a Path,
    /// Indices of the steps that are run.
    pub steps: RangeInclusive<usize>,
    /// The captures of the run.
    pub captures: &'a [PathBuf],
    /// Its Gaussians.
    pub gaussians: &'a Path,
    /// Program and version.
    pub made_by: &'a str,
    /// Hashes of captures and Gaussians, once they were asked for.
    pub hashes: OnceCell<Vec<InputDocument>>,
}

impl WorkFolder<'_> {
    /// The folder of a step: `03-light`.
    fn folder(&self, step: usize) -> PathBuf {
        self.path.join(format!("{:02}-{}", step + 1, STEPS[step].name))
    }

    fn document(&self, step: usize) -> PathBuf {
        self.folder(step).join("step.json")
    }

    /// Claims the folders of the steps that will be run.
    ///
    /// # Errors
    /// When one is taken, or the range of steps is empty.
    pub(super) fn claim(&self, context: &Context) -> anyhow::Result<()> {
        if self.steps.is_empty() {
            let [from, until] = [self.steps.start(), self.steps.end()].map(|k| STEPS[*k].name);
            let text = format!("--from {from} comes after --until {until}");
            return Err(StageError::usage(text).into());
        }
        for step in *self.steps.start()..STEPS.len() {
            let folder = self.folder(step);
            // A later step rests on what is about to be replaced, and goes with it.
            if self.steps.contains(&step) || folder.exists() {
                context.output(folder)?;
            }
        }
        Ok(())
    }

    /// What the steps before the first that is run left, or the state before all.
    ///
    /// # Errors
    /// When a file is missing or malformed, or the folder belongs to other inputs.
    pub(super) fn restore<'i>(&self, inputs: &'i Inputs<'i>) -> anyhow::Result<Pipeline<'i>> {
        let mut pipeline = Pipeline::new(inputs).map_err(|e| explained(&e))?;
        let mut previous = None;
        let mut last = None;
        for step in 0..*self.steps.start() {
            let path = self.document(step);
            let document = self.read(step, previous.as_deref())?;
            if ![0, inputs.photos.len()].contains(&document.photos) {
                let (was, is) = (document.photos, inputs.photos.len());
                let cause = format!("it was made from {was} photos, not {is}");
                let remedy =
                    "give --most-photos and --albedo-anchor as then, or use another --work";
                return Err(FormatError::invalid(&path, "photos", cause)
                    .with_remedy(remedy)
                    .into());
            }
            previous = Some(sha256_of_file(&path)?);
            pipeline.report.steps.push(document.record());
            if let Some(geometry) = &document.geometry {
                pipeline.report.geometry = geometry.clone();
            }
            last = Some(document);
        }
        if let Some(last) = last {
            let done = *self.steps.start();
            let latest = |section: Section| {
                let step = (0..done).rev().find(|step| Section::of_step(*step).contains(&section));
                step.map(|step| self.folder(step))
            };
            sections::restore(&mut pipeline.state, &last, &latest)?;
        }
        Ok(pipeline)
    }

    fn read(&self, step: usize, previous: Option<&str>) -> anyhow::Result<StepDocument> {
        let (path, name) = (self.document(step), STEPS[step].name);
        let remedy = format!("run the steps before it with --until {name} --work");
        if !path.exists() {
            let text = format!("no such step in the work folder: {}", self.folder(step).display());
            return Err(StageError::bad_input(text).help(remedy).into());
        }
        let Parsed { document, warnings } = read_document::<StepDocument>(&path)?;
        warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
        let wrong = |place: &str, cause: String| FormatError::invalid(&path, place, cause);
        if document.step != name {
            let cause = format!("this is the step \"{}\", not \"{name}\"", document.step);
            return Err(wrong("step", cause).into());
        }
        if document.previous.as_deref() != previous {
            let cause = "the step before it was run again since";
            let remedy = format!("run it again too: --from {name}");
            return Err(wrong("previous", cause.into()).with_remedy(remedy).into());
        }
        let inputs = self.inputs()?;
        if document.inputs.len() != inputs.len() {
            let cause =
                format!("it was made from {} files, not {}", document.inputs.len(), inputs.len());
            return Err(wrong("inputs", cause).into());
        }
        for (was, is) in document.inputs.iter().zip(inputs) {
            if *was != is {
                let cause = format!("it was made from another file as --{}", is.role);
                let remedy = "name the same --capture and --gaussians, or use another --work";
                return Err(wrong("inputs", cause).with_remedy(remedy).into());
            }
        }
        Ok(document)
    }

    fn inputs(&self) -> anyhow::Result<Vec<InputDocument>> {
        if let Some(known) = self.hashes.get() {
            return Ok(known.clone());
        }
        let captures = self.captures.iter().map(|path| ("capture", path.as_path()));
        let files = captures.chain([("gaussians", self.gaussians)]);
        let document = |(role, path): (&str, &Path)| {
            Ok(InputDocument { role: role.into(), sha256: sha256_of_file(path)? })
        };
        let all: Vec<InputDocument> = files.map(document).collect::<anyhow::Result<_>>()?;
        Ok(self.hashes.get_or_init(|| all).clone())
    }

    /// Keeps a step that has just run, in the place of an older run of it and of all that followed.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub(super) fn save(&self, step: usize, pipeline: &Pipeline<'_>) -> anyhow::Result<()> {
        let (folder, state) = (self.folder(step), &pipeline.state);
        let failed = |what: &str| format!("cannot {what} {}", folder.display());
        std::fs::create_dir_all(self.path).with_context(|| failed("make"))?;
        let new = tempfile::Builder::new().prefix(".step-").tempdir_in(self.path)?;
        for section in Section::of_step(step) {
            section.save(state, new.path(), self.made_by)?;
        }
        let previous =
            step.checked_sub(1).map(|k| sha256_of_file(&self.document(k))).transpose()?;
        let document = StepDocument::of(pipeline, self.inputs()?, previous, self.made_by);
        write_document(&new.path().join("step.json"), &document)?;
        for stale in (step..STEPS.len()).map(|k| self.folder(k)).filter(|f| f.exists()) {
            std::fs::remove_dir_all(&stale)
                .with_context(|| format!("cannot remove {}", stale.display()))?;
        }
        std::fs::rename(new.keep(), &folder).with_context(|| failed("write"))?;
        Ok(())
    }
}
