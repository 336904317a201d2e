//! Whether ground can be continued patch by patch: whether known ground beside a hole is foretold by the example that fits what is next
//! to it.
//!
//! ```text
//! error = Σ |a(p) - a(q)|²     over half of a patch, q the example that fits the other half best
//! blank = Σ |a(p) - m|²        m: mean of the other half
//! ```
//!
//! Boards and tiles are foretold: `error` is below `blank`. Of independent noise, which a splat of smooth cloth has too, an example adds
//! its own: `error` is twice `blank`.

use rayon::prelude::*;

use super::exemplar::{Raster, nearest};

/// Patches that are tried.
const TRIED: usize = 96;

/// More than this `error` over `blank` is grain that an example does not know: midway between what an example says as little of as a
/// blank does, and independent noise.
const MOST_ERROR: f32 = 1.5;

/// Whether examples foretell the ground beside the hole well enough to be copied patch by patch.
pub(super) fn is_foretold(raster: &Raster<'_>, examples: &[(usize, f32)]) -> bool {
    error_of_examples(raster, examples).is_some_and(|error| error <= MOST_ERROR)
}

/// `error` over `blank`, summed over patches beside the hole; `None` where all is even.
fn error_of_examples(raster: &Raster<'_>, examples: &[(usize, f32)]) -> Option<f32> {
    // Those beside the hole: what is farther away may be other ground.
    let mut tried = examples.to_vec();
    tried.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    tried.truncate(examples.len().div_ceil(3));
    let step = tried.len().div_ceil(TRIED);
    let tried: Vec<usize> = tried.iter().step_by(step).map(|e| e.0).collect();
    let errors: Vec<[f64; 2]> = tried
        .par_iter()
        .enumerate()
        .map(|(k, &middle)| foretold(raster, examples, middle, k % 4))
        .collect();
    let sum = |k: usize| errors.iter().map(|e| e[k]).sum::<f64>();
    (sum(1) > 0.0).then(|| (sum(0) / sum(1)) as f32)
}

/// `error` and `blank` of a patch whose right, left, lower or upper half is asked for.
fn foretold(
    raster: &Raster<'_>,
    examples: &[(usize, f32)],
    middle: usize,
    side: usize,
) -> [f64; 2] {
    let (width, r) = (raster.size[0], raster.radius as isize);
    let mut halves: [Vec<(isize, [f32; 3])>; 2] = [Vec::new(), Vec::new()];
    for dy in -r..=r {
        for dx in -r..=r {
            let across = [dx, -dx, dy, -dy][side];
            let shift = dy * width as isize + dx;
            let value = raster.values[(middle as isize + shift) as usize];
            halves[usize::from(across > 0)].push((shift, value));
        }
    }
    let [given, asked] = halves;
    // A patch that overlaps would foretell itself.
    let apart = |&(e, _): &(usize, f32)| {
        let far = |a: usize, b: usize| a.abs_diff(b) > 2 * raster.radius;
        far(e % width, middle % width) || far(e / width, middle / width)
    };
    let others: Vec<(usize, f32)> = examples.iter().copied().filter(apart).collect();
    if others.is_empty() {
        return [0.0; 2];
    }
    let best = nearest(raster.values, &given, &others);
    let mean: [f32; 3] =
        std::array::from_fn(|k| given.iter().map(|g| g.1[k]).sum::<f32>() / given.len() as f32);
    let square =
        |a: [f32; 3], b: [f32; 3]| (0..3).map(|k| f64::from(a[k] - b[k]).powi(2)).sum::<f64>();
    let mut errors = [0.0; 2];
    for (shift, value) in asked {
        errors[0] += square(value, raster.values[(best as isize + shift) as usize]);
        errors[1] += square(value, mean);
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reshade::examples::examples_of;

    /// Of a pattern with a hole in the middle.
    fn error(pattern: impl Fn(usize, usize) -> f32) -> f32 {
        let size = [72, 60];
        let place = |c: usize| (c % size[0], c / size[0]);
        let cells = 0..size[0] * size[1];
        let values: Vec<[f32; 3]> =
            cells.clone().map(|c| [pattern(place(c).0, place(c).1), 0.1, -0.1]).collect();
        let inside = |(x, y): (usize, usize)| (28..44).contains(&x) && (22..38).contains(&y);
        let hole: Vec<bool> = cells.map(|c| inside(place(c))).collect();
        let known: Vec<bool> = hole.iter().map(|hole| !hole).collect();
        let (known, examples) = (&known[..], &known[..]);
        let raster = Raster { size, values: &values, known, examples, hole: &hole, radius: 4 };
        let examples = examples_of(&raster).expect("enough examples");
        error_of_examples(&raster, &examples).expect("an uneven pattern")
    }

    #[test]
    fn planks_are_foretold_and_noise_is_not() {
        let planks = error(|x, _| if x % 9 < 2 { -1.0 } else { 0.2 });
        // Halves without a joint do not say where the next one is.
        assert!(planks < 0.6, "{planks}");
        let noise = error(|x, y| {
            let mixed = (x as u32 * 73 + y as u32 * 10_007).wrapping_mul(0x9e37_79b1);
            let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b);
            (mixed ^ (mixed >> 13)) as f32 / u32::MAX as f32
        });
        assert!(noise > MOST_ERROR, "{noise}");
    }
}
