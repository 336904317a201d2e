//! Which Gaussians touch which tile, front to back.
//!
//! Visible Gaussians are sorted by depth once (ties by index, so the order is total), handed to
//! the bands of 16 rows they reach, and each band lists them per tile. Every list is front to
//! back because it is filled in that order.

use rayon::prelude::*;

use crate::options::TILE;
use crate::project::Splat;

/// Work of one row of tiles. Everything a band's tiles read is packed here in depth order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Band {
    /// Gaussian index of each splat of the band, front to back.
    pub(crate) ids: Vec<u32>,
    /// Packed copies.
    pub(crate) splats: Vec<Splat>,
    /// `entries[tile_start[t]..tile_start[t + 1]]` are the splats of tile `t`.
    pub(crate) tile_start: Vec<u32>,
    /// Indices into `splats`.
    pub(crate) entries: Vec<u32>,
    /// Gradient moments per splat of the band; filled by the backward pass.
    pub(crate) moments: Vec<[f32; 9]>,
}

impl Band {
    /// Splats of tile `t`, front to back.
    pub(crate) fn tile(&self, t: usize) -> &[u32] {
        &self.entries[self.tile_start[t] as usize..self.tile_start[t + 1] as usize]
    }

    fn list_tiles(&mut self, projected: &[Splat], band: usize, tiles_x: usize) {
        self.splats.clear();
        self.splats.extend(self.ids.iter().map(|&id| projected[id as usize]));
        let y0 = (band * TILE) as f32;
        let ranges: Vec<(u32, u32)> =
            self.splats.iter().map(|splat| tile_range(splat, y0, tiles_x)).collect();
        self.tile_start.clear();
        self.tile_start.resize(tiles_x + 1, 0);
        for &(first, last) in &ranges {
            for t in first..last {
                self.tile_start[t as usize + 1] += 1;
            }
        }
        for t in 0..tiles_x {
            self.tile_start[t + 1] += self.tile_start[t];
        }
        let mut cursor = self.tile_start.clone();
        self.entries.clear();
        self.entries.resize(self.tile_start[tiles_x] as usize, 0);
        for (i, &(first, last)) in ranges.iter().enumerate() {
            for t in first..last {
                let slot = &mut cursor[t as usize];
                self.entries[*slot as usize] = i as u32;
                *slot += 1;
            }
        }
    }
}

/// Half-open range of tile columns that a splat reaches in the band with top row `y0`.
fn tile_range(splat: &Splat, y0: f32, tiles_x: usize) -> (u32, u32) {
    let top = y0 + 0.5 - splat.y;
    let Some((left, right)) = splat.ellipse.band(top, top + (TILE - 1) as f32) else {
        return (0, 0);
    };
    // First and last pixel centre of a tile column are at 0.5 and 15.5.
    let tile = TILE as f32;
    let first = ((splat.x + left - (tile - 0.5)) / tile).ceil().max(0.0);
    let last = ((splat.x + right - 0.5) / tile).floor() + 1.0;
    let first = first.min(tiles_x as f32) as u32;
    (first, (last.max(0.0).min(tiles_x as f32) as u32).max(first))
}

/// Fills `bands` (one per row of tiles) from the projected Gaussians. Reuses their memory.
pub(crate) fn bin(projected: &[Splat], size: [usize; 2], bands: &mut Vec<Band>) {
    let (tiles_x, tiles_y) = (size[0].div_ceil(TILE), size[1].div_ceil(TILE));
    bands.resize_with(tiles_y, Band::default);
    for band in bands.iter_mut() {
        band.ids.clear();
    }
    for id in depth_order(projected) {
        let splat = &projected[id as usize];
        let reach = splat.ellipse.half_height;
        let first = ((splat.y - reach - 0.5) / TILE as f32).floor().max(0.0) as usize;
        let last = ((splat.y + reach - 0.5) / TILE as f32).floor().min((tiles_y - 1) as f32);
        if last >= 0.0 {
            for band in &mut bands[first.min(tiles_y - 1)..=last as usize] {
                band.ids.push(id);
            }
        }
    }
    bands.par_iter_mut().enumerate().for_each(|(y, band)| band.list_tiles(projected, y, tiles_x));
}

/// Indices of the visible Gaussians by depth, then index.
fn depth_order(projected: &[Splat]) -> Vec<u32> {
    // Depths are positive, so their bits order like the numbers.
    let mut keys: Vec<u64> = projected
        .iter()
        .enumerate()
        .filter(|(_, splat)| splat.is_visible())
        .map(|(id, splat)| (u64::from(splat.depth.to_bits()) << 32) | id as u64)
        .collect();
    radix_sort_high_word(&mut keys);
    keys.iter().map(|&key| key as u32).collect()
}

/// Sorts by the upper 32 bits, stable; input is already ordered by the lower ones.
///
/// Least significant digit first, 11 bits a pass: linear, where a comparison sort of a few
/// million keys would show in the profile.
fn radix_sort_high_word(keys: &mut Vec<u64>) {
    const DIGIT: u32 = 11;
    if keys.len() < 2048 {
        keys.sort_unstable();
        return;
    }
    let mut other = vec![0u64; keys.len()];
    for shift in [32, 32 + DIGIT, 32 + 2 * DIGIT] {
        let digit = |key: u64| ((key >> shift) & ((1 << DIGIT) - 1)) as usize;
        let mut start = [0u32; 1 << DIGIT];
        for &key in keys.iter() {
            start[digit(key)] += 1;
        }
        let mut sum = 0;
        for slot in &mut start {
            sum += std::mem::replace(slot, sum);
        }
        for &key in keys.iter() {
            let slot = &mut start[digit(key)];
            other[*slot as usize] = key;
            *slot += 1;
        }
        std::mem::swap(keys, &mut other);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ellipse::Ellipse;

    #[test]
    fn radix_sort_agrees_with_a_comparison_sort() {
        let mut state = 1u64;
        let mut keys: Vec<u64> = (0..5000u64)
            .map(|i| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                // Few distinct depths, so that ties occur.
                (((state >> 40) % 300 * 7_654_321) << 32) | i
            })
            .collect();
        let mut expected = keys.clone();
        expected.sort_unstable();
        radix_sort_high_word(&mut keys);
        assert_eq!(keys, expected);
    }

    #[test]
    fn every_touched_tile_lists_the_splat_once_in_depth_order() {
        let splats: Vec<Splat> = (0..300)
            .map(|i| {
                let f = i as f32;
                let (a, b, c) = (0.02 + 0.3 * (f * 0.37).sin().abs(), 0.01, 0.03);
                Splat {
                    x: (f * 13.7) % 90.0 - 10.0,
                    y: (f * 7.3) % 70.0 - 10.0,
                    a,
                    depth: 1.0 + (f * 0.71).sin(),
                    ellipse: Ellipse::from_conic(a, b, c, 5.0).unwrap(),
                    ..Splat::INVISIBLE
                }
            })
            .collect();
        let mut bands = Vec::new();
        bin(&splats, [70, 50], &mut bands);
        assert_eq!(bands.len(), 4);
        for (ty, band) in bands.iter().enumerate() {
            for tx in 0..5 {
                let list: Vec<u32> = band.tile(tx).iter().map(|&e| band.ids[e as usize]).collect();
                let depth = |id: u32| splats[id as usize].depth;
                assert!(list.windows(2).all(|w| depth(w[0]) <= depth(w[1])));
                for (id, s) in splats.iter().enumerate() {
                    let touched = (0..TILE * TILE).any(|p| {
                        let dx = (tx * TILE + p % TILE) as f32 + 0.5 - s.x;
                        let dy = (ty * TILE + p / TILE) as f32 + 0.5 - s.y;
                        let u = dx + s.ellipse.shear * dy;
                        s.a * (u * u + s.ellipse.aspect * dy * dy) <= 5.0
                    });
                    let count = list.iter().filter(|&&e| e == id as u32).count();
                    assert!(count <= 1 && (count == 1 || !touched), "tile {tx},{ty} splat {id}");
                }
            }
        }
    }
}
