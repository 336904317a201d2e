//! Rows encoded in parallel, written in order.

use std::io::{self, Write};
use std::ops::Range;
use std::path::Path;

use motes_scene::Gaussians;
use rayon::prelude::*;

use motes_formats::budget;
use motes_formats::error::Result;

/// Rows of one task.
const ROWS_PER_BLOCK: usize = 4096;
/// Blocks that are in memory before they are written: bounds what streaming takes.
const BLOCKS_PER_BATCH: usize = 16;

/// Appends the bytes of rows with `encode`, which gets ranges of at most some thousand rows.
pub(crate) fn write_blocks(
    writer: &mut dyn Write,
    rows: usize,
    encode: impl Fn(Range<usize>, &mut Vec<u8>) + Sync,
) -> io::Result<()> {
    let mut blocks: Vec<Vec<u8>> = vec![Vec::new(); BLOCKS_PER_BATCH];
    for start in (0..rows).step_by(ROWS_PER_BLOCK * BLOCKS_PER_BATCH) {
        blocks.par_iter_mut().enumerate().for_each(|(i, block)| {
            block.clear();
            let from = (start + i * ROWS_PER_BLOCK).min(rows);
            encode(from..(from + ROWS_PER_BLOCK).min(rows), block);
        });
        for block in &blocks {
            writer.write_all(block)?;
        }
    }
    Ok(())
}

/// Bytes of a Gaussian in memory.
pub(crate) fn row_bytes(sh_degree: u8) -> u64 {
    let coefficients = (u64::from(sh_degree) + 1).pow(2);
    4 * (3 + 4 + 3 + 1 + 3 * coefficients)
}

/// Checks that so many Gaussians can come from a file of `packed` bytes, and fit into the memory.
pub(crate) fn check_rows(
    path: &Path,
    place: &str,
    rows: u64,
    sh_degree: u8,
    packed: usize,
) -> Result<()> {
    let what = format!("{rows} Gaussians of SH degree {sh_degree}");
    budget::rows(path, place, &what, rows.saturating_mul(row_bytes(sh_degree)), packed as u64)
}

/// Empty Gaussians with room for rows whose bytes were seen.
pub(crate) fn with_room(rows: usize, sh_degree: u8) -> Gaussians {
    let coefficients = (usize::from(sh_degree) + 1).pow(2);
    Gaussians {
        means: Vec::with_capacity(rows),
        rotations: Vec::with_capacity(rows),
        log_scales: Vec::with_capacity(rows),
        opacity_logits: Vec::with_capacity(rows),
        sh_degree,
        sh: Vec::with_capacity(rows * coefficients * 3),
        extra: Vec::new(),
    }
}
