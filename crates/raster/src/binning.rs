//! Which Gaussians touch which tile, front to back.
//!
//! Every step is parallel and linear. Chunks of Gaussians list themselves per row of tiles; each
//! row gathers its lists in the order of the chunks, sorts them by depth (ties by index, so the
//! order is total), and lists them per tile. Every list is front to back because it is filled in
//! that order.

use fearless_simd::{Simd, dispatch, prelude::*};
use rayon::prelude::*;

use crate::options::TILE;
use crate::parameters::{RasterParameters, Sorting};
use crate::simd::BLOCK;
use crate::sort::sort_by_high_word;
use crate::spans::{BLOCK_ROWS, Columns, Shapes, Span, pack};
use crate::splat::Splat;

/// Gaussians per task: fixed, so that work splits the same way at any thread count.
pub(crate) const CHUNK: usize = 1024;

/// Visible Gaussians of a chunk per row of tiles that they reach.
#[derive(Clone, Debug, Default)]
pub(crate) struct ChunkLists {
    /// `ids[start[r]..start[r + 1]]` reach row `r`; ascending.
    start: Vec<u32>,
    ids: Vec<u32>,
    visible: usize,
}

impl ChunkLists {
    /// The Gaussians that reach row `r`.
    pub(crate) fn row(&self, r: usize) -> &[u32] {
        &self.ids[self.start[r] as usize..self.start[r + 1] as usize]
    }

    #[inline(always)]
    fn fill(&mut self, splats: &[Splat], first_id: usize, tile: usize, rows: usize) {
        self.start.clear();
        self.start.resize(rows + 2, 0);
        self.visible = 0;
        let ranges = || {
            let visible = splats.iter().enumerate().filter(|(_, splat)| splat.is_visible());
            visible.map(|(k, splat)| (k, row_range(splat, tile, rows)))
        };
        for (_, (first, last)) in ranges() {
            self.visible += 1;
            for r in first..last {
                self.start[r + 2] += 1;
            }
        }
        for r in 2..rows + 2 {
            self.start[r] += self.start[r - 1];
        }
        self.ids.clear();
        self.ids.resize(self.start[rows + 1] as usize, 0);
        // `start[r + 1]` runs from the start of row r to its end, where the next one starts.
        for (k, (first, last)) in ranges() {
            for slot in &mut self.start[first + 1..=last] {
                self.ids[*slot as usize] = (first_id + k) as u32;
                *slot += 1;
            }
        }
        self.start.pop();
    }
}

/// Work of one row of tiles. Everything its tiles read is packed here in depth order.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileRow {
    /// Gaussian index of each splat, front to back.
    pub(crate) ids: Vec<u32>,
    /// Packed copies.
    pub(crate) splats: Vec<Splat>,
    /// `entries[tile_start[t]..tile_start[t + 1]]` are the splats of tile `t`.
    tile_start: Vec<u32>,
    /// Indices into `splats`.
    pub(crate) entries: Vec<u32>,
    /// Where each splat went, in the order of chunks and indices.
    pub(crate) positions: Vec<u32>,
    /// `positions[segments[c]..segments[c + 1]]` belong to chunk `c`.
    pub(crate) segments: Vec<u32>,
    keys: Vec<u64>,
    spare: Vec<u64>,
    ranges: Vec<(u32, u32)>,
    /// Words of the [`Span`] of each splat, for each strip in the row.
    spans: [Vec<i32>; 2],
    cursor: Vec<u32>,
}

impl TileRow {
    /// Splats of tile `t`, front to back.
    pub(crate) fn tile(&self, t: usize) -> &[u32] {
        &self.entries[self.tile_start[t] as usize..self.tile_start[t + 1] as usize]
    }

    /// What each splat reaches in strip `k` of the row.
    pub(crate) fn spans(&self, k: usize) -> &[Span] {
        self.spans[k].as_chunks().0
    }

    /// As [`Self::tile`]; `None` past the right edge.
    pub(crate) fn tile_or_empty(&self, t: usize) -> Option<&[u32]> {
        (t + 1 < self.tile_start.len()).then(|| self.tile(t))
    }

    fn fill(&mut self, projected: &[Splat], chunks: &[ChunkLists], row: usize) {
        self.segments.clear();
        self.segments.push(0);
        self.keys.clear();
        self.ids.clear();
        for chunk in chunks {
            self.ids.extend_from_slice(chunk.row(row));
            self.segments.push(self.ids.len() as u32);
        }
        // Depths are positive, so their bits order like the numbers.
        let depth = |id: u32| u64::from(projected[id as usize].depth.to_bits());
        self.keys.extend(self.ids.iter().enumerate().map(|(k, &id)| depth(id) << 32 | k as u64));
        sort_by_high_word(&mut self.keys, &mut self.spare);
        self.positions.clear();
        self.positions.resize(self.ids.len(), 0);
        self.splats.clear();
        for (position, &key) in self.keys.iter().enumerate() {
            let k = key as u32 as usize;
            self.positions[k] = position as u32;
            self.splats.push(projected[self.ids[k] as usize]);
        }
        for key in &mut self.keys {
            *key = u64::from(self.ids[*key as u32 as usize]);
        }
        self.ids.clear();
        self.ids.extend(self.keys.iter().map(|&id| id as u32));
    }

    #[inline(always)]
    fn list_tiles<S: Simd>(&mut self, simd: S, row: usize, tile: usize, tiles_x: usize) {
        self.find_ranges(simd, row, tile, tiles_x);
        self.tile_start.clear();
        self.tile_start.resize(tiles_x + 1, 0);
        for &(first, last) in &self.ranges {
            for count in &mut self.tile_start[first as usize + 1..=last as usize] {
                *count += 1;
            }
        }
        for t in 0..tiles_x {
            self.tile_start[t + 1] += self.tile_start[t];
        }
        self.cursor.clone_from(&self.tile_start);
        self.entries.clear();
        self.entries.resize(self.tile_start[tiles_x] as usize, 0);
        for (i, &(first, last)) in self.ranges.iter().enumerate() {
            for slot in &mut self.cursor[first as usize..last as usize] {
                self.entries[*slot as usize] = i as u32;
                *slot += 1;
            }
        }
    }

    /// Fills [`Self::ranges`], half-open ranges of tile columns, and [`Self::spans`].
    #[inline(always)]
    fn find_ranges<S: Simd>(&mut self, simd: S, row: usize, tile: usize, tiles_x: usize) {
        let top = row * tile;
        let (strips, per_tile) = (tile.div_ceil(TILE), (tile / BLOCK) as f32);
        self.ranges.clear();
        self.spans.iter_mut().for_each(Vec::clear);
        for splats in self.splats.chunks(S::f32s::LEN) {
            let shapes = Shapes::gather(simd, splats);
            let mut all = Columns::none(simd);
            for (spans, strip) in self.spans[..strips].iter_mut().zip(top / TILE..) {
                let mut rows = [Columns::none(simd); BLOCK_ROWS];
                for (k, columns) in rows.iter_mut().enumerate() {
                    let y0 = strip * TILE + k * BLOCK;
                    // A row of small tiles is half of a strip.
                    if (top..top + tile).contains(&y0) {
                        let count = tiles_x * tile / BLOCK;
                        *columns = shapes.columns(simd, y0 as f32, count as f32);
                        all = all.hull(*columns);
                    }
                }
                spans.extend_from_slice(&pack(rows)[..BLOCK_ROWS * splats.len()]);
            }
            let end = (all.end + (per_tile - 1.0)) * per_tile.recip();
            let first = all.first * per_tile.recip();
            let ranges = first.as_slice().iter().zip(end.as_slice()).take(splats.len());
            let ranges = ranges.map(|(&first, &end)| (first as u32, end as u32));
            self.ranges.extend(ranges.map(|(first, end)| (first.min(end), end)));
        }
    }

    /// Sorts every tile's list by the depth on the ray through the tile's center.
    fn sort_tiles(&mut self, row: usize, tile: usize) {
        let y = (row as f32 + 0.5) * tile as f32;
        for t in 0..self.tile_start.len() - 1 {
            let x = (t as f32 + 0.5) * tile as f32;
            let list = self.tile_start[t] as usize..self.tile_start[t + 1] as usize;
            let depth = |e: u32| u64::from(self.splats[e as usize].depth_at(x, y).to_bits());
            self.keys.clear();
            self.keys
                .extend(self.entries[list.clone()].iter().map(|&e| depth(e) << 32 | u64::from(e)));
            // Entries ascend in global depth, which settles ties.
            sort_by_high_word(&mut self.keys, &mut self.spare);
            for (entry, &key) in self.entries[list].iter_mut().zip(&self.keys) {
                *entry = key as u32;
            }
        }
    }
}

/// The lists of one view.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bins {
    /// Pixels per side of a tile.
    pub(crate) tile: usize,
    pub(crate) rows: Vec<TileRow>,
    pub(crate) chunks: Vec<ChunkLists>,
}

impl Bins {
    /// Lists the projected Gaussians. Reuses memory.
    pub(crate) fn fill(
        &mut self,
        projected: &[Splat],
        size: [usize; 2],
        parameters: &RasterParameters,
    ) {
        let tile = parameters.tile_size as usize;
        let (tiles_x, tiles_y) = (size[0].div_ceil(tile), size[1].div_ceil(tile));
        self.tile = tile;
        self.chunks.resize_with(projected.len().div_ceil(CHUNK), ChunkLists::default);
        let chunks = self.chunks.par_iter_mut().zip(projected.par_chunks(CHUNK)).enumerate();
        chunks.with_max_len(4).for_each(|(c, (lists, splats))| {
            dispatch!(parameters.level(), _simd => lists.fill(splats, c * CHUNK, tile, tiles_y));
        });
        self.rows.resize_with(tiles_y, TileRow::default);
        let chunks = &self.chunks;
        self.rows.par_iter_mut().enumerate().with_max_len(1).for_each(|(r, row)| {
            row.fill(projected, chunks, r);
            dispatch!(parameters.level(), simd => row.list_tiles(simd, r, tile, tiles_x));
            if parameters.sort != Sorting::Global {
                row.sort_tiles(r, tile);
            }
        });
    }

    /// Gaussians on the image.
    pub(crate) fn visible(&self) -> usize {
        self.chunks.iter().map(|chunk| chunk.visible).sum()
    }

    /// Entries of all lists.
    pub(crate) fn entries(&self) -> usize {
        self.rows.iter().map(|row| row.entries.len()).sum()
    }

    /// The row and list of the tile that pixel `(x, y)` lies in; `None` outside the tiles.
    pub(crate) fn list_at(&self, x: usize, y: usize) -> Option<(&TileRow, &[u32])> {
        let row = self.rows.get(y / self.tile)?;
        Some((row, row.tile_or_empty(x / self.tile)?))
    }
}

/// Half-open range of the rows of tiles that a splat reaches.
#[inline(always)]
fn row_range(splat: &Splat, tile: usize, rows: usize) -> (usize, usize) {
    // First and last pixel center of a row of tiles are at 0.5 and tile - 0.5.
    let scale = (tile as f32).recip();
    let first = (splat.y - splat.half_height - 0.5) * scale;
    let last = (splat.y + splat.half_height - 0.5) * scale;
    // Conversions saturate and cut off, and tiles are powers of two: scaling is exact.
    let first = (first.max(0.0) as usize).min(rows);
    let last = if last >= 0.0 { (last as usize + 1).min(rows) } else { 0 };
    (first.min(last), last)
}

#[cfg(test)]
mod tests;
