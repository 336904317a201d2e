//! Texture continued by example: every patch at the edge of a hole is completed by the known patch that fits it best.
//!
//! Criminisi, Pérez & Toyama 2004, "Region Filling and Object Removal by Exemplar-Based Image Inpainting". The order is
//! theirs, with confidence and structure added rather than multiplied (Cheng et al. 2005), so that a patch without
//! edges has its turn, too:
//!
//! ```text
//! P(p) = (C(p) + D(p)) / 2      C: mean confidence of what is known of the patch around p
//!                               D: |isophote · normal of the front|, over the largest gradient there is
//! q    = argmin w(q) Σ_known |a(p + d) - a(q + d)|²  over all q whose patch is known and may serve as an example
//! w(q) = min(1 + (steps from q to the hole / side of a patch)², 4)
//! ```

use rayon::prelude::*;

/// A raster with a hole.
#[derive(Debug)]
pub(super) struct Raster<'a> {
    /// Columns and rows.
    pub(super) size: [usize; 2],
    /// Values, three channels, `[rows * columns]`; what they are outside of `known` does not matter.
    pub(super) values: &'a [[f32; 3]],
    /// Cells whose value holds.
    pub(super) known: &'a [bool],
    /// Cells that may be copied, a part of `known`.
    pub(super) examples: &'a [bool],
    /// Cells that get a value; none of them is `known`.
    pub(super) hole: &'a [bool],
    /// Half a side of a patch, without its middle.
    pub(super) radius: usize,
}

impl Raster<'_> {
    /// Cells along a patch.
    pub(super) fn side(&self) -> usize {
        2 * self.radius + 1
    }
}

/// Squared difference of two values.
pub(super) fn square(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
}

/// The values with the hole filled by these examples.
pub(super) fn filled(raster: &Raster<'_>, examples: &[(usize, f32)]) -> Vec<[f32; 3]> {
    let mut work = Work::new(raster);
    while let Some(next) = work.first_of_front() {
        let best = work.best_example(next, examples);
        work.copy(best, next);
    }
    work.values
}

/// A raster on its way.
struct Work {
    size: [usize; 2],
    radius: usize,
    values: Vec<[f32; 3]>,
    known: Vec<bool>,
    hole: Vec<bool>,
    confidence: Vec<f32>,
    /// The largest change from cell to cell that is known.
    steepest: f32,
}

impl Work {
    fn new(raster: &Raster<'_>) -> Self {
        let confidence = raster.known.iter().map(|known| f32::from(u8::from(*known))).collect();
        let mut work = Self {
            size: raster.size,
            radius: raster.radius,
            values: raster.values.to_vec(),
            known: raster.known.to_vec(),
            hole: raster.hole.to_vec(),
            confidence,
            steepest: 0.0,
        };
        let slope = |c: usize| work.gradient(c).map_or(0.0, |[x, y]| x.hypot(y));
        work.steepest = (0..work.values.len()).map(slope).fold(1e-6, f32::max);
        work
    }

    fn is_open(&self, cell: usize) -> bool {
        self.hole[cell] && !self.known[cell]
    }

    /// Cells of the patch around one that lie on the raster, with their shift.
    fn patch(&self, cell: usize) -> impl Iterator<Item = (usize, [isize; 2])> + use<> {
        let [width, height] = self.size.map(|n| n as isize);
        let (x, y) = (cell as isize % width, cell as isize / width);
        let r = self.radius as isize;
        (-r..=r).flat_map(move |dy| (-r..=r).map(move |dx| [dx, dy])).filter_map(move |[dx, dy]| {
            let (i, j) = (x + dx, y + dy);
            let inside = i >= 0 && j >= 0 && i < width && j < height;
            inside.then_some(((j * width + i) as usize, [dx, dy]))
        })
    }

    /// The open cell beside a known one whose patch comes first; any open cell where none touches a known one.
    fn first_of_front(&self) -> Option<usize> {
        let beside = |c: usize| self.neighbors(c).into_iter().flatten().any(|n| self.known[n]);
        let open: Vec<usize> = (0..self.values.len()).filter(|c| self.is_open(*c)).collect();
        let front: Vec<usize> = open.iter().copied().filter(|c| beside(*c)).collect();
        let of = if front.is_empty() { &open } else { &front };
        let priority = |c: &usize| (self.priority(*c), std::cmp::Reverse(*c));
        of.par_iter()
            .map(|c| (priority(c), *c))
            .max_by(|((a, i), _), ((b, j), _)| a.total_cmp(b).then(i.cmp(j)))
            .map(|(_, c)| c)
    }

    fn priority(&self, cell: usize) -> f32 {
        let (mut sum, mut count) = (0.0f32, 0.0f32);
        let mut steepest = [0.0f32; 2];
        for (c, _) in self.patch(cell) {
            sum += self.confidence[c];
            count += 1.0;
            if let Some(slope) = self.gradient(c)
                && slope[0].hypot(slope[1]) > steepest[0].hypot(steepest[1])
            {
                steepest = slope;
            }
        }
        // The front runs across the change from known to unknown; isophotes across the gradient.
        let [left, right, up, down] =
            self.neighbors(cell).map(|n| n.map_or(0.0, |n| f32::from(u8::from(self.known[n]))));
        let (nx, ny) = (right - left, down - up);
        let length = nx.hypot(ny).max(1e-6);
        let structure = (-steepest[1] * nx + steepest[0] * ny).abs() / (length * self.steepest);
        0.5 * (sum / count.max(1.0) + structure.min(1.0))
    }

    /// Left, right, above and below.
    fn neighbors(&self, cell: usize) -> [Option<usize>; 4] {
        let [width, height] = self.size;
        let (x, y) = (cell % width, cell / width);
        [
            (x > 0).then(|| cell - 1),
            (x + 1 < width).then(|| cell + 1),
            (y > 0).then(|| cell - width),
            (y + 1 < height).then(|| cell + width),
        ]
    }

    /// Change of the mean of the channels per cell, where a cell and those around it are known.
    fn gradient(&self, cell: usize) -> Option<[f32; 2]> {
        let [left, right, up, down] = self.neighbors(cell);
        let at = |n: Option<usize>| {
            let n = n.filter(|n| self.known[*n])?;
            Some(self.values[n].iter().sum::<f32>() / 3.0)
        };
        self.known[cell].then_some(())?;
        Some([0.5 * (at(right)? - at(left)?), 0.5 * (at(down)? - at(up)?)])
    }

    /// The example whose weighted mismatch with what is known around a cell is least; of equal ones the first.
    fn best_example(&self, cell: usize, examples: &[(usize, f32)]) -> usize {
        let width = self.size[0] as isize;
        let wanted: Vec<(isize, [f32; 3])> = self
            .patch(cell)
            .filter(|(c, _)| self.known[*c])
            .map(|(c, [dx, dy])| (dy * width + dx, self.values[c]))
            .collect();
        nearest(&self.values, &wanted, examples)
    }

    /// Copies what is missing of the patch around a cell.
    fn copy(&mut self, example: usize, cell: usize) {
        let (mut sum, mut count) = (0.0f32, 0.0f32);
        for (c, _) in self.patch(cell) {
            sum += self.confidence[c];
            count += 1.0;
        }
        let confidence = sum / count.max(1.0);
        let width = self.size[0] as isize;
        for (c, [dx, dy]) in self.patch(cell) {
            if self.is_open(c) {
                self.values[c] = self.values[(example as isize + dy * width + dx) as usize];
                self.known[c] = true;
                self.confidence[c] = confidence;
            }
        }
    }
}

/// The example whose weighted mismatch with values at shifts from its middle is least; of equal ones the first.
pub(super) fn nearest(
    values: &[[f32; 3]],
    wanted: &[(isize, [f32; 3])],
    examples: &[(usize, f32)],
) -> usize {
    let mismatch = |(example, weight): (usize, f32), least: f32| {
        let mut sum = 0.0f32;
        for &(shift, value) in wanted {
            let there = values[(example as isize + shift) as usize];
            sum += weight * square(value, there);
            if sum > least {
                break;
            }
        }
        sum
    };
    // Chunks of fixed size, so that what ends a sum early does not depend on threads.
    let best_of = |(n, chunk): (usize, &[(usize, f32)])| {
        let mut best = (f32::INFINITY, n * 1024);
        for (k, &example) in chunk.iter().enumerate() {
            let sum = mismatch(example, best.0);
            if sum < best.0 {
                best = (sum, n * 1024 + k);
            }
        }
        best
    };
    let best = examples
        .par_chunks(1024)
        .enumerate()
        .map(best_of)
        .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    best.map_or(examples[0].0, |(_, k)| examples[k].0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reshade::examples::examples_of;

    /// `None` where too few patches can serve as examples.
    fn filled(raster: &Raster<'_>) -> Option<Vec<[f32; 3]>> {
        Some(super::filled(raster, &examples_of(raster)?))
    }

    const SIZE: [usize; 2] = [72, 60];

    /// Fills a hole of 24 x 20 cells in the middle of a pattern; returns it and the filled values.
    fn fill(pattern: impl Fn(usize, usize) -> f32) -> (Vec<[f32; 3]>, Vec<[f32; 3]>, Vec<bool>) {
        let cells = 0..SIZE[0] * SIZE[1];
        let place = |c: usize| (c % SIZE[0], c / SIZE[0]);
        let truth: Vec<[f32; 3]> =
            cells.clone().map(|c| [pattern(place(c).0, place(c).1), 0.1, -0.1]).collect();
        let inside = |(x, y): (usize, usize)| (24..48).contains(&x) && (20..40).contains(&y);
        let hole: Vec<bool> = cells.map(|c| inside(place(c))).collect();
        let known: Vec<bool> = hole.iter().map(|hole| !hole).collect();
        let values: Vec<[f32; 3]> =
            truth.iter().zip(&hole).map(|(v, hole)| if *hole { [9.0; 3] } else { *v }).collect();
        let raster = Raster {
            size: SIZE,
            values: &values,
            known: &known,
            examples: &known,
            hole: &hole,
            radius: 5,
        };
        (truth, filled(&raster).expect("enough examples"), hole)
    }

    fn rms(a: &[[f32; 3]], b: &[[f32; 3]], of: &[bool]) -> f32 {
        let square = |(a, b): (&[f32; 3], &[f32; 3])| (a[0] - b[0]).powi(2);
        let within = a.iter().zip(b).zip(of).filter(|(_, of)| **of).map(|(pair, _)| square(pair));
        let squares: Vec<f32> = within.collect();
        (squares.iter().sum::<f32>() / squares.len() as f32).sqrt()
    }

    #[test]
    fn planks_and_tiles_go_on_where_they_were() {
        let planks = |x: usize, _| if x % 9 < 2 { -1.0 } else { 0.2 };
        let tiles = |x: usize, y: usize| if (x / 6 + y / 6).is_multiple_of(2) { 0.5 } else { -0.5 };
        let flat = |(truth, _, hole): &(Vec<[f32; 3]>, Vec<[f32; 3]>, Vec<bool>)| {
            let inside = truth.iter().zip(hole).filter(|(_, hole)| **hole).map(|(v, _)| v[0]);
            let inside: Vec<f32> = inside.collect();
            let mean = inside.iter().sum::<f32>() / inside.len() as f32;
            (inside.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / inside.len() as f32).sqrt()
        };
        for (name, done) in [("planks", fill(planks)), ("tiles", fill(tiles))] {
            let error = rms(&done.0, &done.1, &done.2);
            assert!(error < 0.35 * flat(&done), "{name}: {error}, flat {}", flat(&done));
        }
    }

    fn grain(x: usize, y: usize) -> f32 {
        let hash = (x as u32).wrapping_mul(73_856_093) ^ (y as u32).wrapping_mul(19_349_663);
        (hash.wrapping_mul(2_654_435_761) >> 16) as f32 / 65_536.0
    }

    /// Cell by cell, even ground of the same mean is more like grain than the grain of another place is.
    #[test]
    fn ground_at_the_rim_goes_on_and_not_smoother_ground_farther_off() {
        let near = |x: usize, y: usize| (8..64).contains(&x) && (4..56).contains(&y);
        let (_, filled, hole) = fill(|x, y| if near(x, y) { grain(x, y) } else { 0.5 });
        let inside = || filled.iter().zip(&hole).filter(|(_, hole)| **hole).map(|(v, _)| v[0]);
        let even = inside().filter(|v| *v == 0.5).count();
        assert!(even * 10 < inside().count(), "{even} cells come from beyond the rim");
    }

    #[test]
    fn grain_goes_on_with_its_statistics() {
        let (truth, filled, hole) = fill(grain);
        let spread = |values: &[[f32; 3]]| {
            let inside: Vec<f32> =
                values.iter().zip(&hole).filter(|(_, hole)| **hole).map(|(v, _)| v[0]).collect();
            let mean = inside.iter().sum::<f32>() / inside.len() as f32;
            let square = inside.iter().map(|v| (v - mean).powi(2)).sum::<f32>();
            (mean, (square / inside.len() as f32).sqrt())
        };
        let ((mean, deviation), (mean_of_fill, deviation_of_fill)) =
            (spread(&truth), spread(&filled));
        assert!((mean - mean_of_fill).abs() < 0.1, "{mean} {mean_of_fill}");
        assert!((deviation_of_fill / deviation - 1.0).abs() < 0.2, "{deviation_of_fill}");
    }

    #[test]
    fn a_raster_without_examples_is_left() {
        let (values, known) = ([[0.0; 3]; 100], [true; 100]);
        let hole = [false; 100];
        let raster = |radius| Raster {
            size: [10, 10],
            values: &values,
            known: &known,
            examples: &known,
            hole: &hole,
            radius,
        };
        assert!(filled(&raster(5)).is_none());
        assert!(filled(&raster(0)).is_some());
    }

    #[test]
    fn the_result_does_not_depend_on_the_number_of_threads() {
        let pattern = |x: usize, y: usize| ((x * 7 + y * 13) % 11) as f32;
        let on = |threads| {
            let pool =
                rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| fill(pattern).1)
        };
        assert_eq!(on(1), on(3));
    }
}
