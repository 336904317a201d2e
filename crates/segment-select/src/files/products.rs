//! Selections, overlays and labels to files.

use std::path::{Path, PathBuf};

use crate::{Proposal, SelectSource, notes, overlay, propose, select, split_boundary};
use clap::Args;
use motes_formats::images::write_png;
use motes_formats::ply::{PlyWriteOptions, write_gaussians};
use motes_formats::selection::{BoundGaussians, SelectionDocument, write_selection};
use motes_formats::selectors::{Candidate, SelectStep};
use motes_scene::{ColumnValues, ExtraColumn, Selection};
use motes_stage::{Context, OrBadInput as _, StageError};
use render::frames::view_stems;
use serde::Serialize;

use super::view_cache::usual_folder;
use super::{Inputs, PromptFlags};

/// What a document says of its maker.
const MADE_BY: &str = concat!("motes segment-select ", env!("CARGO_PKG_VERSION"));

/// What is written beside the selection.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Outputs")]
pub struct ExtraProducts {
    /// Folder for images of the prepared views with the selection drawn over them
    #[arg(long, value_name = "DIR")]
    pub overlay: Option<PathBuf>,

    /// Folder that keeps prepared views for the next prompt [default: motes/views in the user's
    /// cache folder]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,

    /// Do not keep prepared views
    #[arg(long, conflicts_with = "cache")]
    pub no_cache: bool,

    /// Column of labels in the labeled PLY; Gaussians outside the selection keep their labels
    #[arg(long, value_name = "NAME", default_value = "object_id")]
    pub label_column: String,

    /// Label of the selected Gaussians
    #[arg(long, value_name = "LABEL", default_value_t = 1)]
    pub label: u32,

    /// Gaussians with those on the boundary of the selection split in two (PLY); the selection then
    /// belongs to this file
    #[arg(long, value_name = "FILE", conflicts_with_all = ["labeled", "candidates"])]
    pub split_boundary: Option<PathBuf>,

    /// Gaussians with the column of labels (PLY)
    #[arg(short = 'O', long, value_name = "FILE", alias = "labelled")]
    pub labeled: Option<PathBuf>,
}

/// Claimed paths.
pub struct Outputs {
    /// The selection, then its part and subpart.
    selections: Vec<PathBuf>,
    overlay: Option<PathBuf>,
    labeled: Option<PathBuf>,
    split: Option<PathBuf>,
}

impl ExtraProducts {
    /// Where prepared views are kept.
    pub fn cache_folder(&self) -> Option<PathBuf> {
        match (&self.cache, self.no_cache) {
            (_, true) => None,
            (Some(folder), _) => Some(folder.clone()),
            (None, false) => usual_folder(),
        }
    }

    /// Claims all paths before any work.
    ///
    /// # Errors
    /// When something is there already.
    pub fn claim(
        &self,
        output: &Path,
        candidates: u8,
        context: &Context,
    ) -> anyhow::Result<Outputs> {
        let mut selections = vec![context.output(output)?];
        for name in ["part", "subpart"].iter().take(usize::from(candidates) - 1) {
            selections.push(context.output(output.with_extension(format!("{name}.json")))?);
        }
        let claim = |path: &Option<PathBuf>| path.as_ref().map(|p| context.output(p)).transpose();
        Ok(Outputs {
            selections,
            overlay: claim(&self.overlay)?,
            labeled: claim(&self.labeled)?,
            split: claim(&self.split_boundary)?,
        })
    }
}

/// What was found.
pub struct Answer {
    /// The selection that was asked for.
    pub selection: Selection,
    /// The steps that made it.
    pub steps: Vec<SelectStep>,
    /// Nested answers, the whole first; empty when there was no prompt alone.
    pub proposals: Vec<Proposal>,
}

/// Answers the flags.
///
/// # Errors
/// When a prompt names what does not exist, or nothing is selected.
pub fn answer(
    source: &SelectSource<'_>,
    flags: &PromptFlags,
    steps: &[SelectStep],
) -> anyhow::Result<Answer> {
    let mut proposals = Vec::new();
    let selection = match (flags.object(), steps.len()) {
        (Some(prompt), 1) => {
            let wanted = match prompt.candidate {
                Candidate::Whole => 0,
                Candidate::Part => 1,
                Candidate::Subpart => 2,
            };
            proposals = propose(source, &prompt, wanted.max(usize::from(flags.candidates) - 1) + 1)
                .or_bad_input()?;
            let chosen = wanted.min(proposals.len().saturating_sub(1));
            proposals.get(chosen).map(|p| p.selection.clone()).unwrap_or_default()
        }
        _ => select(source, steps).or_bad_input()?,
    };
    if selection.count() == 0 {
        let text = "nothing is selected: no Gaussian fits what was asked for";
        return Err(StageError::bad_input(text).into());
    }
    Ok(Answer { selection, steps: steps.to_vec(), proposals })
}

/// Writes everything that was asked for; the selection itself last.
///
/// # Errors
/// When a file cannot be written.
pub fn write_products(
    inputs: &Inputs,
    source: &SelectSource<'_>,
    answer: &Answer,
    extra: &ExtraProducts,
    outputs: &Outputs,
    context: &Context,
) -> anyhow::Result<()> {
    if let Some(folder) = &outputs.overlay {
        let Some((capture, _)) = &inputs.capture else {
            return Err(StageError::usage("--overlay needs --capture").into());
        };
        let stems = view_stems(capture);
        for view in source.prepared_views().or_bad_input()? {
            context.check_interrupted()?;
            let picture = overlay(source, view, &answer.selection).or_bad_input()?;
            write_png(&folder.join(format!("{}.png", stems[view])), &picture)?;
        }
    }
    if let Some(path) = &outputs.labeled {
        let mut gaussians = inputs.file.gaussians.clone();
        let column = &extra.label_column;
        let mut labels = match gaussians.extra.iter().find(|c| c.name == *column) {
            None => vec![0u32; gaussians.len()],
            Some(ExtraColumn { values: ColumnValues::U32(values), .. }) => values.clone(),
            Some(_) => {
                let text = format!("the column \"{column}\" holds no whole numbers of 32 bits");
                return Err(StageError::bad_input(text)
                    .help("choose another name with --label-column")
                    .into());
            }
        };
        answer.selection.rows().iter().for_each(|&i| labels[i as usize] = extra.label);
        gaussians.extra.retain(|c| c.name != *column);
        let values = ColumnValues::U32(labels);
        gaussians.extra.push(ExtraColumn { name: column.clone(), values });
        write_gaussians(path, &gaussians, &ply_options(inputs))?;
    }
    if let Some(path) = &outputs.split {
        return write_split(path, inputs, source, answer, outputs);
    }
    let wanted = |k: usize| match (k, answer.proposals.get(k)) {
        (0, _) => Some(&answer.selection),
        (_, proposal) => proposal.map(|p| &p.selection),
    };
    for (k, path) in outputs.selections.iter().enumerate().rev() {
        let Some(selection) = wanted(k) else {
            context.warn(format!(
                "there is no smaller part, so this was not written: {}",
                path.display()
            ));
            continue;
        };
        let notes = notes(source, selection, &answer.steps);
        let mut document = SelectionDocument::new(selection, inputs.bound.clone(), notes);
        document.made_by = MADE_BY.into();
        write_selection(path, &document)?;
    }
    Ok(())
}

fn ply_options(inputs: &Inputs) -> PlyWriteOptions {
    PlyWriteOptions {
        render_mode: inputs.file.render_mode,
        exposure_response: inputs.file.exposure_response,
        comments: Vec::new(),
        ..PlyWriteOptions::default()
    }
}

/// Writes Gaussians that are split at the edge, and the selection of them.
fn write_split(
    path: &Path,
    inputs: &Inputs,
    source: &SelectSource<'_>,
    answer: &Answer,
    outputs: &Outputs,
) -> anyhow::Result<()> {
    let gaussians = &inputs.file.gaussians;
    let notes = notes(source, &answer.selection, &answer.steps);
    // What is smaller than this leaves no fringe: about a pixel where the object fills the picture.
    let size =
        notes.object_box.map_or(0.0, |b| (0..3).map(|k| b.max[k] - b.min[k]).fold(0.0, f64::max));
    let done = split_boundary(gaussians, &answer.selection, (size / 500.0) as f32);
    write_gaussians(path, &done.gaussians, &ply_options(inputs))?;
    let bound = BoundGaussians::of_file(path, done.gaussians.len())?;
    let mut document = SelectionDocument::new(&done.selection, bound, notes);
    document.made_by = MADE_BY.into();
    Ok(write_selection(&outputs.selections[0], &document)?)
}
