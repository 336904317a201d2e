//! Files appear whole or not at all.

use std::fs::{File, Permissions};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::error::{FormatError, Result};

/// Writes a file under a temporary name in the folder of `path`, then renames it, so that no
/// reader ever sees a part and an interrupted run leaves the old file as it was.
///
/// Missing folders are made. Something that is no regular file (`/dev/null`, a pipe) is written
/// in place: renaming would replace the device.
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
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(refused)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".motes-").suffix(".tmp");
    // Temporary files are private by default; a product is as readable as the umask says.
    #[cfg(unix)]
    builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
    let mut temporary = builder.tempfile_in(folder).map_err(refused)?;
    let mut writer = BufWriter::with_capacity(1 << 20, temporary.as_file_mut());
    write(&mut writer)?;
    writer.flush().map_err(refused)?;
    drop(writer);
    temporary.persist(path).map_err(|error| refused(error.error))?;
    Ok(())
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
