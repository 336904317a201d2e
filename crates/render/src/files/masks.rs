//! Selections as pictures: 8-bit masks, and mattes in the channels of EXR files.

use std::path::{Path, PathBuf};

use crate::frames::{Frame, MatteObjects, Projection};
use crate::model::{Model, ModelInput};
use clap::Args;
use motes_formats::exr_aov::AovChannel;
use motes_formats::images::write_png;
use motes_formats::selection::read_selection;
use motes_raster::{RenderOptions, render_scalars};
use motes_scene::{ColumnValues, ImageF32, ImageU8};
use motes_stage::{Context, StageError};
use serde::Serialize;

/// Objects that a picture may name.
const MOST_OBJECTS: usize = 1000;

/// Selections and labels to draw.
#[derive(Args, Clone, Debug, Default, Serialize)]
#[command(next_help_heading = "Objects")]
pub struct MaskFlags {
    /// Selection of these Gaussians: a matte in EXR files, or with --mask the picture; repeatable
    #[arg(long = "selection", value_name = "FILE")]
    pub selections: Vec<PathBuf>,

    /// Write only the alpha of the selection, as 8-bit gray PNG
    #[arg(long, requires = "selections", conflicts_with_all = ["format", "aov", "object_ids"])]
    pub mask: bool,

    /// Column of labels that become mattes in EXR files; label 0 is the background
    #[arg(long, value_name = "COLUMN", num_args = 0..=1, default_missing_value = "object_id")]
    pub object_ids: Option<String>,
}

/// What is drawn of objects.
#[derive(Debug, Default)]
pub struct Objects {
    /// Named sets of Gaussians.
    pub mattes: MatteObjects,
    /// Only the mask of the first.
    pub mask_only: bool,
}

impl MaskFlags {
    /// Reads selections and labels of the `model` that `input` names. `files` tells whether mattes have a place to go,
    /// and the projection.
    ///
    /// # Errors
    /// When a selection is stale, a column is missing or is not a label, or nothing would be written.
    pub fn load(
        &self,
        input: &ModelInput,
        model: &Model,
        files: (bool, Projection),
        context: &Context,
    ) -> anyhow::Result<Objects> {
        let (has_exr, projection) = files;
        let mut objects = Objects { mask_only: self.mask, ..Objects::default() };
        if self.selections.is_empty() && self.object_ids.is_none() {
            return Ok(objects);
        }
        if !self.mask && !has_exr {
            return Err(StageError::usage("--selection and --object-ids need a place to go")
                .help("add --mask for masks, or --format exr for mattes")
                .into());
        }
        if projection != Projection::Pinhole {
            return Err(StageError::usage("masks and mattes need --projection pinhole").into());
        }
        if self.mask && self.selections.len() != 1 {
            return Err(StageError::usage("--mask draws one selection").into());
        }
        let count = model.gaussians.len();
        let list = &mut objects.mattes.objects;
        if !self.selections.is_empty() {
            let bound = input.bound(count)?;
            for file in &self.selections {
                context.input("selection", file)?;
                let read = read_selection(file, &bound)?;
                read.warnings.iter().for_each(|text| context.warn(text));
                let belongs = |i| f32::from(u8::from(read.selection.contains(i)));
                let name = file.file_stem().map(|n| n.to_string_lossy().into_owned());
                list.push((name.unwrap_or_default(), (0..count).map(belongs).collect()));
            }
        }
        if let Some(column) = &self.object_ids {
            let labels = labels(model, column)?;
            let mut values: Vec<u32> = labels.iter().copied().filter(|&l| l != 0).collect();
            values.sort_unstable();
            values.dedup();
            if values.len() > MOST_OBJECTS {
                let text = format!(
                    "the column \"{column}\" has {} labels, more than {MOST_OBJECTS}",
                    values.len()
                );
                return Err(StageError::bad_input(text).into());
            }
            for value in values {
                let belongs = labels.iter().map(|&l| f32::from(u8::from(l == value))).collect();
                list.push((format!("{column}_{value}"), belongs));
            }
        }
        let mut names: Vec<&String> = list.iter().map(|o| &o.0).collect();
        names.sort();
        if let Some(twice) = names.windows(2).find(|w| w[0] == w[1]) {
            let text = format!("two objects are called \"{}\"", twice[0]);
            return Err(StageError::usage(text).help("give the selections different names").into());
        }
        Ok(objects)
    }
}

fn labels(model: &Model, column: &str) -> anyhow::Result<Vec<u32>> {
    let found = model.gaussians.extra.iter().find(|c| c.name == column);
    let label = |v: i64| u32::try_from(v).ok();
    let labels: Option<Vec<u32>> = match found.map(|c| &c.values) {
        Some(ColumnValues::U8(v)) => Some(v.iter().map(|&v| u32::from(v)).collect()),
        Some(ColumnValues::U16(v)) => Some(v.iter().map(|&v| u32::from(v)).collect()),
        Some(ColumnValues::U32(v)) => Some(v.clone()),
        Some(ColumnValues::I32(v)) => v.iter().map(|&v| label(v.into())).collect(),
        Some(ColumnValues::I16(v)) => v.iter().map(|&v| label(v.into())).collect(),
        Some(ColumnValues::I8(v)) => v.iter().map(|&v| label(v.into())).collect(),
        Some(ColumnValues::F32(_) | ColumnValues::F64(_)) | None => None,
    };
    labels.ok_or_else(|| {
        let text = format!("the Gaussians have no column \"{column}\" of whole numbers from 0 on");
        StageError::bad_input(text).help("segment-select --labeled writes one").into()
    })
}

impl Objects {
    /// Whether anything is to be drawn.
    pub fn is_empty(&self) -> bool {
        self.mattes.objects.is_empty()
    }

    /// Attributes of EXR files that hold mattes.
    pub fn attributes(&self) -> Vec<(String, String)> {
        if self.is_empty() { Vec::new() } else { self.mattes.attributes() }
    }

    /// Channels with the mattes of a frame.
    pub fn channels(
        &self,
        model: &Model,
        frame: &Frame,
        options: &RenderOptions,
    ) -> Vec<AovChannel> {
        if self.is_empty() {
            return Vec::new();
        }
        let (camera, pose) = (&frame.camera, &frame.camera_from_world);
        self.mattes.channels(&model.gaussians, camera, pose, options)
    }

    /// Writes the mask of a frame as `NAME.png`, when that is all that was asked for.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write_mask(
        &self,
        folder: &Path,
        model: &Model,
        frame: &Frame,
        options: &RenderOptions,
    ) -> anyhow::Result<bool> {
        let Some((_, belongs)) = self.mattes.objects.first().filter(|_| self.mask_only) else {
            return Ok(false);
        };
        let (camera, pose) = (&frame.camera, &frame.camera_from_world);
        let rgb: ImageF32 = render_scalars(&model.gaussians, &[belongs], camera, pose, options);
        let wide = rgb.to_u8();
        let gray = wide.data.iter().step_by(3).copied().collect();
        let gray = ImageU8::from_data(wide.width, wide.height, 1, gray);
        write_png(&folder.join(format!("{}.png", frame.name)), &gray)?;
        Ok(true)
    }
}
