//! The container of a binary glTF: a header, a JSON chunk, a binary chunk.

use std::path::Path;

use super::super::bytes::Bytes;
use motes_formats::error::{FormatError, Result};

const JSON_CHUNK: u32 = 0x4e4f_534a;
const BINARY_CHUNK: u32 = 0x004e_4942;

/// The JSON and the binary chunk.
pub(super) fn split<'a>(data: &'a [u8], path: &'a Path) -> Result<(&'a [u8], &'a [u8])> {
    let mut bytes = Bytes::new(data, path);
    bytes.take(4, "the magic number")?;
    let version = bytes.u32("the version")?;
    if version != 2 {
        let cause = format!("binary glTF of version {version}; version 2 is known");
        return Err(FormatError::not_supported(path, "byte 4", cause));
    }
    let length = bytes.u32("the length")?;
    if length as usize > data.len() {
        let cause = format!("the header promises {length} bytes, the file has {}", data.len());
        return Err(FormatError::invalid(path, "byte 8", cause)
            .with_remedy("the file is incomplete: copy or export it again"));
    }
    let (mut json, mut binary) = (None, &[][..]);
    while bytes.left() >= 8 {
        let size = bytes.u32("a chunk")?;
        let kind = bytes.u32("a chunk")?;
        let chunk = bytes.take(u64::from(size), "the chunk")?;
        match kind {
            JSON_CHUNK if json.is_none() => json = Some(chunk),
            BINARY_CHUNK if binary.is_empty() => binary = chunk,
            _ => {} // others must be passed over
        }
    }
    let missing = || FormatError::invalid(path, "byte 12", "there is no JSON chunk");
    Ok((json.ok_or_else(missing)?, binary))
}

/// What precedes the binary chunk of `binary_bytes` bytes, a multiple of 4. `None` when the file would
/// be larger than its header can say.
pub(super) fn head(json: &[u8], binary_bytes: u64) -> Option<Vec<u8>> {
    let padded = json.len().next_multiple_of(4);
    let total = u32::try_from(12 + 8 + padded as u64 + 8 + binary_bytes).ok()?;
    let mut head = Vec::with_capacity(padded + 28);
    head.extend(super::MAGIC);
    for value in [2, total, padded as u32, JSON_CHUNK] {
        head.extend(value.to_le_bytes());
    }
    head.extend(json);
    head.resize(20 + padded, b' ');
    for value in [binary_bytes as u32, BINARY_CHUNK] {
        head.extend(value.to_le_bytes());
    }
    Some(head)
}
