//! Where a selection is.

use motes_formats::selection::BoxDocument;
use motes_scene::{Gaussians, Selection};

/// Share of the centers beyond each end that is left out: single Gaussians stray.
const OUTER: f64 = 0.005;

/// Smallest and largest coordinates of all but the outermost selected centers; `None` when there are none.
pub(crate) fn robust_bounds(
    gaussians: &Gaussians,
    selection: &Selection,
) -> Option<([f32; 3], [f32; 3])> {
    let rows = selection.rows();
    let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
    for k in 0..3 {
        let mut values: Vec<f32> = rows
            .iter()
            .map(|&i| gaussians.means[i as usize][k])
            .filter(|v| v.is_finite())
            .collect();
        values.sort_by(f32::total_cmp);
        let last = values.len().checked_sub(1)?;
        let skipped = (OUTER * last as f64) as usize;
        (low[k], high[k]) = (values[skipped], values[last - skipped]);
    }
    Some((low, high))
}

/// The same as a document.
pub fn object_box(gaussians: &Gaussians, selection: &Selection) -> Option<BoxDocument> {
    let (low, high) = robust_bounds(gaussians, selection)?;
    Some(BoxDocument { min: low.map(f64::from), max: high.map(f64::from) })
}
