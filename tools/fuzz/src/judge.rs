//! Whether a run ended as it may.

use std::path::Path;

use motes_formats::{finite, ply};

use crate::bench::Ended;

/// A message longer than this echoes its input.
const LONGEST_MESSAGE: usize = 4000;

/// What is wrong with how a run on hostile input ended; `folder` holds its products.
pub(crate) fn fault(ended: &Ended, folder: &Path) -> Option<String> {
    let Some(status) = ended.status else { return Some("it did not end".into()) };
    let said = &ended.stderr;
    match status.code() {
        None => return Some(format!("it was ended by {status}")),
        Some(code) if !(0..=4).contains(&code) => {
            return Some(format!("it ended with {code}: {}", first_line(said)));
        }
        Some(_) => {}
    }
    if said.contains("panicked") || said.contains("internal error") {
        return Some(format!("it panicked: {}", first_line(said)));
    }
    if said.len() > LONGEST_MESSAGE {
        return Some(format!("its message has {} bytes", said.len()));
    }
    if !status.success() && said.trim().is_empty() {
        return Some(format!("it ended with {status} and said nothing"));
    }
    leftovers(folder).or_else(|| if status.success() { bad_product(folder) } else { None })
}

/// A temporary file that is left.
pub(crate) fn leftovers(folder: &Path) -> Option<String> {
    let left = files(folder).into_iter().find(|path| {
        path.components().any(|part| part.as_os_str().to_string_lossy().starts_with(".motes-"))
    });
    left.map(|path| format!("it left {}", path.display()))
}

/// A product that is not a whole file of numbers.
pub(crate) fn bad_product(folder: &Path) -> Option<String> {
    for path in files(folder).iter().filter(|path| path.extension().is_some_and(|e| e == "ply")) {
        let is_product = path.file_stem().is_some_and(|stem| stem == "product");
        if !is_product {
            continue;
        }
        match ply::read_gaussians(path) {
            Err(error) => return Some(format!("its product is broken: {error}")),
            Ok(gaussians) => {
                if let Err(error) = finite::gaussians(path, &gaussians) {
                    return Some(format!("its product is not finite: {error}"));
                }
            }
        }
    }
    None
}

/// Every file and folder below a folder.
pub(crate) fn files(folder: &Path) -> Vec<std::path::PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(files(&path));
        }
        found.push(path);
    }
    found
}

pub(crate) fn first_line(text: &str) -> String {
    text.lines().next().unwrap_or_default().chars().take(300).collect()
}
