//! Folders whose files belong together.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use super::temporary::ScratchFolder;
use super::{claims, folder_of, taken_meanwhile, write_error};
use crate::error::Result;

/// A folder of files that belong together, made apart and put in place at once.
///
/// Where nothing is, the folder appears by one rename. Where a folder is, its document goes first, the other files are
/// replaced, and the new document comes last, all under a lock: whoever reads finds files of one run, or no document.
/// Files that are not of the draft stay.
#[derive(Debug)]
pub struct FolderDraft {
    target: PathBuf,
    document: PathBuf,
    temporary: ScratchFolder,
}

impl FolderDraft {
    /// A draft of the folder `target`, which is whole when the file `document` is in it.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn new(target: &Path, document: &str) -> Result<Self> {
        let refused = |error| write_error(target, error);
        let beside = folder_of(target);
        std::fs::create_dir_all(beside).map_err(refused)?;
        // Inside of a folder that is there: it may be another disk than the folder that it is in.
        let place = if target.is_dir() { target } else { beside };
        let temporary = ScratchFolder::new_in(place).map_err(refused)?;
        Ok(Self { target: target.to_owned(), document: document.into(), temporary })
    }

    /// Where to write the files.
    pub fn path(&self) -> &Path {
        self.temporary.path()
    }

    /// Puts the files in place.
    ///
    /// # Errors
    /// What the operating system says; something is there that must not be replaced: then nothing is.
    pub fn publish(self) -> Result<()> {
        let refused = |error| write_error(&self.target, error);
        if !self.target.exists() && self.temporary.rename(&self.target).is_ok() {
            claims::made(&self.target);
            return Ok(());
        }
        std::fs::create_dir_all(&self.target).map_err(refused)?;
        let held = File::open(&self.target).ok();
        if let Some(held) = &held {
            // Where the disk knows no locks, two programs at once are not kept apart.
            let _ = held.lock();
        }
        let mut files = Vec::new();
        list(self.path(), Path::new(""), &mut files).map_err(refused)?;
        let document = self.target.join(&self.document);
        for place in files.iter().map(|file| self.target.join(file)) {
            let kept = claims::must_stay_free(&place) || claims::must_stay_free(&document);
            if kept && place.symlink_metadata().is_ok() {
                return Err(taken_meanwhile(&place));
            }
        }
        match std::fs::remove_file(&document) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(refused(error)),
            _ => {}
        }
        files.sort_by_key(|file| *file == self.document);
        for file in files {
            let to = self.target.join(&file);
            std::fs::create_dir_all(folder_of(&to)).map_err(refused)?;
            std::fs::rename(self.path().join(&file), &to).map_err(|e| write_error(&to, e))?;
            claims::made(&to);
        }
        Ok(())
    }
}

/// Files below a folder.
fn list(folder: &Path, below: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in std::fs::read_dir(folder.join(below))? {
        let entry = entry?;
        let name = below.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            list(folder, &name, files)?;
        } else {
            files.push(name);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draft(target: &Path, text: &str) -> FolderDraft {
        let draft = FolderDraft::new(target, "document.json").unwrap();
        std::fs::create_dir(draft.path().join("sub")).unwrap();
        for name in ["a", "sub/b", "document.json"] {
            std::fs::write(draft.path().join(name), text).unwrap();
        }
        draft
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut files = Vec::new();
        list(folder, Path::new(""), &mut files).unwrap();
        let mut names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_folder_appears_at_once_or_is_replaced_file_by_file() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("new/scene");
        let first = draft(&target, "1");
        assert!(!target.exists());
        first.publish().unwrap();
        std::fs::write(target.join("mine"), "kept").unwrap();
        draft(&target, "2").publish().unwrap();
        assert_eq!(names(&target), ["a", "document.json", "mine", "sub/b"]);
        assert_eq!(std::fs::read_to_string(target.join("sub/b")).unwrap(), "2");
        drop(draft(&target, "3"));
        assert_eq!(names(target.parent().unwrap()).len(), 4, "an abandoned draft leaves nothing");
    }

    #[test]
    fn what_was_claimed_free_is_not_replaced() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("scene");
        claims::claim_free(&target);
        let (mine, theirs) = (draft(&target, "mine"), dir.path().join("scene"));
        std::fs::create_dir(&theirs).unwrap();
        std::fs::write(theirs.join("a"), "theirs").unwrap();
        assert!(mine.publish().is_err());
        assert_eq!(names(dir.path()), ["scene/a"]);
        assert_eq!(std::fs::read_to_string(theirs.join("a")).unwrap(), "theirs");
    }

    #[test]
    fn writers_of_one_folder_never_mix() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("scene");
        for _ in 0..20 {
            let drafts: Vec<FolderDraft> =
                ["1", "2", "3"].map(|text| draft(&target, text)).into_iter().collect();
            std::thread::scope(|scope| {
                drafts.into_iter().for_each(|d| drop(scope.spawn(|| d.publish().unwrap())));
            });
            let texts: std::collections::BTreeSet<String> = ["a", "sub/b", "document.json"]
                .map(|name| std::fs::read_to_string(target.join(name)).unwrap())
                .into();
            assert_eq!(texts.len(), 1, "{texts:?}");
        }
    }
}
