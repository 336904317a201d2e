//! SHA-256 of inputs, for the run record.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

/// Hex SHA-256 of a file, or of a folder as `sha256sum` over its sorted files would list it:
/// one `HASH␠␠RELATIVE/PATH` line per file.
pub(crate) fn of_path(path: &Path) -> io::Result<String> {
    if !path.is_dir() {
        return of_reader(File::open(path)?);
    }
    let mut files = Vec::new();
    collect(path, &mut files)?;
    files.sort();
    let mut listing = String::new();
    for file in files {
        let name = file.strip_prefix(path).unwrap_or(&file).to_string_lossy().replace('\\', "/");
        listing.push_str(&format!("{}  {name}\n", of_reader(File::open(&file)?)?));
    }
    of_reader(listing.as_bytes())
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        // `file_type` does not follow links, so a link to a parent cannot loop.
        if entry.file_type()?.is_dir() {
            collect(&entry.path(), files)?;
        } else if entry.path().is_file() {
            files.push(entry.path());
        }
    }
    Ok(())
}

fn of_reader(mut reader: impl Read) -> io::Result<String> {
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        let count = reader.read(&mut buffer)?;
        if count == 0 {
            break;
        }
        hasher.update(&buffer[..count]);
    }
    Ok(hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_hashes_as_published() {
        // FIPS 180-2, appendix B.1.
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(of_reader(&b"abc"[..]).unwrap(), expected);
    }

    #[test]
    fn a_folder_hash_sees_names_and_contents() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("sub")).unwrap();
        std::fs::write(dir.path().join("b"), "1").unwrap();
        std::fs::write(dir.path().join("sub/a"), "2").unwrap();
        let first = of_path(dir.path()).unwrap();
        assert_eq!(first, of_path(dir.path()).unwrap());
        std::fs::rename(dir.path().join("b"), dir.path().join("c")).unwrap();
        let renamed = of_path(dir.path()).unwrap();
        std::fs::write(dir.path().join("sub/a"), "3").unwrap();
        assert!(first != renamed && renamed != of_path(dir.path()).unwrap());
    }
}
