//! Marks of a raster that grow.

/// Marked cells and those within squares of `2 radius + 1` around.
pub(crate) fn grown([width, height]: [usize; 2], marks: &[bool], radius: usize) -> Vec<bool> {
    let along = |marks: &[bool], lines: usize, length: usize, stride: usize, step: usize| {
        let mut out = vec![false; marks.len()];
        for line in 0..lines {
            // How far back the last mark was, and how far ahead the next one is.
            let at = |i: usize| line * stride + i * step;
            for reverse in [false, true] {
                let mut since = usize::MAX;
                for i in 0..length {
                    let i = if reverse { length - 1 - i } else { i };
                    since = if marks[at(i)] { 0 } else { since.saturating_add(1) };
                    out[at(i)] |= since <= radius;
                }
            }
        }
        out
    };
    let rows = along(marks, height, width, width, 1);
    along(&rows, width, height, 1, width)
}
