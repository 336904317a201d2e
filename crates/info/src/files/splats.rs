//! Gaussians in any format that is read.

use std::path::Path;

use motes_codecs::{SplatFormat, open_gaussians};
use motes_formats::Result;
use motes_formats::ply::GaussianFile;
use motes_scene::Materials;

use super::made_by;
use crate::{Description, Kind, measure};

/// Gaussians of a format that its name or first bytes tell.
///
/// # Errors
/// As [`open_gaussians`].
pub(super) fn describe(path: &Path) -> Result<Description> {
    let file = open_gaussians(path)?;
    let format = SplatFormat::of_name(path).map_or("", |format| format.codec().name);
    let mut found = of_gaussians(&file, format);
    found.columns = file.gaussians.extra.iter().map(|column| column.name.clone()).collect();
    Ok(found)
}

/// What Gaussians and the comments of their file say.
pub(super) fn of_gaussians(file: &GaussianFile, format: &str) -> Description {
    let GaussianFile { gaussians, comments, render_mode, exposure_response } = file;
    let mut found = Description::new(Kind::Gaussians, format)
        .count("gaussians", gaussians.len())
        .fact("render_mode", render_mode.map(|mode| mode.name()))
        .fact("exposure_response", exposure_response.map(|response| response.slope_per_stop));
    if Materials::of(gaussians).is_ok() {
        found = found.fact("materials", true);
    }
    if !comments.is_empty() {
        found = found.fact("comments", comments.clone());
    }
    found.sh_degree = Some(gaussians.sh_degree);
    found.bounds = measure::bounds(&gaussians.means);
    found.non_finite = Some(measure::non_finite_values(gaussians));
    found.made_by = made_by::of_comments(comments);
    let invalid = gaussians.invalid_rows();
    if let Some(first) = invalid.first() {
        let text = format!(
            "{} Gaussians cannot be drawn, the first is row {first} (counted from 0)",
            invalid.len()
        );
        found.warnings.push(text);
    }
    found
}
