//! Which photos are held out.

use std::collections::HashMap;
use std::path::Path;

use motes_scene::Split;

use crate::error::{IngestError, Result};
use crate::gathered::Photo;
use crate::options::ImportOptions;

/// Decides the split of every photo (sorted by name); `None` leaves the photo out. Adds what the
/// user should know to `notes`.
///
/// In this order: the lists of the options, the split that the source prescribes, `--test-every`,
/// everything is for training.
pub(crate) fn assign(
    photos: &[Photo],
    options: &ImportOptions,
    notes: &mut Vec<String>,
) -> Result<Vec<Option<Split>>> {
    let listed = |path: &Path| -> Result<Vec<bool>> { read_list(path, photos) };
    let test = options.test_list.as_deref().map(listed).transpose()?;
    let train = options.train_list.as_deref().map(listed).transpose()?;
    if test.is_some() || train.is_some() {
        return Ok((0..photos.len())
            .map(|i| match (&test, &train) {
                (Some(test), _) if test[i] => Some(Split::Test),
                (_, Some(train)) => train[i].then_some(Split::Train),
                _ => Some(Split::Train),
            })
            .collect());
    }
    if photos.iter().any(|photo| photo.split.is_some()) {
        if options.test_every.is_some() {
            notes.push(
                "the input says itself which photos are held out; --test-every has no effect"
                    .into(),
            );
        }
        return Ok(photos.iter().map(|photo| Some(photo.split.unwrap_or(Split::Train))).collect());
    }
    let held_out = |i: usize| options.test_every.is_some_and(|n| i.is_multiple_of(n as usize));
    let split = |i: usize| if held_out(i) { Split::Test } else { Split::Train };
    Ok((0..photos.len()).map(|i| Some(split(i))).collect())
}

/// Which photos a list names: by full name, by name without suffix, or by file name alone when
/// that is unambiguous.
fn read_list(path: &Path, photos: &[Photo]) -> Result<Vec<bool>> {
    let text = std::fs::read_to_string(path).map_err(|error| {
        IngestError::bad_input(
            format!("cannot read the list ({error}): {}", path.display()),
            "the list is a text file (UTF-8) with one photo name per line",
        )
    })?;
    let mut by_key: HashMap<&str, Vec<usize>> = HashMap::new();
    for (index, photo) in photos.iter().enumerate() {
        let file = photo.name.rsplit('/').next().unwrap_or(&photo.name);
        let mut keys =
            [photo.name.as_str(), without_suffix(&photo.name), file, without_suffix(file)];
        keys.sort_unstable();
        for (i, key) in keys.iter().enumerate() {
            if i == 0 || keys[i - 1] != *key {
                by_key.entry(key).or_default().push(index);
            }
        }
    }
    let mut listed = vec![false; photos.len()];
    for (line, name) in text.lines().enumerate() {
        let name = name.trim();
        if name.is_empty() || name.starts_with('#') {
            continue;
        }
        let place = |cause: String| format!("{cause} (line {}): {}", line + 1, path.display());
        match by_key.get(name).map(Vec::as_slice) {
            Some(&[only]) => listed[only] = true,
            Some(several) if several.iter().any(|&i| photos[i].name == name) => {
                several.iter().filter(|&&i| photos[i].name == name).for_each(|&i| listed[i] = true);
            }
            Some(several) => {
                let cause = place(format!("\"{name}\" could be {} photos", several.len()));
                return Err(IngestError::bad_input(
                    cause,
                    "write the name with its subfolder and suffix",
                ));
            }
            None => {
                let cause = place(format!("no posed photo is called \"{name}\""));
                let known = photos.iter().take(3).map(|p| p.name.as_str()).collect::<Vec<_>>();
                let remedy = format!("names look like {}", known.join(", "));
                return Err(IngestError::bad_input(cause, remedy));
            }
        }
    }
    if listed.contains(&true) {
        Ok(listed)
    } else {
        let cause = format!("the list names no photo: {}", path.display());
        Err(IngestError::bad_input(cause, "write one photo name per line"))
    }
}

fn without_suffix(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((stem, suffix)) if !suffix.contains('/') => stem,
        _ => name,
    }
}
