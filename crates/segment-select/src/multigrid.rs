//! A multigrid cycle for the equations of random walks, several at once.
//!
//! `A = D - C` on the nodes that are free in a walk, `C` the conductances. The matrix of a coarser graph is the sum over
//! aggregates, `P' A P`, of what is free, so a cycle knows every mark (Briggs, Henson & McCormick 2000, "A multigrid tutorial",
//! chapter 8). Smoothing is Gauss-Seidel within blocks of rows and Jacobi between them, upward before and downward after the
//! coarser graph: the cycle is symmetric, as conjugate gradients need, and as `A` is diagonally dominant it is positive definite.

use std::borrow::Cow;

use rayon::prelude::*;

use crate::coarsening::{BLOCK, Coarser, Hierarchy, Pattern, WITHIN};

/// A value of each walk.
pub(crate) type Lanes<const N: usize> = [f32; N];

/// Cycles on each coarser graph, and on the coarsest, where there is nothing below.
const CYCLES: usize = 2;
const COARSEST_CYCLES: usize = 4;

/// An entry of a matrix: one for all walks, or one for each.
pub(crate) trait Entry<const N: usize>: Copy + Send + Sync {
    fn of_walks(self) -> Lanes<N>;
}

impl<const N: usize> Entry<N> for f32 {
    #[inline(always)]
    fn of_walks(self) -> Lanes<N> {
        [self; N]
    }
}

impl<const N: usize> Entry<N> for Lanes<N> {
    #[inline(always)]
    fn of_walks(self) -> Lanes<N> {
        self
    }
}

/// Calls `task` with the place and the values of each block; in order where there is only one.
pub(crate) fn by_block<T: Send, R: Send>(
    values: &mut [T],
    task: impl Fn(usize, &mut [T]) -> R + Sync,
) -> Vec<R> {
    if values.len() <= BLOCK {
        return vec![task(0, values)];
    }
    let blocks = values.par_chunks_mut(BLOCK).enumerate();
    blocks.map(|(k, values)| task(k * BLOCK, values)).collect()
}

/// `A` at one resolution.
struct Level<'a, E: Clone, const N: usize> {
    pattern: &'a Pattern,
    /// Conductances, in the order of the pattern.
    entries: Cow<'a, [E]>,
    diagonal: Cow<'a, [E]>,
    /// 1 over the diagonal where a node is free in a walk, else 0.
    inverse: Vec<Lanes<N>>,
    /// Whether a node, or all of an aggregate, is free in every walk.
    is_whole: Vec<bool>,
}

impl<E: Entry<N>, const N: usize> Level<'_, E, N> {
    #[inline(always)]
    fn add(&self, at: std::ops::Range<usize>, x: &[Lanes<N>], first: usize, sum: &mut Lanes<N>) {
        let entries = self.entries[at.clone()].iter();
        for (&j, c) in self.pattern.neighbors[at].iter().zip(entries) {
            let (x, c) = (&x[j as usize - first], c.of_walks());
            for l in 0..N {
                sum[l] += c[l] * x[l];
            }
        }
    }

    /// `A x` in a row, 0 where it is not free.
    #[inline(always)]
    fn row_of_product(&self, i: usize, x: &[Lanes<N>]) -> Lanes<N> {
        let mut sum = [0.0; N];
        self.add(self.pattern.row(i), x, 0, &mut sum);
        let d = self.diagonal[i].of_walks();
        self.only_free(i, std::array::from_fn(|l| d[l] * x[i][l] - sum[l]))
    }

    #[inline(always)]
    fn only_free(&self, i: usize, value: Lanes<N>) -> Lanes<N> {
        let inverse = &self.inverse[i];
        std::array::from_fn(|l| if inverse[l] == 0.0 { 0.0 } else { value[l] })
    }

    fn is_free(&self, i: usize) -> bool {
        self.inverse[i] != [0.0; N]
    }

    /// Gauss-Seidel upward from `x`, which is zero where there is none.
    fn upward(&self, r: &[Lanes<N>], x: Option<&[Lanes<N>]>, out: &mut [Lanes<N>]) {
        by_block(out, |first, out| {
            for k in 0..out.len() {
                let i = first + k;
                if !self.is_free(i) {
                    out[k] = [0.0; N];
                    continue;
                }
                let mut sum = r[i];
                if let Some(x) = x {
                    self.add(self.pattern.not_lower(i), x, 0, &mut sum);
                }
                // What was computed last comes last: the rest does not wait for it.
                self.add(self.pattern.lower(i), out, first, &mut sum);
                out[k] = std::array::from_fn(|l| sum[l] * self.inverse[i][l]);
            }
        });
    }

    /// Gauss-Seidel downward from `x`.
    fn downward(&self, r: &[Lanes<N>], x: &[Lanes<N>], out: &mut [Lanes<N>]) {
        by_block(out, |first, out| {
            for k in (0..out.len()).rev() {
                let i = first + k;
                if !self.is_free(i) {
                    out[k] = [0.0; N];
                    continue;
                }
                let mut sum = r[i];
                self.add(self.pattern.not_higher(i), x, 0, &mut sum);
                self.add(self.pattern.higher(i), out, first, &mut sum);
                out[k] = std::array::from_fn(|l| sum[l] * self.inverse[i][l]);
            }
        });
    }

    /// What `x` leaves of `r`, summed over aggregates.
    fn restricted(
        &self,
        coarser: &Coarser,
        r: &[Lanes<N>],
        x: &[Lanes<N>],
        is_first: bool,
        out: &mut [Lanes<N>],
    ) {
        by_block(out, |first, out| {
            for (k, out) in out.iter_mut().enumerate() {
                *out = [0.0; N];
                for i in coarser.members(first + k).iter().map(|&i| i as usize) {
                    let left = match is_first {
                        // Gauss-Seidel from zero has left what it did not know of.
                        true => {
                            let mut sum = [0.0; N];
                            self.add(self.pattern.not_lower(i), x, 0, &mut sum);
                            self.only_free(i, sum)
                        }
                        false => {
                            let product = self.row_of_product(i, x);
                            self.only_free(i, std::array::from_fn(|l| r[i][l] - product[l]))
                        }
                    };
                    for l in 0..N {
                        out[l] += left[l];
                    }
                }
            }
        });
    }

    /// The matrix of the next coarser graph.
    fn coarsened<'b>(&self, coarser: &'b Coarser) -> Level<'b, Lanes<N>, N> {
        let pattern = &coarser.pattern;
        let mut is_whole = vec![false; pattern.rows()];
        by_block(&mut is_whole, |first, whole| {
            for (k, whole) in whole.iter_mut().enumerate() {
                *whole = coarser.members(first + k).iter().all(|&i| self.is_whole[i as usize]);
            }
        });
        let mut diagonal = vec![[0.0f32; N]; pattern.rows()];
        let parts = by_block(&mut diagonal, |first, diagonal| {
            let begin = pattern.row(first).start;
            let end = pattern.row(first + diagonal.len() - 1).end;
            // Right where nothing around is marked.
            let mut entries: Vec<Lanes<N>> =
                coarser.values[begin..end].iter().map(|&c| [c; N]).collect();
            for (k, diagonal) in diagonal.iter_mut().enumerate() {
                let row = pattern.row(first + k);
                let around = pattern.neighbors[row.clone()].iter();
                if is_whole[first + k] && around.clone().all(|&j| is_whole[j as usize]) {
                    *diagonal = [coarser.diagonal[first + k]; N];
                    continue;
                }
                entries[row.start - begin..row.end - begin].fill([0.0; N]);
                self.sum(coarser, first + k, &mut entries, begin, diagonal);
            }
            entries
        });
        let over = |d: f32| if d > 0.0 { 1.0 / d } else { 0.0 };
        let inverse = diagonal.iter().map(|d| d.map(over)).collect();
        Level {
            pattern,
            entries: parts.concat().into(),
            diagonal: diagonal.into(),
            inverse,
            is_whole,
        }
    }

    /// A row of the coarser matrix: sums of what is free.
    fn sum(
        &self,
        coarser: &Coarser,
        aggregate: usize,
        entries: &mut [Lanes<N>],
        begin: usize,
        diagonal: &mut Lanes<N>,
    ) {
        for i in coarser.members(aggregate).iter().map(|&i| i as usize) {
            if !self.is_free(i) {
                continue;
            }
            let d = self.only_free(i, self.diagonal[i].of_walks());
            (0..N).for_each(|l| diagonal[l] += d[l]);
            for at in self.pattern.row(i) {
                let c = self.only_free(i, self.entries[at].of_walks());
                let c = self.only_free(self.pattern.neighbors[at] as usize, c);
                match coarser.slots[at] {
                    WITHIN => (0..N).for_each(|l| diagonal[l] -= c[l]),
                    slot => {
                        let entry = &mut entries[slot as usize - begin];
                        (0..N).for_each(|l| entry[l] += c[l]);
                    }
                }
            }
        }
    }
}

/// What a cycle needs at one resolution.
#[derive(Default)]
struct Space<const N: usize> {
    right: Vec<Lanes<N>>,
    x: Vec<Lanes<N>>,
    other: Vec<Lanes<N>>,
}

impl<const N: usize> Space<N> {
    fn new(rows: usize) -> Self {
        let zeros = vec![[0.0; N]; rows];
        Self { right: zeros.clone(), x: zeros.clone(), other: zeros }
    }
}

/// `A` at all resolutions.
pub(crate) struct Multigrid<'a, const N: usize> {
    fine: Level<'a, f32, N>,
    coarse: Vec<(&'a Coarser, Level<'a, Lanes<N>, N>)>,
    space: Vec<Space<N>>,
}

impl<'a, const N: usize> Multigrid<'a, N> {
    /// The matrix on the nodes that are free in each walk.
    pub(crate) fn new(
        hierarchy: &'a Hierarchy,
        is_free: impl Fn(usize) -> [bool; N] + Sync,
    ) -> Self {
        let rows = hierarchy.diagonal.len();
        let mut inverse = vec![[0.0f32; N]; rows];
        let is_whole = by_block(&mut inverse, |first, inverse| {
            let fill = |(k, inverse): (usize, &mut Lanes<N>)| {
                let (over, is_free) = (1.0 / hierarchy.diagonal[first + k], is_free(first + k));
                *inverse = is_free.map(|is_free| if is_free { over } else { 0.0 });
                is_free == [true; N]
            };
            inverse.iter_mut().enumerate().map(fill).collect::<Vec<bool>>()
        });
        let fine = Level {
            pattern: &hierarchy.fine.pattern,
            entries: hierarchy.fine.values.as_slice().into(),
            diagonal: hierarchy.diagonal.as_slice().into(),
            inverse,
            is_whole: is_whole.concat(),
        };
        let mut coarse: Vec<(&Coarser, Level<'_, Lanes<N>, N>)> = Vec::new();
        for coarser in &hierarchy.levels {
            let next = match coarse.last() {
                None => fine.coarsened(coarser),
                Some((_, level)) => level.coarsened(coarser),
            };
            coarse.push((coarser, next));
        }
        let all = [rows].into_iter().chain(coarse.iter().map(|(_, level)| level.diagonal.len()));
        let space = all.map(Space::new).collect();
        Self { fine, coarse, space }
    }

    /// `q = A p`, and their inner products.
    pub(crate) fn product(&self, p: &[Lanes<N>], q: &mut [Lanes<N>]) -> [f64; N] {
        total(by_block(q, |first, q| {
            for (k, q) in q.iter_mut().enumerate() {
                *q = match self.fine.is_free(first + k) {
                    true => self.fine.row_of_product(first + k, p),
                    false => [0.0; N],
                };
            }
            dot(q, &p[first..first + q.len()])
        }))
    }

    /// About `A⁻¹ r`, and its inner products with `r`.
    pub(crate) fn cycle(&mut self, r: &[Lanes<N>]) -> (&[Lanes<N>], [f64; N]) {
        cycle(&self.fine, &self.coarse, r, true, &mut self.space);
        let x = &mut self.space[0].x;
        let products = by_block(x, |first, x| dot(x, &r[first..first + x.len()]));
        (x, total(products))
    }
}

/// A cycle from `space[0].x`, or from zero.
fn cycle<E: Entry<N>, const N: usize>(
    level: &Level<'_, E, N>,
    coarse: &[(&Coarser, Level<'_, Lanes<N>, N>)],
    r: &[Lanes<N>],
    from_zero: bool,
    space: &mut [Space<N>],
) {
    let Some((own, below)) = space.split_first_mut() else { return };
    level.upward(r, (!from_zero).then_some(&own.x), &mut own.other);
    if let (Some(((coarser, next), coarse)), Some(space)) =
        (coarse.split_first(), below.first_mut())
    {
        level.restricted(coarser, r, &own.other, from_zero, &mut space.right);
        let right = std::mem::take(&mut space.right);
        for k in 0..if coarse.is_empty() { COARSEST_CYCLES } else { CYCLES } {
            cycle(next, coarse, &right, k == 0, below);
        }
        below[0].right = right;
        let e = &below[0].x;
        by_block(&mut own.other, |first, x| {
            for (k, x) in x.iter_mut().enumerate() {
                let (e, free) =
                    (&e[coarser.aggregate[first + k] as usize], &level.inverse[first + k]);
                for l in 0..N {
                    x[l] += if free[l] == 0.0 { 0.0 } else { e[l] };
                }
            }
        });
    }
    level.downward(r, &own.other, &mut own.x);
}

/// Inner products.
pub(crate) fn dot<const N: usize>(a: &[Lanes<N>], b: &[Lanes<N>]) -> [f64; N] {
    let mut sums = [0.0f64; N];
    for (a, b) in a.iter().zip(b) {
        for l in 0..N {
            sums[l] += f64::from(a[l]) * f64::from(b[l]);
        }
    }
    sums
}

/// The sums of blocks, in order.
pub(crate) fn total<const N: usize>(blocks: Vec<[f64; N]>) -> [f64; N] {
    let mut sums = [0.0f64; N];
    for block in blocks {
        for l in 0..N {
            sums[l] += block[l];
        }
    }
    sums
}
