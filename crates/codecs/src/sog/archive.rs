//! Files by name: from a zip archive in memory, or from a folder.

use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use motes_formats::capture::checked_relative_path;
use motes_formats::error::{FormatError, Result};

/// Largest file of an archive; images of a hundred million Gaussians stay below it.
const MOST_BYTES: u64 = 1 << 30;
/// What a file of an archive may unpack to, per byte of the archive: images are packed already.
const MOST_PER_BYTE: u64 = 64;
/// Whatever the length of the archive.
const GRANTED_BYTES: u64 = 1 << 20;
/// Files that an archive may list; a SOG has eight.
const MOST_FILES: usize = 4096;

pub(super) enum Archive<'a> {
    Zip(Box<ZipArchive<Cursor<&'a [u8]>>>, &'a Path, u64),
    Folder(PathBuf),
}

impl<'a> Archive<'a> {
    pub(super) fn open(data: &'a [u8], path: &'a Path) -> Result<Self> {
        let archive =
            ZipArchive::new(Cursor::new(data)).map_err(|error| broken(path, "", &error))?;
        if archive.len() > MOST_FILES {
            let cause = format!("the archive lists {} files, a SOG has eight", archive.len());
            return Err(FormatError::invalid(path, "zip directory", cause));
        }
        let most = GRANTED_BYTES + MOST_PER_BYTE * data.len() as u64;
        Ok(Self::Zip(Box::new(archive), path, most.min(MOST_BYTES)))
    }

    pub(super) fn read(&mut self, name: &str) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        match self {
            Self::Zip(archive, path, most) => {
                let file = archive.by_name(name).map_err(|error| match error {
                    zip::result::ZipError::FileNotFound => {
                        FormatError::invalid(&path, "", format!("the archive has no file {name}"))
                            .with_remedy("this zip archive is not a SOG file, or it is incomplete")
                    }
                    error => broken(path, name, &error),
                })?;
                // Grows as bytes arrive, whatever the directory says.
                file.take(*most).read_to_end(&mut bytes).map_err(|error| {
                    FormatError::invalid(&path, name, format!("cannot be unpacked: {error}"))
                })?;
            }
            Self::Folder(folder) => {
                let at =
                    folder.join(checked_relative_path(&folder.join("meta.json"), "files", name)?);
                bytes = std::fs::read(&at).map_err(|error| FormatError::io(&at, error))?;
            }
        }
        Ok(bytes)
    }
}

fn broken(path: &Path, place: &str, error: &zip::result::ZipError) -> FormatError {
    FormatError::invalid(path, place, format!("the zip archive cannot be read: {error}"))
        .with_remedy("the file is incomplete or was damaged: copy or export it again")
}

/// An archive of files that are compressed already.
pub(super) fn pack(files: &[(&str, Vec<u8>)]) -> std::io::Result<Vec<u8>> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    // A fixed date: the same Gaussians give the same bytes.
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for (name, bytes) in files {
        archive.start_file(*name, options)?;
        archive.write_all(bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}
