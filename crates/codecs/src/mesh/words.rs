//! Lines of text: a word and numbers.

use std::path::Path;

use motes_formats::error::{FormatError, Result, quoted};

/// The first word of a line and the rest.
pub(super) fn key_of(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace).map_or((line, ""), |(key, rest)| (key, rest.trim_start()))
}

/// The numbers of a line, all of them finite.
pub(super) fn floats(text: &str, path: &Path, line: usize) -> Result<Vec<f32>> {
    let value = |word: &str| {
        let value = word.parse::<f32>().ok().filter(|v| v.is_finite());
        value.ok_or_else(|| {
            let cause = format!("{} is not a finite number", quoted(word));
            FormatError::invalid(path, format!("line {}", line + 1), cause)
        })
    };
    text.split_whitespace().map(value).collect()
}
