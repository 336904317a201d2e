//! Files and folders under names that nobody else uses: gone at the end, after an interruption, and, when the program
//! was killed, at the next run.
//!
//! A living program holds a lock on what it works at. What has such a name and no lock was left by a killed one.

use std::collections::HashSet;
use std::fs::{File, Permissions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

const PREFIX: &str = ".motes-";
const SUFFIX: &str = ".tmp";

#[derive(Default)]
struct Known {
    /// Of this process, not finished.
    unfinished: HashSet<PathBuf>,
    /// Folders that were looked through.
    swept: HashSet<PathBuf>,
}

static KNOWN: LazyLock<Mutex<Known>> = LazyLock::new(Mutex::default);

fn lock() -> MutexGuard<'static, Known> {
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

fn builder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    builder
}

/// Names what is to be removed when the process ends without unwinding.
#[derive(Debug)]
struct Unfinished(PathBuf);

impl Unfinished {
    fn new(path: &Path) -> Self {
        lock().unfinished.insert(path.to_owned());
        Self(path.to_owned())
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        lock().unfinished.remove(&self.0);
    }
}

/// A file that is not finished.
pub(super) struct Temporary {
    file: tempfile::NamedTempFile,
    _unfinished: Unfinished,
}

impl Temporary {
    pub(super) fn file_in(folder: &Path) -> io::Result<Self> {
        remove_stale(folder);
        let mut builder = builder();
        // Temporary files are private by default; a product is as readable as the umask says.
        #[cfg(unix)]
        builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
        loop {
            let file = builder.tempfile_in(folder)?;
            if !hold(file.as_file(), file.path()) {
                // Between its making and its lock another program took it for a left one.
                continue;
            }
            let unfinished = Unfinished::new(file.path());
            return Ok(Self { file, _unfinished: unfinished });
        }
    }

    pub(super) fn as_file_mut(&mut self) -> &mut File {
        self.file.as_file_mut()
    }

    pub(super) fn persist(self, to: &Path) -> io::Result<()> {
        self.file.persist(to).map(drop).map_err(|error| error.error)
    }

    pub(super) fn persist_noclobber(self, to: &Path) -> io::Result<()> {
        self.file.persist_noclobber(to).map(drop).map_err(|error| error.error)
    }
}

/// A folder that is not finished, or for what only this process needs; removed when it is dropped.
#[derive(Debug)]
pub struct ScratchFolder {
    folder: tempfile::TempDir,
    _held: Option<File>,
    _unfinished: Unfinished,
}

impl ScratchFolder {
    /// A new folder in the system's place for temporary files.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn new() -> io::Result<Self> {
        Self::new_in(&std::env::temp_dir())
    }

    pub(super) fn new_in(folder: &Path) -> io::Result<Self> {
        remove_stale(folder);
        let mut builder = builder();
        #[cfg(unix)]
        builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o777));
        loop {
            let folder = builder.tempdir_in(folder)?;
            let held = match File::open(folder.path()) {
                Ok(held) if hold(&held, folder.path()) => Some(held),
                // As a file above.
                Ok(_) => continue,
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                // Not every system opens folders; there nobody takes one for left.
                Err(_) => None,
            };
            let unfinished = Unfinished::new(folder.path());
            return Ok(Self { folder, _held: held, _unfinished: unfinished });
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Gives the folder its name.
    pub(super) fn rename(&self, to: &Path) -> io::Result<()> {
        std::fs::rename(self.folder.path(), to)
    }
}

/// Locks a file or folder that was just made; false when it is gone already. Where the disk knows no locks, nobody
/// takes anything for left.
fn hold(file: &File, path: &Path) -> bool {
    let _ = file.lock();
    // Not by its count of links, which some file systems keep at one for folders.
    path.symlink_metadata().is_ok()
}

/// Removes what killed programs left unfinished in a folder. Looks once per run: folders of pictures are large.
pub fn remove_stale(folder: &Path) {
    if lock().swept.insert(folder.to_owned()) {
        sweep(folder);
    }
}

fn sweep(folder: &Path) {
    #[cfg(unix)]
    {
        let Ok(entries) = std::fs::read_dir(folder) else { return };
        for entry in entries.flatten() {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            let Ok(kind) = entry.file_type() else { continue };
            if !name.starts_with(PREFIX) || !name.ends_with(SUFFIX) || kind.is_symlink() {
                continue;
            }
            let path = entry.path();
            // A pipe would block.
            if !kind.is_file() && !kind.is_dir() {
                continue;
            }
            let Ok(left) = File::open(&path) else { continue };
            if left.try_lock().is_err() {
                continue;
            }
            // Removed under the lock, so that a program that has just made it sees that it is gone.
            // What cannot be removed is another user's.
            let _ = match kind.is_dir() {
                true => std::fs::remove_dir_all(&path),
                false => std::fs::remove_file(&path),
            };
        }
    }
    #[cfg(not(unix))]
    let _ = folder;
}

/// Checks that a folder can be written into.
///
/// # Errors
/// What the operating system says.
pub fn can_write_into(folder: &Path) -> io::Result<()> {
    Temporary::file_in(folder).map(drop)
}

/// Removes what this process has not finished: to be called before it ends without unwinding.
pub fn remove_unfinished() {
    for path in lock().unfinished.drain() {
        // Already gone is fine.
        let _ = if path.is_dir() {
            std::fs::remove_dir_all(&path)
        } else {
            std::fs::remove_file(&path)
        };
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    /// Another program may look through a folder at any moment between the making of a scratch folder and its lock.
    #[test]
    fn a_scratch_folder_survives_programs_that_look_for_left_ones() {
        let place = tempfile::tempdir().unwrap();
        let done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !done.load(Ordering::Relaxed) {
                    sweep(place.path());
                }
            });
            let gone = (0..3000).find(|_| {
                let Ok(scratch) = ScratchFolder::new_in(place.path()) else { return true };
                let file = scratch.path().join("a");
                std::fs::write(&file, "x").is_err() || std::fs::read(&file).is_err()
            });
            done.store(true, Ordering::Relaxed);
            assert_eq!(gone, None);
        });
    }
}
