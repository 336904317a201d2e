//! One way in: the format follows from the first bytes, and from the name where they say nothing.

use std::fs::File;
use std::io::{Read, stdin};
use std::path::Path;

use motes_scene::Gaussians;

use super::registry::Input;
use super::{CODECS, SplatFormat, compressed_ply, r3dg, sog};
use motes_formats::error::{FormatError, Result};
use motes_formats::ply::{GaussianFile, PlySource};
use motes_formats::standard_stream::is_standard_stream;

/// Bytes that tell formats apart.
const MAGIC_BYTES: u64 = 8;

/// Reads Gaussians of any [format](CODECS) that can be read; `-` is standard input.
///
/// Materials of Relightable3DGaussian arrive activated, as [`motes_scene::Materials`].
///
/// # Errors
/// The file cannot be read, is of no known format, or is malformed.
pub fn open_gaussians(path: &Path) -> Result<GaussianFile> {
    if is_standard_stream(path) {
        return of_stream(stdin().lock(), Path::new("standard input"));
    }
    let io = |error| FormatError::io(path, error);
    let mut file = File::open(path).map_err(io)?;
    let metadata = file.metadata().map_err(io)?;
    if metadata.is_dir() {
        return Err(FormatError::invalid(path, "", "this is a folder, not a file of Gaussians"));
    }
    let start = first_bytes(&mut file, path)?;
    let format = format_of(&start, path)?;
    if format == SplatFormat::Ply && metadata.is_file() {
        // Mapped; what is not a regular file cannot be opened twice.
        drop(file);
        return Ok(activated(read_ply(PlySource::open(path)?)?));
    }
    let rest = start.as_slice().chain(file);
    if format == SplatFormat::Sog && !sog::is_archive(&start) {
        let document = read_whole(rest, path)?;
        return Ok(activated(sog::read_folder(&document, path)?));
    }
    read_stream(format, rest, path)
}

/// Gaussians of any format but a folder's; `name` stands for the stream in errors.
fn of_stream(mut reader: impl Read, name: &Path) -> Result<GaussianFile> {
    let start = first_bytes(&mut reader, name)?;
    read_stream(format_of(&start, name)?, start.as_slice().chain(reader), name)
}

fn read_stream(format: SplatFormat, reader: impl Read, name: &Path) -> Result<GaussianFile> {
    let opened = match format {
        SplatFormat::Ply => read_ply(PlySource::stream(reader, name)?)?,
        _ => read_with(format, &read_whole(reader, name)?, name)?,
    };
    Ok(activated(opened))
}

fn first_bytes(reader: impl Read, name: &Path) -> Result<Vec<u8>> {
    read_whole(reader.take(MAGIC_BYTES), name)
}

fn read_whole(mut reader: impl Read, name: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    reader.read_to_end(&mut bytes).map_err(|error| FormatError::io(name, error))?;
    Ok(bytes)
}

fn activated(mut opened: GaussianFile) -> GaussianFile {
    if r3dg::is_r3dg(&opened.gaussians) {
        r3dg::activate(&mut opened.gaussians);
    }
    opened
}

/// Reads Gaussians of any format: [`open_gaussians`] without what else the file says.
///
/// # Errors
/// As [`open_gaussians`].
pub fn read_gaussians(path: &Path) -> Result<Gaussians> {
    open_gaussians(path).map(|file| file.gaussians)
}

/// Reads Gaussians of a known format from memory; `name` stands for the file in errors.
///
/// # Errors
/// As [`open_gaussians`].
pub fn read_gaussians_from(format: SplatFormat, bytes: &[u8], name: &Path) -> Result<GaussianFile> {
    read_with(format, bytes, name)
}

fn read_with(format: SplatFormat, bytes: &[u8], path: &Path) -> Result<GaussianFile> {
    match format.codec().read {
        Input::Ply => read_ply(PlySource::stream(bytes, path)?),
        Input::Bytes(read) => read(bytes, path),
        Input::None => {
            let cause = format!("{} is written, but not read", format.codec().name);
            Err(FormatError::not_supported(path, "", cause).with_remedy(readable()))
        }
    }
}

/// A PLY file in either of its two layouts.
fn read_ply(mut source: PlySource<'_>) -> Result<GaussianFile> {
    if !compressed_ply::is_compressed(&source.header) {
        return source.read();
    }
    let gaussians = compressed_ply::read_compressed(
        &source.header,
        &mut *source.reader,
        source.path,
        source.bytes,
    )?;
    Ok(GaussianFile::new(gaussians, source.header.comments))
}

fn format_of(start: &[u8], path: &Path) -> Result<SplatFormat> {
    if let Some(format) = SplatFormat::ALL.iter().find(|format| (format.codec().starts)(start)) {
        return Ok(*format);
    }
    let is_meta = || path.file_name().is_some_and(|name| name == "meta.json");
    if start.starts_with(b"{") && is_meta() {
        return Ok(SplatFormat::Sog);
    }
    match SplatFormat::of_name(path) {
        // A text file of that name, or one that lost its start: its reader says what is wrong.
        Some(SplatFormat::CompressedPly) => Ok(SplatFormat::Ply),
        Some(format) => Ok(format),
        None if start.is_empty() => Err(FormatError::invalid(path, "byte 0", "the file is empty")),
        None => {
            // A plan of somebody else may name any file: what is in it stays there.
            let cause = "not a known format of Gaussians";
            Err(FormatError::not_supported(path, "byte 0", cause).with_remedy(readable()))
        }
    }
}

fn readable() -> String {
    let names = CODECS.iter().filter(|codec| codec.is_readable()).map(|codec| codec.name);
    format!("formats that can be read: {}", names.collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::some;
    use crate::{SplatWriteOptions, write_gaussians_to};

    #[test]
    fn a_stream_is_read_as_the_file_is() {
        let gaussians = some(40, 1);
        for format in [SplatFormat::Ply, SplatFormat::Spz, SplatFormat::CompressedPly] {
            let (mut bytes, options) = (Vec::new(), SplatWriteOptions::default());
            let name = Path::new("standard input");
            write_gaussians_to(&mut bytes, format, &gaussians, &options, name).unwrap();
            let streamed = of_stream(bytes.as_slice(), name).unwrap();
            let read = read_with(format, &bytes, name).unwrap();
            assert_eq!((streamed.gaussians.len(), &streamed.gaussians), (40, &read.gaussians));
        }
        let error = of_stream(&b"nothing known"[..], Path::new("standard input")).unwrap_err();
        assert!(error.to_string().contains("standard input"), "{error}");
    }
}
