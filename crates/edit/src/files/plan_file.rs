//! Reading plans.

use std::io::Read;
use std::path::Path;

use motes_formats::documents::Parsed;
use motes_formats::error::{FormatError, Result};

use crate::plan::{EditPlanDocument, MAX_OPS, MAX_PLAN_BYTES, parse_edit_plan};

/// Reads and checks a plan.
///
/// # Errors
/// The file cannot be read, is larger than [`MAX_PLAN_BYTES`], is not JSON, is another document, has more than
/// [`MAX_OPS`] operations, or an operation is unknown, lacks a key, has one that it does not know, or a value out of range.
/// The place is a JSON pointer.
pub fn read_edit_plan(path: &Path) -> Result<Parsed<EditPlanDocument>> {
    let io = |error| FormatError::io(path, error);
    if path.is_dir() {
        return Err(FormatError::invalid(
            path,
            "",
            "this is a folder, not a motes/edit-plan document",
        ));
    }
    let file = std::fs::File::open(path).map_err(io)?;
    let mut bytes = Vec::new();
    file.take(MAX_PLAN_BYTES + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > MAX_PLAN_BYTES {
        let cause = format!(
            "the plan has more than {MAX_PLAN_BYTES} bytes; at most {MAX_OPS} operations fit"
        );
        return Err(FormatError::not_supported(path, "/ops", cause)
            .with_remedy("split the plan, or keep ids in a selection.json"));
    }
    parse_edit_plan(&bytes, path)
}
