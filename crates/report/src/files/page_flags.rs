//! `--link NAME=FILE`, files that a page leads to, and `--note NAME=TEXT`, rows of its protocol.

use std::path::{Path, PathBuf, absolute};

use motes_figures::html::{Link, relative_url};
use motes_stage::{Context, StageError};

/// The links of a page that is written to `output`.
///
/// # Errors
/// When one is not `NAME=FILE`, or its file does not exist.
pub(super) fn links(
    given: &[String],
    output: &Path,
    context: &Context,
) -> anyhow::Result<Vec<Link>> {
    let folder = absolute(output)?.parent().map(PathBuf::from).unwrap_or_default();
    let link = |text: &String| -> anyhow::Result<Link> {
        let Some((label, file)) = text.split_once('=').filter(|(label, _)| !label.is_empty())
        else {
            let text = format!("not a link: {text}");
            return Err(StageError::usage(text).help("write NAME=FILE").into());
        };
        context.input("link", file)?;
        let url = relative_url(&folder, &absolute(file)?);
        Ok(Link { label: label.to_owned(), url })
    };
    given.iter().map(link).collect()
}

/// The rows of the protocol: name and text; the text is empty where there is no `=`.
pub(super) fn notes(given: &[String]) -> Vec<(String, String)> {
    let note = |text: &String| {
        let (name, value) = text.split_once('=').unwrap_or((text, ""));
        (name.to_owned(), value.to_owned())
    };
    given.iter().map(note).collect()
}
