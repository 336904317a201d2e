//! Slopes of a cost by a picture.

use motes_raster::{Planes, TILE};
use rayon::prelude::*;

/// A picture of `[width, height]` whose channels at `(x, y)` are `of(x, y)` over the number of values; transmittance has none.
pub(crate) fn slopes(
    [width, height]: [usize; 2],
    of: impl Fn(usize, usize) -> [f32; 3] + Sync,
) -> Planes {
    let mut out = Planes::new(width, height, 4);
    let (band, stride) = (out.band_len(), out.stride);
    let share = 1.0 / (3 * width * height) as f32;
    out.data.par_chunks_mut(band).enumerate().for_each(|(k, band)| {
        for y in k * TILE..((k + 1) * TILE).min(height) {
            for x in 0..width {
                for (c, slope) in of(x, y).into_iter().enumerate() {
                    band[(c * TILE + y % TILE) * stride + x] = share * slope;
                }
            }
        }
    });
    out
}
