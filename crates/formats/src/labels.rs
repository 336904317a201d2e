//! `labels.json`: names of objects and the selections that hold their Gaussians.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::capture::{checked_relative_path, resolve};
use crate::documents::{Document, Parsed, read_document};
use crate::error::{FormatError, Result, quoted};

/// Objects that a document may name: a name is a word of a person, not a key of a data base.
pub const MAX_LABELS: usize = 1000;
/// Letters of a name.
const MAX_NAME: usize = 60;

/// Names of objects of one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "motes labels")]
pub struct LabelsDocument {
    /// `motes/labels`.
    pub format: String,
    /// `MAJOR.MINOR`.
    pub version: String,
    /// Program and version that made it.
    #[serde(default)]
    pub made_by: String,
    /// The objects, 1 to 1000.
    #[schemars(length(min = 1, max = 1000))]
    pub objects: Vec<LabelDocument>,
}

/// An object with a name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LabelDocument {
    /// What people call it: letters, digits, spaces, hyphens; several objects may share a name.
    #[schemars(length(min = 1, max = 60))]
    pub name: String,
    /// Its `selection.json`, relative to this document, below its folder.
    pub selection: String,
    /// Other words for it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub also: Vec<String>,
    /// What it is made of, in a word: `wood`, `metal`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_of: Option<String>,
}

impl Document for LabelsDocument {
    const FORMAT: &'static str = "motes/labels";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 0;
}

impl LabelsDocument {
    /// Checks names and files; `path` names the document in errors. The selections, in order.
    ///
    /// # Errors
    /// As [`read_labels`].
    pub fn check(&self, path: &Path) -> Result<Vec<PathBuf>> {
        if self.objects.is_empty() || self.objects.len() > MAX_LABELS {
            let cause = format!("{} objects where 1 to {MAX_LABELS} are taken", self.objects.len());
            return Err(FormatError::invalid(path, "/objects", cause));
        }
        let mut files = Vec::with_capacity(self.objects.len());
        for (i, object) in self.objects.iter().enumerate() {
            check_name(path, &format!("/objects/{i}/name"), &object.name)?;
            for (k, name) in object.also.iter().enumerate() {
                check_name(path, &format!("/objects/{i}/also/{k}"), name)?;
            }
            if let Some(word) = &object.made_of {
                check_name(path, &format!("/objects/{i}/made_of"), word)?;
            }
            let place = format!("/objects/{i}/selection");
            files.push(resolve(path, &checked_relative_path(path, &place, &object.selection)?));
        }
        Ok(files)
    }
}

fn check_name(path: &Path, place: &str, name: &str) -> Result<()> {
    let is_letter = |c: char| c.is_alphanumeric() || c == ' ' || c == '-';
    let has_letter = name.chars().any(char::is_alphabetic);
    if has_letter && name.chars().all(is_letter) && name.chars().count() <= MAX_NAME {
        return Ok(());
    }
    let cause = format!("{} is no name", quoted(name));
    Err(FormatError::invalid(path, place, cause).with_remedy(
        "a name has letters, digits, spaces and hyphens, at most 60, as in \"coffee table\"",
    ))
}

/// Reads labels; the selections that they name, in order, relative to the working folder.
///
/// # Errors
/// The document cannot be read or is malformed, a name has other signs than letters, digits, spaces and hyphens, or a selection is
/// not named below the folder of the document.
pub fn read_labels(path: &Path) -> Result<(Parsed<LabelsDocument>, Vec<PathBuf>)> {
    let parsed = read_document::<LabelsDocument>(path)?;
    let files = parsed.document.check(path)?;
    Ok((parsed, files))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::documents::parse_document;

    fn checked(objects: &str) -> std::result::Result<Vec<PathBuf>, String> {
        let text =
            format!(r#"{{"format": "motes/labels", "version": "1.0", "objects": {objects}}}"#);
        let path = Path::new("folder/labels.json");
        let parsed = parse_document::<LabelsDocument>(text.as_bytes(), path);
        parsed.and_then(|p| p.document.check(path)).map_err(|error| error.to_string())
    }

    #[test]
    fn labels_name_selections_below_their_folder() {
        let files = checked(r#"[{"name": "coffee table", "selection": "sel/table.json"}]"#);
        assert_eq!(files, Ok(vec![PathBuf::from("folder/sel/table.json")]));
        for (bad, place) in [
            ("[]", "/objects"),
            (r#"[{"name": "", "selection": "a"}]"#, "/objects/0/name"),
            (r#"[{"name": "a\u0007", "selection": "a"}]"#, "/objects/0/name"),
            (r#"[{"name": "12", "selection": "a"}]"#, "/objects/0/name"),
            (r#"[{"name": "a", "selection": "/etc/passwd"}]"#, "/objects/0/selection"),
            (r#"[{"name": "a", "selection": "../a.json"}]"#, "/objects/0/selection"),
            (r#"[{"name": "a", "also": ["{}"], "selection": "a"}]"#, "/objects/0/also/0"),
            (r#"[{"name": "a"}]"#, "/objects/0"),
        ] {
            let said = checked(bad).unwrap_err();
            assert!(said.contains(place), "{bad}: {said}");
        }
    }
}
