//! Answers on disk, named after everything that they depend on.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use motes_formats::documents::{read_document, to_pretty_json};
use motes_formats::provider::{ProviderDescription, ProviderReply, ProviderRequest};
use motes_formats::selection::{sha256_of_bytes, sha256_of_file};

use crate::ProviderError;
use crate::checks;

/// Kept answers take no more than this, bytes; those that were not used for the longest time go first.
const MOST_BYTES: u64 = 1 << 30;

/// A folder with an answer per folder.
pub(crate) struct Answers {
    folder: PathBuf,
    /// Who answers.
    by: String,
}

impl Answers {
    pub(crate) fn new(folder: &Path, description: &ProviderDescription) -> Self {
        Self { folder: folder.to_owned(), by: to_pretty_json(description) }
    }

    /// The name of the answer: SHA-256 of the request, what is in its files, and the provider with its models.
    pub(crate) fn key(
        &self,
        folder: &Path,
        request: &ProviderRequest,
    ) -> Result<String, ProviderError> {
        let mut text = to_pretty_json(request) + &self.by;
        for file in request.files(&folder.join("request.json"))? {
            text += &sha256_of_file(&folder.join(file))?;
        }
        Ok(sha256_of_bytes(text.as_bytes()))
    }

    /// Puts a kept answer beside the request; none when there is none, or one that is not whole any more.
    pub(crate) fn find(
        &self,
        key: &str,
        folder: &Path,
        request: &ProviderRequest,
    ) -> Option<ProviderReply> {
        let kept = self.folder.join(key);
        let reply = read_document::<ProviderReply>(&kept.join("reply.json")).ok()?.document;
        checks::check(folder, &kept, request, &reply).ok()?;
        for file in reply.files(&kept.join("reply.json")).ok()? {
            fs::create_dir_all(folder.join(&file).parent()?).ok()?;
            fs::copy(kept.join(&file), folder.join(&file)).ok()?;
        }
        fs::copy(kept.join("reply.json"), folder.join("reply.json")).ok()?;
        // What is used stays longest; a folder that cannot be written is used all the same.
        let file = fs::File::options().append(true).open(kept.join("reply.json"));
        let _ = file.and_then(|file| file.set_modified(SystemTime::now()));
        Some(reply)
    }

    /// Keeps an answer. Where that fails nothing is kept: the run has its answer.
    pub(crate) fn keep(&self, key: &str, folder: &Path, reply: &ProviderReply) {
        let kept = || -> Option<()> {
            fs::create_dir_all(&self.folder).ok()?;
            let draft = tempfile::Builder::new().prefix(".draft-").tempdir_in(&self.folder).ok()?;
            for file in reply.files(&folder.join("reply.json")).ok()? {
                fs::create_dir_all(draft.path().join(&file).parent()?).ok()?;
                fs::copy(folder.join(&file), draft.path().join(&file)).ok()?;
            }
            fs::copy(folder.join("reply.json"), draft.path().join("reply.json")).ok()?;
            let place = self.folder.join(key);
            // One that is not whole any more.
            let _ = fs::remove_dir_all(&place);
            fs::rename(draft.path(), place).ok()
        };
        if kept().is_none() {
            tracing::debug!("the answer could not be kept in {}", self.folder.display());
        }
        prune(&self.folder, MOST_BYTES);
    }
}

/// Removes the answers that were not used for the longest time until `most` bytes are left. What cannot be removed stays.
fn prune(folder: &Path, most: u64) {
    let mut answers = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let files = fs::read_dir(entry.path()).into_iter().flatten().flatten();
        let bytes =
            files.filter_map(|file| file.metadata().ok()).map(|meta| meta.len()).sum::<u64>();
        let used = fs::metadata(entry.path().join("reply.json")).and_then(|meta| meta.modified());
        if let Ok(used) = used {
            answers.push((used, entry.path(), bytes));
        }
    }
    answers.sort_by(|a, b| b.cmp(a));
    let mut sum = 0u64;
    for (_, path, bytes) in answers {
        sum = sum.saturating_add(bytes);
        if sum > most {
            let _ = fs::remove_dir_all(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_used_for_the_longest_time_goes_first() {
        let folder = tempfile::tempdir().unwrap();
        for (k, name) in ["old", "new"].iter().enumerate() {
            let answer = folder.path().join(name);
            fs::create_dir(&answer).unwrap();
            fs::write(answer.join("reply.json"), [0; 100]).unwrap();
            let used = SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(1000 * k as u64);
            let file = fs::File::options().append(true).open(answer.join("reply.json")).unwrap();
            file.set_modified(used).unwrap();
        }
        let left = || fs::read_dir(folder.path()).unwrap().count();
        prune(folder.path(), 200);
        assert_eq!(left(), 2);
        prune(folder.path(), 150);
        assert_eq!(left(), 1);
        assert!(folder.path().join("new").exists());
    }
}
