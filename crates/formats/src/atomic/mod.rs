//! Files and folders appear whole or not at all, and replace nothing that nobody gave up.

mod claims;
mod draft;
mod temporary;

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

pub use claims::claim_free;
pub use draft::FolderDraft;
pub use temporary::{ScratchFolder, can_write_into, remove_stale, remove_unfinished};

use crate::error::{FormatError, Result};
use temporary::Temporary;

/// Writes a file under a temporary name in the folder of `path`, then renames it, so that no
/// reader ever sees a part and an interrupted run leaves the old file as it was.
///
/// Missing folders are made. Something that is not a regular file (`/dev/null`, a pipe) is written
/// in place: renaming would replace the device. A place that was [claimed free](claim_free) and
/// is taken by then is left alone.
///
/// # Errors
/// Whatever the operating system refuses; the temporary file is removed.
pub fn write_atomic(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<()> {
    write_checked(path, |writer| write(writer).map_err(|error| write_error(path, error)))
}

/// [`write_atomic`] for writers that find faults of their own.
pub fn write_checked(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    let refused = |error| write_error(path, error);
    if std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir()) {
        let mut writer = BufWriter::new(File::options().write(true).open(path).map_err(refused)?);
        write(&mut writer)?;
        return writer.flush().map_err(refused);
    }
    let folder = folder_of(path);
    std::fs::create_dir_all(folder).map_err(refused)?;
    let mut temporary = Temporary::file_in(folder).map_err(refused)?;
    let mut writer = BufWriter::with_capacity(1 << 20, temporary.as_file_mut());
    write(&mut writer)?;
    writer.flush().map_err(refused)?;
    drop(writer);
    let persisted = if claims::must_stay_free(path) {
        temporary.persist_noclobber(path)
    } else {
        temporary.persist(path)
    };
    persisted.map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => taken_meanwhile(path),
        _ => refused(error),
    })?;
    claims::made(path);
    Ok(())
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Somebody else put something where this program wanted to.
fn taken_meanwhile(path: &Path) -> FormatError {
    let text = "output exists by now, and was not replaced";
    let source = io::Error::new(io::ErrorKind::AlreadyExists, text);
    FormatError::Io { path: path.to_owned(), source }
}

/// An error of writing. It never has the kind `NotFound`, by which callers know a missing input,
/// and a short write is not a short input file.
pub fn write_error(path: &Path, source: io::Error) -> FormatError {
    let source = match source.kind() {
        io::ErrorKind::NotFound | io::ErrorKind::UnexpectedEof => io::Error::other(source),
        _ => source,
    };
    FormatError::Io { path: path.to_owned(), source }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("new folder/é.txt");
        write_atomic(&path, |w| w.write_all(b"old")).unwrap();
        let failed = write_atomic(&path, |w| {
            w.write_all(b"half")?;
            Err(io::Error::other("stopped"))
        });
        assert!(failed.is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
        write_atomic(&path, |w| w.write_all(b"new")).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
    }

    #[cfg(unix)]
    #[test]
    fn what_a_killed_program_left_is_removed_and_what_is_in_use_is_not() {
        let dir = tempfile::tempdir().unwrap();
        let left = dir.path().join(".motes-left.tmp");
        let used = dir.path().join(".motes-used.tmp");
        let mine = dir.path().join(".motes-notes.txt");
        for path in [&left, &used, &mine] {
            std::fs::write(path, "x").unwrap();
        }
        std::fs::create_dir(dir.path().join(".motes-folder.tmp")).unwrap();
        let holder = File::open(&used).unwrap();
        holder.lock().unwrap();
        write_atomic(&dir.path().join("a"), |w| w.write_all(b"1")).unwrap();
        let mut names: Vec<_> =
            std::fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, [".motes-notes.txt", ".motes-used.tmp", "a"]);
    }

    #[test]
    fn a_claimed_place_is_replaced_by_its_maker_only() {
        let dir = tempfile::tempdir().unwrap();
        let (path, other) = (dir.path().join("a"), dir.path().join("b"));
        claim_free(&path);
        claim_free(&other);
        std::fs::write(&other, "theirs").unwrap();
        for text in ["1", "2"] {
            write_atomic(&path, |w| w.write_all(text.as_bytes())).unwrap();
            assert!(write_atomic(&other, |w| w.write_all(text.as_bytes())).is_err());
        }
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "2");
        assert_eq!(std::fs::read_to_string(&other).unwrap(), "theirs");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn a_device_stays_a_device() {
        write_atomic(Path::new("/dev/null"), |w| w.write_all(b"x")).unwrap();
        assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
    }

    #[cfg(unix)]
    #[test]
    fn products_are_readable_by_others_as_the_umask_allows() {
        use std::os::unix::fs::PermissionsExt as _;
        let dir = tempfile::tempdir().unwrap();
        let (product, plain) = (dir.path().join("a"), dir.path().join("b"));
        write_atomic(&product, |_| Ok(())).unwrap();
        std::fs::write(&plain, "").unwrap();
        let mode = |p: &Path| std::fs::metadata(p).unwrap().permissions().mode();
        assert_eq!(mode(&product), mode(&plain));
    }

    #[test]
    fn an_unwritable_place_is_not_a_missing_input() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("file"), "").unwrap();
        let error = write_atomic(&dir.path().join("file/x"), |_| Ok(())).unwrap_err();
        let FormatError::Io { source, .. } = error else { panic!("{error}") };
        assert_ne!(source.kind(), io::ErrorKind::NotFound);
    }
}
