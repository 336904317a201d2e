//! Rows in the order of a space-filling curve: neighbors in the file are neighbors in space.

use motes_scene::Gaussians;
use rayon::prelude::*;

/// Bits per axis.
const BITS: u32 = 21;

/// Row numbers along the Morton curve of the bounding box of the centers; equal codes keep the
/// order of the rows. Centers that are not finite come first.
pub(crate) fn morton_order(gaussians: &Gaussians) -> Vec<u32> {
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for mean in &gaussians.means {
        for axis in 0..3 {
            if mean[axis].is_finite() {
                low[axis] = low[axis].min(mean[axis]);
                high[axis] = high[axis].max(mean[axis]);
            }
        }
    }
    let cells = f64::from(1u32 << BITS) - 1.0;
    let scale: [f64; 3] = std::array::from_fn(|axis| {
        let extent = f64::from(high[axis]) - f64::from(low[axis]);
        if extent > 0.0 { cells / extent } else { 0.0 }
    });
    let code = |mean: &[f32; 3]| -> u64 {
        (0..3).fold(0, |code, axis| {
            let cell = (f64::from(mean[axis]) - f64::from(low[axis])) * scale[axis];
            code | spread(cell.min(cells) as u64) << axis // NaN is 0
        })
    };
    let mut keys: Vec<(u64, u32)> =
        gaussians.means.par_iter().enumerate().map(|(i, mean)| (code(mean), i as u32)).collect();
    keys.par_sort_unstable();
    keys.into_iter().map(|(_, row)| row).collect()
}

/// Two zero bits after each of the lowest 21.
fn spread(cell: u64) -> u64 {
    let mut x = cell & 0x1f_ffff;
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octants_stay_together() {
        let mut gaussians = Gaussians::empty(0);
        for i in 0..64u32 {
            let bit = |k: u32| (i >> k & 1) as f32;
            // Scrambled: the fine bits come first in the row number.
            gaussians.means.push([
                bit(0) + 2.0 * bit(3),
                bit(1) + 2.0 * bit(4),
                bit(2) + 2.0 * bit(5),
            ]);
        }
        gaussians.means.swap(3, 50);
        let order = morton_order(&gaussians);
        for octant in order.chunks(8) {
            let cell = |row: &u32| gaussians.means[*row as usize].map(|v| v as u32 / 2);
            assert!(octant.iter().all(|row| cell(row) == cell(&octant[0])), "{octant:?}");
        }
    }
}
