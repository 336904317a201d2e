//! What a file may become in memory: one guard for all readers, asked before room is made.
//!
//! Two bounds. A few bytes can stand for very much, so what a file unpacks to is compared with its length: data of cameras
//! and fits does not compress a hundredfold, and small flat files are granted. What passes is compared with the memory
//! that there is, or that the user allows.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{FormatError, Result};

/// Unpacked bytes of Gaussians that are granted to a file of any length.
const GRANTED_TO_ROWS: u64 = 32 << 20;
/// Unpacked bytes of pictures that are granted to a file of any length.
const GRANTED_TO_PICTURES: u64 = 48 << 20;
/// The same for codecs that need no bit for a pixel like the others: 50 megapixels of one color.
const GRANTED_TO_FLAT_PICTURES: u64 = 160 << 20;
/// What no fit and no camera reaches.
const MOST_COMPRESSION: u64 = 64;
/// The best ratio of deflate and of all codecs but lossless WebP: a picture of one color.
const MOST_DEFLATE: u64 = 1100;
/// Bytes up to which floats may be as flat as that: the planes of a renderer that hit nothing.
const FLAT_FLOATS: u64 = 256 << 20;

/// Bytes that a reader may take; all that are there when nobody says.
static MOST_BYTES: AtomicU64 = AtomicU64::new(u64::MAX);

/// Sets the memory that a reader may take for one file, in bytes.
pub fn limit_memory(bytes: u64) {
    MOST_BYTES.store(bytes, Ordering::Relaxed);
}

/// Checks that `unpacked` bytes of Gaussians can come from a file of `packed` bytes, and fit into the memory.
///
/// # Errors
/// They cannot, or do not.
pub fn rows(path: &Path, place: &str, what: &str, unpacked: u64, packed: u64) -> Result<()> {
    let most = GRANTED_TO_ROWS.saturating_add(packed.saturating_mul(MOST_COMPRESSION));
    plausible(path, place, what, unpacked, packed, most)?;
    memory(path, place, what, unpacked)
}

/// Checks that a picture, `unpacked` bytes in memory and `stored` as the file counts them, can come from a file of `packed`
/// bytes, and fits into the memory. `is_boundless` when its codec can leave out the bits of a flat one.
///
/// # Errors
/// It cannot, or does not.
pub fn picture(
    path: &Path,
    place: &str,
    what: &str,
    stored: u64,
    unpacked: u64,
    packed: u64,
    is_boundless: bool,
) -> Result<()> {
    let granted = if is_boundless { GRANTED_TO_FLAT_PICTURES } else { GRANTED_TO_PICTURES };
    let most_stored = granted.saturating_add(packed.saturating_mul(MOST_DEFLATE));
    // A pixel of one bit takes three bytes as RGB: not without bound either.
    let most = GRANTED_TO_FLAT_PICTURES.saturating_add(packed.saturating_mul(4 * MOST_DEFLATE));
    if stored > most_stored || unpacked > most {
        let cause = format!("the header promises {what}, which {packed} bytes cannot hold");
        return Err(implausible(path, place, cause));
    }
    // As the decoder has it, and as RGB.
    memory(path, place, what, unpacked.saturating_mul(2))
}

/// [`picture`] of floats, which have no few colors.
///
/// # Errors
/// They cannot, or do not.
pub fn floats(path: &Path, place: &str, what: &str, unpacked: u64, packed: u64) -> Result<()> {
    let flat = packed.saturating_mul(MOST_DEFLATE).min(FLAT_FLOATS);
    let most = GRANTED_TO_PICTURES + flat.max(packed.saturating_mul(MOST_COMPRESSION));
    plausible(path, place, what, unpacked, packed, most)?;
    // As the decoder has them, as channels, and as a picture.
    memory(path, place, what, unpacked.saturating_mul(3))
}

fn plausible(
    path: &Path,
    place: &str,
    what: &str,
    unpacked: u64,
    packed: u64,
    most: u64,
) -> Result<()> {
    if unpacked <= most {
        return Ok(());
    }
    let cause = format!("{what} take {unpacked} bytes, which {packed} bytes cannot hold");
    Err(implausible(path, place, cause))
}

fn implausible(path: &Path, place: &str, cause: String) -> FormatError {
    FormatError::invalid(path, place, cause)
        .with_remedy("the file is damaged, or was made to fill the memory: export it again")
}

/// Checks that `bytes` fit into the memory that there is, or that the user allows.
///
/// # Errors
/// They cannot, or do not.
pub fn memory(path: &Path, place: &str, what: &str, bytes: u64) -> Result<()> {
    let most = MOST_BYTES.load(Ordering::Relaxed);
    if bytes <= most {
        return Ok(());
    }
    let gib = |bytes: u64| bytes as f64 / f64::from(1 << 30);
    let cause = format!(
        "{what} take about {:.2} GiB of memory, and {:.2} GiB are available",
        gib(bytes),
        gib(most)
    );
    Err(FormatError::not_supported(path, place, cause)
        .with_remedy("make the file smaller, or allow more with --max-memory"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_files_unpack_to_little_and_large_ones_in_proportion() {
        let path = Path::new("a");
        assert!(rows(path, "", "rows", 16 << 20, 1000).is_ok());
        assert!(rows(path, "", "rows", 4 << 30, 1000).is_err());
        assert!(rows(path, "", "rows", 4 << 30, 1 << 30).is_ok());
        assert!(picture(path, "", "pixels", 3 << 20, 72 << 20, 3000, false).is_ok());
        assert!(picture(path, "", "pixels", 300 << 20, 300 << 20, 3000, false).is_err());
        assert!(picture(path, "", "pixels", 40 << 20, 960 << 20, 3000, false).is_err());
        assert!(picture(path, "", "pixels", 72 << 20, 72 << 20, 30, true).is_ok());
        assert!(picture(path, "", "pixels", 800 << 20, 800 << 20, 30, true).is_err());
        assert!(floats(path, "", "pixels", 120 << 20, 124_000).is_ok());
        assert!(floats(path, "", "pixels", 880 << 20, 800_000).is_err());
    }
}
