//! Ground of which examples foretell nothing, continued by pieces as large as the hole: terrazzo, a lawn, flowers on a wallpaper.
//!
//! A piece is known ground moved by one shift `s`, so that all of its pattern but the seam is real. Its slow change of color is
//! replaced by that of what surrounds the hole (Pérez, Gangnet & Blake 2003, "Poisson Image Editing", here for means over patches,
//! since single cells of a pattern are noise):
//!
//! ```text
//! a(p) = a(p + s) + m(p)       m: mean of d(p) = a(p) - a(p + s) over patches of the seam, continued into the hole
//! s    = argmin (<|d|²> + 4 <|d̄|²>) / (g + g_seam) + (ln(g_piece / g) / 2)² + 2 (1 - cover)
//! ```
//!
//! `<>` are means over the seam, `d̄` are means over squares of a patch, `g` is the mean square deviation within patches at the seam,
//! `g_seam` at the seam moved, `g_piece` in the piece. Without the quotient and the second term even ground would fit best, since it
//! is nearer to any pattern than another part of the pattern is. `cover` is the share of the open cells that the piece covers.

use rayon::prelude::*;

use super::exemplar::{Raster, square};
use super::grid::{boxed, pull_push};
use crate::grown::grown;

/// Pieces that are laid at most; what is still open then is completed patch by patch.
const PIECES: usize = 6;
/// A piece that covers less of what is open is none.
const LEAST_COVER: f32 = 0.25;
/// A shift is compared where this share of the seam is known there, relative to its cover.
const LEAST_SEAM: f32 = 0.25;
/// Slow changes of color across the seam count so much more than grain.
const SLOW: f32 = 4.0;
/// A coarse search tries about so many shifts at most.
const COARSE: f32 = 65_536.0;
/// Open cells and cells of the seam that a coarse search looks at, at most.
const SAMPLED: [usize; 2] = [512, 2048];
/// Mean squares below are even ground, log units.
const EVEN: f32 = 1e-6;

/// Values and known cells with pieces laid into the hole, as far as pieces reach.
pub(super) fn with_pieces(raster: &Raster<'_>) -> (Vec<[f32; 3]>, Vec<bool>) {
    let mut work = Work {
        raster,
        values: raster.values.to_vec(),
        known: raster.known.to_vec(),
        grain: grain(raster),
        shifts: Vec::new(),
    };
    for _ in 0..PIECES {
        let Some(piece) = work.next() else { break };
        work.lay(&piece);
    }
    (work.values, work.known)
}

/// Squared deviation of known cells from the mean of the patch around.
fn grain(raster: &Raster<'_>) -> Vec<f32> {
    let own = raster.values.iter().zip(raster.known);
    let own: Vec<[f32; 4]> =
        own.map(|([r, g, b], known)| if *known { [*r, *g, *b, 1.0] } else { [0.0; 4] }).collect();
    let sums = boxed(raster.size, &own, raster.radius);
    let deviation = |(&[r, g, b, known], &[sr, sg, sb, n]): (&[f32; 4], &[f32; 4])| {
        if known > 0.0 { square([r, g, b], [sr / n, sg / n, sb / n]) } else { 0.0 }
    };
    own.iter().zip(&sums).map(deviation).collect()
}

/// A raster on its way.
struct Work<'a> {
    raster: &'a Raster<'a>,
    values: Vec<[f32; 3]>,
    known: Vec<bool>,
    grain: Vec<f32>,
    /// Of the pieces that are laid.
    shifts: Vec<[isize; 2]>,
}

/// Ground that is moved.
struct Piece {
    shift: [isize; 2],
    /// Known cells beside the open ones.
    seam: Vec<usize>,
    open: Vec<usize>,
}

impl Work<'_> {
    /// The piece that fits best what is still open; none where none covers enough of it.
    fn next(&self) -> Option<Piece> {
        let r = self.raster;
        let cells = 0..self.values.len();
        let open: Vec<usize> = cells.filter(|c| r.hole[*c] && !self.known[*c]).collect();
        let seam = self.seam(&open);
        if open.is_empty() || seam.is_empty() {
            return None;
        }
        let [width, height] = r.size.map(|n| n as isize);
        let area = 4.0 * (width * height) as f32;
        let step = r.radius.div_ceil(2).max((area / COARSE).sqrt().ceil() as usize);
        let steps = |length: isize| (1 - length..length).step_by(step);
        // A shift next to one before would only stretch its piece.
        let side = r.side() as isize;
        let is_new = |s: &[isize; 2]| {
            !self.shifts.iter().any(|t| (s[0] - t[0]).abs().max((s[1] - t[1]).abs()) < side)
        };
        let all = steps(height).flat_map(|y| steps(width).map(move |x| [x, y]));
        let coarse: Vec<[isize; 2]> = all.filter(is_new).collect();
        let few = |cells: &[usize], most: usize| -> Vec<usize> {
            cells.iter().copied().step_by(cells.len().div_ceil(most)).collect()
        };
        let best = self.best(&coarse, &few(&open, SAMPLED[0]), &few(&seam, SAMPLED[1]))?;
        let near = |b: isize| b - step as isize..=b + step as isize;
        let fine: Vec<[isize; 2]> =
            near(best[1]).flat_map(|y| near(best[0]).map(move |x| [x, y])).collect();
        let shift = self.best(&fine, &open, &seam)?;
        Some(Piece { shift, seam, open })
    }

    /// Known cells within a patch around the open ones.
    fn seam(&self, open: &[usize]) -> Vec<usize> {
        let mut marks = vec![false; self.values.len()];
        open.iter().for_each(|c| marks[*c] = true);
        let near = grown(self.raster.size, &marks, self.raster.radius);
        (0..near.len()).filter(|c| near[*c] && self.known[*c]).collect()
    }

    /// The cell at a shift from another if it may be copied.
    fn example(&self, cell: usize, [dx, dy]: [isize; 2]) -> Option<usize> {
        let [width, height] = self.raster.size.map(|n| n as isize);
        let (x, y) = (cell as isize % width + dx, cell as isize / width + dy);
        let inside = x >= 0 && y >= 0 && x < width && y < height;
        inside.then_some((y * width + x) as usize).filter(|c| self.raster.examples[*c])
    }

    /// The shift that costs least; of equal ones the first.
    fn best(&self, shifts: &[[isize; 2]], open: &[usize], seam: &[usize]) -> Option<[isize; 2]> {
        let own = seam.iter().map(|c| self.grain[*c]).sum::<f32>() / seam.len() as f32 + EVEN;
        let costs = shifts.par_iter().enumerate();
        costs
            .filter_map(|(k, s)| Some((self.cost(*s, open, (seam, own))?, k)))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map(|(_, k)| shifts[k])
    }

    fn cost(&self, shift: [isize; 2], open: &[usize], (seam, own): (&[usize], f32)) -> Option<f32> {
        let from = open.iter().filter_map(|c| self.example(*c, shift));
        let (inside, covered) =
            from.fold((0.0f32, 0.0f32), |(sum, n), c| (sum + self.grain[c], n + 1.0));
        let cover = covered / open.len() as f32;
        (cover >= LEAST_COVER).then_some(())?;
        let ([width, height], side) = (self.raster.size, self.raster.side());
        let columns = width.div_ceil(side);
        let square_of = |c: usize| (c / width) / side * columns + (c % width) / side;
        let mut slow = vec![[0.0f32; 4]; columns * height.div_ceil(side)];
        let (mut sum, mut moved, mut count) = (0.0f32, 0.0f32, 0.0f32);
        for &c in seam {
            let Some(there) = self.example(c, shift) else { continue };
            let (own, there_value) = (self.values[c], self.raster.values[there]);
            sum += square(own, there_value);
            moved += self.grain[there];
            count += 1.0;
            let slow = &mut slow[square_of(c)];
            (0..3).for_each(|k| slow[k] += own[k] - there_value[k]);
            slow[3] += 1.0;
        }
        (count >= LEAST_SEAM * seam.len() as f32 * cover).then_some(())?;
        let slow = slow.iter().map(|[r, g, b, n]| (r * r + g * g + b * b) / n.max(1.0));
        let mismatch = (sum + SLOW * slow.sum::<f32>()) / (moved + own * count);
        let statistics = 0.5 * ((inside / covered + EVEN) / own).ln();
        Some(mismatch + statistics.powi(2) + 2.0 * (1.0 - cover))
    }

    fn lay(&mut self, piece: &Piece) {
        let offset = self.offset(piece);
        for &c in &piece.open {
            if let Some(from) = self.example(c, piece.shift) {
                let moved = self.raster.values[from];
                self.values[c] = std::array::from_fn(|k| moved[k] + offset[c][k]);
                self.known[c] = true;
                self.grain[c] = self.grain[from];
            }
        }
        self.shifts.push(piece.shift);
    }

    /// `m` of every cell. Weights that make up 1 in a patch average over patches.
    fn offset(&self, piece: &Piece) -> Vec<[f32; 3]> {
        let each = (self.raster.side() as f32).powi(-2);
        let mut weight = vec![0.0f32; self.values.len()];
        let mut difference = vec![[0.0f32; 3]; self.values.len()];
        for &c in &piece.seam {
            let Some(there) = self.example(c, piece.shift) else { continue };
            let (own, moved) = (self.values[c], self.raster.values[there]);
            weight[c] = each;
            difference[c] = std::array::from_fn(|k| each * (own[k] - moved[k]));
        }
        pull_push(self.raster.size, difference, weight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [120, 90];

    /// Speckles of 2 x 2 cells.
    fn speckles(x: usize, y: usize) -> f32 {
        let mixed = ((x / 2) as u32 * 73 + (y / 2) as u32 * 10_007).wrapping_mul(0x9e37_79b1);
        let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b);
        if (mixed ^ (mixed >> 13)).is_multiple_of(5) { 0.8 } else { 0.0 }
    }

    /// A pattern with a hole of 24 x 20 cells in it: values in the hole and how many of them are known.
    fn laid(pattern: impl Fn(usize, usize) -> f32, room: usize) -> (Vec<[f32; 3]>, usize) {
        let cells = 0..SIZE[0] * SIZE[1];
        let place = |c: usize| (c % SIZE[0], c / SIZE[0]);
        let is_open = |c: &usize| {
            let (x, y) = place(*c);
            (48..72).contains(&x) && (35..55).contains(&y)
        };
        let value = |c: usize| {
            let v = pattern(place(c).0, place(c).1);
            if is_open(&c) { [9.0; 3] } else { [v, 0.5 * v, 0.1] }
        };
        let values: Vec<[f32; 3]> = cells.clone().map(value).collect();
        let hole: Vec<bool> = cells.clone().map(|c| is_open(&c)).collect();
        let known: Vec<bool> = hole.iter().map(|hole| !hole).collect();
        let examples: Vec<bool> = cells.clone().map(|c| known[c] && place(c).0 < room).collect();
        let (known, examples) = (&known[..], &examples[..]);
        let raster =
            Raster { size: SIZE, values: &values, known, examples, hole: &hole, radius: 4 };
        let (values, known) = with_pieces(&raster);
        let inside: Vec<usize> = cells.filter(is_open).collect();
        let count = inside.iter().filter(|c| known[**c]).count();
        (inside.into_iter().map(|c| values[c]).collect(), count)
    }

    fn moments(values: &[[f32; 3]]) -> (f32, f32) {
        let n = values.len() as f32;
        let mean = values.iter().map(|v| v[0]).sum::<f32>() / n;
        (mean, (values.iter().map(|v| (v[0] - mean).powi(2)).sum::<f32>() / n).sqrt())
    }

    #[test]
    fn speckles_go_on_although_even_ground_would_fit_better() {
        let (mean, deviation) = (0.16, 0.32);
        let half = |x, y| if x < 80 { speckles(x, y) } else { mean };
        let (filled, known) = laid(half, SIZE[0]);
        assert_eq!(known, filled.len());
        let (mean_of_fill, deviation_of_fill) = moments(&filled);
        assert!((mean_of_fill - mean).abs() < 0.06, "{mean_of_fill}");
        assert!((deviation_of_fill / deviation - 1.0).abs() < 0.2, "{deviation_of_fill}");
    }

    #[test]
    fn slow_changes_of_color_are_those_around_the_hole() {
        let (filled, _) = laid(|x, y| speckles(x, y) + 0.02 * x as f32, SIZE[0]);
        let columns = |of: std::ops::Range<usize>| -> Vec<[f32; 3]> {
            filled.chunks(24).flat_map(|row| row[of.clone()].to_vec()).collect()
        };
        let (left, right) = (moments(&columns(0..12)).0, moments(&columns(12..24)).0);
        let expected = |x: f32| 0.16 + 0.02 * x;
        assert!((left - expected(53.5)).abs() < 0.1, "{left} for {}", expected(53.5));
        assert!((right - expected(65.5)).abs() < 0.1, "{right} for {}", expected(65.5));
    }

    #[test]
    fn ground_without_room_for_a_piece_is_left_open() {
        assert_eq!(laid(speckles, 5).1, 0);
        assert_eq!(laid(speckles, 0).1, 0, "without examples");
    }

    #[test]
    fn the_result_does_not_depend_on_the_number_of_threads() {
        let on = |threads| {
            let pool =
                rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| laid(speckles, 90))
        };
        assert_eq!(on(1), on(3));
    }
}
