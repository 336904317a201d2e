//! Patches that may be copied into a hole, and how much better than others each has to fit.

use super::exemplar::Raster;

/// A known patch is needed, and more than a few to choose from.
const LEAST_EXAMPLES: usize = 64;
/// No more examples are compared; they lie on a coarser raster then.
const MOST_EXAMPLES: usize = 40_000;

/// An example far from the hole has to fit this many times better than one beside it.
const FARTHEST: f32 = 4.0;

/// Middles of the patches that may be copied with their weights; `None` where they are too few.
pub(super) fn examples_of(raster: &Raster<'_>) -> Option<Vec<(usize, f32)>> {
    let examples = weighted(raster, &middles_of_examples(raster));
    (examples.len() >= LEAST_EXAMPLES).then_some(examples)
}

/// Examples with the weight of their mismatch, `w(q)`: the farther from the hole, the better they have to fit. So the
/// ground that borders the hole goes on, and other ground comes in where it fits far better.
fn weighted(raster: &Raster<'_>, middles: &[usize]) -> Vec<(usize, f32)> {
    let side = raster.side() as f32;
    let steps = steps_from(raster.size, raster.hole);
    middles.iter().map(|&c| (c, (1.0 + (steps[c] as f32 / side).powi(2)).min(FARTHEST))).collect()
}

/// Steps from each cell to the nearest marked one, diagonals counting as one.
fn steps_from([width, height]: [usize; 2], marked: &[bool]) -> Vec<u32> {
    let mut steps: Vec<u32> = marked.iter().map(|m| if *m { 0 } else { u32::MAX }).collect();
    let mut last: Vec<usize> = (0..marked.len()).filter(|c| marked[*c]).collect();
    for step in 1.. {
        let mut next = Vec::new();
        for c in last {
            let (x, y) = (c % width, c / width);
            for j in y.saturating_sub(1)..(y + 2).min(height) {
                for i in x.saturating_sub(1)..(x + 2).min(width) {
                    let slot = &mut steps[j * width + i];
                    if *slot == u32::MAX {
                        *slot = step;
                        next.push(j * width + i);
                    }
                }
            }
        }
        if next.is_empty() {
            break;
        }
        last = next;
    }
    steps
}

/// Middles of the patches that may be copied whole.
fn middles_of_examples(raster: &Raster<'_>) -> Vec<usize> {
    let [width, height] = raster.size;
    let side = raster.side();
    if width < side || height < side {
        return Vec::new();
    }
    // Examples in the rectangle above and left of a cell: a patch is one when its count is full.
    let mut counts = vec![0u32; (width + 1) * (height + 1)];
    for y in 0..height {
        for x in 0..width {
            let at = |x: usize, y: usize| y * (width + 1) + x;
            counts[at(x + 1, y + 1)] = counts[at(x, y + 1)] + counts[at(x + 1, y)]
                - counts[at(x, y)]
                + u32::from(raster.examples[y * width + x]);
        }
    }
    let at = |x: usize, y: usize| counts[y * (width + 1) + x];
    let whole = |x: usize, y: usize| {
        at(x + side, y + side) + at(x, y) - at(x, y + side) - at(x + side, y)
            == (side * side) as u32
    };
    let corners = (0..=height - side).flat_map(|y| (0..=width - side).map(move |x| (x, y)));
    let found = corners.filter(|&(x, y)| whole(x, y));
    let found: Vec<usize> =
        found.map(|(x, y)| (y + raster.radius) * width + x + raster.radius).collect();
    let step = (found.len() as f32 / MOST_EXAMPLES as f32).sqrt().ceil().max(1.0) as usize;
    let on_raster =
        |c: &usize| (c % width).is_multiple_of(step) && (c / width).is_multiple_of(step);
    if step == 1 { found } else { found.into_iter().filter(on_raster).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_go_along_rows_columns_and_diagonals() {
        let marked: Vec<bool> = (0..20).map(|c| c == 6).collect();
        let steps = steps_from([5, 4], &marked);
        assert_eq!(steps[..5], [1, 1, 1, 2, 3]);
        assert_eq!(steps[15..], [2, 2, 2, 2, 3]);
        assert_eq!(steps_from([2, 1], &[false; 2]), [u32::MAX; 2], "nothing is marked");
    }
}
