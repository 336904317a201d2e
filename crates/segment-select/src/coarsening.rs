//! A graph at coarser and coarser resolutions, for multigrid.
//!
//! Nodes are joined in pairs along their strongest edges, the pairs in pairs, and those once more (pairwise aggregation: Notay 2010,
//! "An aggregation-based algebraic multigrid method"). Edges that nearly part two nodes are never followed, so an
//! aggregate lies on one thing. It depends on the graph alone and is kept with it.

use std::ops::Range;

/// Rows that are smoothed one after the other, and the task of one thread: fixed, so that results do not depend on threads.
pub(crate) const BLOCK: usize = 2048;
/// Passes of pairing per level: aggregates of up to eight.
const PASSES: usize = 3;
/// A pair is joined by an edge of at least this share of the strongest one of its node (Notay's bound).
const STRONG: f32 = 0.25;
/// No graph of fewer nodes is made coarser: smoothing solves it.
const COARSEST: usize = 100;
/// Nor one that this share of its nodes would be left of.
const USEFUL: f32 = 0.7;
const MOST_LEVELS: usize = 8;
/// An entry between two nodes of one aggregate has no entry in the coarser matrix.
pub(crate) const WITHIN: u32 = u32::MAX;

/// Where the entries of a symmetric matrix are, without its diagonal. Those of a row are in three parts: lower
/// rows of its block, rows of other blocks, higher rows of its block.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pattern {
    /// Where each part of each row begins, `[rows + 1]`.
    starts: Vec<[u32; 3]>,
    pub(crate) neighbors: Vec<u32>,
}

impl Pattern {
    pub(crate) fn rows(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    pub(crate) fn row(&self, i: usize) -> Range<usize> {
        self.starts[i][0] as usize..self.starts[i + 1][0] as usize
    }

    pub(crate) fn lower(&self, i: usize) -> Range<usize> {
        self.starts[i][0] as usize..self.starts[i][1] as usize
    }

    pub(crate) fn higher(&self, i: usize) -> Range<usize> {
        self.starts[i][2] as usize..self.starts[i + 1][0] as usize
    }

    /// All but the lower ones.
    pub(crate) fn not_lower(&self, i: usize) -> Range<usize> {
        self.starts[i][1] as usize..self.starts[i + 1][0] as usize
    }

    /// All but the higher ones.
    pub(crate) fn not_higher(&self, i: usize) -> Range<usize> {
        self.starts[i][0] as usize..self.starts[i][2] as usize
    }
}

/// Conductances without parallel edges.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    pub(crate) pattern: Pattern,
    pub(crate) values: Vec<f32>,
}

impl Rows {
    /// Rows from lists of neighbors, which may repeat; `fill` appends those of a row.
    fn new(rows: usize, fill: impl Fn(usize, &mut Vec<(u32, f32)>)) -> Self {
        let mut out = Self::default();
        let mut list = Vec::new();
        for i in 0..rows {
            list.clear();
            fill(i, &mut list);
            list.sort_by_key(|&(j, _)| j);
            list.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                kept.1 += if same { next.1 } else { 0.0 };
                same
            });
            let part = |&(j, _): &(u32, f32)| match (j as usize / BLOCK == i / BLOCK, j as usize) {
                (true, j) => {
                    if j > i {
                        2
                    } else {
                        0
                    }
                }
                _ => 1,
            };
            list.sort_by_key(part);
            // The nearest row is the last one on both sides: the sums before it do not wait for it.
            let higher = list.partition_point(|e| part(e) < 2);
            list[higher..].reverse();
            let first = out.values.len();
            let begin = |k: usize| (first + list.partition_point(|e| part(e) < k)) as u32;
            out.pattern.starts.push([begin(0), begin(1), begin(2)]);
            out.pattern.neighbors.extend(list.iter().map(|e| e.0));
            out.values.extend(list.iter().map(|e| e.1));
        }
        out.pattern.starts.push([out.values.len() as u32; 3]);
        out
    }

    fn row(&self, i: usize) -> impl Iterator<Item = (u32, f32)> + '_ {
        let range = self.pattern.row(i);
        self.pattern.neighbors[range.clone()]
            .iter()
            .copied()
            .zip(self.values[range].iter().copied())
    }

    /// The strongest edge of each node.
    fn strongest(&self) -> Vec<f32> {
        let of = |i| self.row(i).map(|(_, c)| c).fold(0.0, f32::max);
        (0..self.pattern.rows()).map(of).collect()
    }

    /// The pair of each node; they are numbered in the order of their first nodes. A node whose strong neighbors have all
    /// been taken joins the pair of the strongest. `strong` is what makes an edge strong for each node.
    fn pairs(&self, strong: &[f32]) -> Parts {
        let rows = self.pattern.rows();
        let mut of = vec![u32::MAX; rows];
        let mut count = 0;
        for i in 0..rows {
            if of[i] != u32::MAX {
                continue;
            }
            let (mut strongest, mut best) = ((0.0, None), (0.0, None));
            for (j, c) in self.row(i) {
                if c > strongest.0 {
                    strongest = (c, Some(j));
                }
                if c > best.0 && of[j as usize] == u32::MAX {
                    best = (c, Some(j));
                }
            }
            match (best, strongest) {
                ((c, Some(j)), _) if c >= strong[i] => {
                    (of[i], of[j as usize]) = (count, count);
                    count += 1;
                }
                (_, (c, Some(j))) if c >= strong[i] && of[j as usize] != u32::MAX => {
                    of[i] = of[j as usize];
                }
                _ => {
                    of[i] = count;
                    count += 1;
                }
            }
        }
        Parts { of, count: count as usize }
    }

    /// The conductances between the parts.
    fn joined(&self, parts: &Parts, (starts, members): &(Vec<u32>, Vec<u32>)) -> Self {
        Self::new(parts.count, |part, list| {
            for &i in &members[starts[part] as usize..starts[part + 1] as usize] {
                let outside = self.row(i as usize).map(|(j, c)| (parts.of[j as usize], c));
                list.extend(outside.filter(|(other, _)| *other as usize != part));
            }
        })
    }
}

/// A partition of nodes.
struct Parts {
    of: Vec<u32>,
    count: usize,
}

impl Parts {
    /// The largest value of each part.
    fn most(&self, values: &[f32]) -> Vec<f32> {
        let mut most = vec![0.0f32; self.count];
        for (&part, v) in self.of.iter().zip(values) {
            most[part as usize] = most[part as usize].max(*v);
        }
        most
    }

    /// Nodes by part: where each part begins, and the nodes.
    fn members(&self) -> (Vec<u32>, Vec<u32>) {
        let mut starts = vec![0u32; self.count + 1];
        self.of.iter().for_each(|&part| starts[part as usize + 1] += 1);
        (0..self.count).for_each(|part| starts[part + 1] += starts[part]);
        let mut next = starts.clone();
        let mut members = vec![0u32; self.of.len()];
        for (node, &part) in self.of.iter().enumerate() {
            members[next[part as usize] as usize] = node as u32;
            next[part as usize] += 1;
        }
        (starts, members)
    }
}

/// How a graph becomes the next coarser one, and that one.
#[derive(Clone, Debug)]
pub(crate) struct Coarser {
    /// The aggregate of each node.
    pub(crate) aggregate: Vec<u32>,
    starts: Vec<u32>,
    members: Vec<u32>,
    /// The entry of the coarser matrix that each entry is added to, or [`WITHIN`].
    pub(crate) slots: Vec<u32>,
    /// The entries of the coarser matrix.
    pub(crate) pattern: Pattern,
    /// The coarser matrix where nothing is marked: conductances in the order of the pattern, and the diagonal.
    pub(crate) values: Vec<f32>,
    pub(crate) diagonal: Vec<f32>,
}

impl Coarser {
    fn new(rows: &Rows, diagonal: &[f32]) -> Self {
        // Strength is measured against the edges of single nodes: what is bound tightly within and hardly to others stays
        // an aggregate of its own, which smoothing could not set apart from them.
        let mut strong = rows.strongest();
        strong.iter_mut().for_each(|c| *c *= STRONG);
        let mut parts = rows.pairs(&strong);
        strong = parts.most(&strong);
        let mut joined = rows.joined(&parts, &parts.members());
        for _ in 1..PASSES {
            let pairs = joined.pairs(&strong);
            joined = joined.joined(&pairs, &pairs.members());
            strong = pairs.most(&strong);
            parts.of.iter_mut().for_each(|part| *part = pairs.of[*part as usize]);
            parts.count = pairs.count;
        }
        let members = parts.members();
        let mut slots = vec![WITHIN; rows.values.len()];
        for i in 0..rows.pattern.rows() {
            let row = joined.pattern.row(parts.of[i] as usize);
            for at in rows.pattern.row(i) {
                let other = parts.of[rows.pattern.neighbors[at] as usize];
                let slot = joined.pattern.neighbors[row.clone()].iter().position(|&j| j == other);
                slots[at] = slot.map_or(WITHIN, |slot| (row.start + slot) as u32);
            }
        }
        let mut coarser = Self {
            aggregate: parts.of,
            starts: members.0,
            members: members.1,
            slots,
            values: vec![0.0; joined.values.len()],
            diagonal: vec![0.0; parts.count],
            pattern: joined.pattern,
        };
        coarser.sum(rows, diagonal);
        coarser
    }

    /// The coarser matrix, in the order in which it is summed where something is marked: equal to the last bit.
    fn sum(&mut self, rows: &Rows, diagonal: &[f32]) {
        for aggregate in 0..self.diagonal.len() {
            let range = self.starts[aggregate] as usize..self.starts[aggregate + 1] as usize;
            for i in self.members[range].iter().map(|&i| i as usize) {
                self.diagonal[aggregate] += diagonal[i];
                for at in rows.pattern.row(i) {
                    match self.slots[at] {
                        WITHIN => self.diagonal[aggregate] -= rows.values[at],
                        slot => self.values[slot as usize] += rows.values[at],
                    }
                }
            }
        }
    }

    /// The nodes of an aggregate.
    pub(crate) fn members(&self, aggregate: usize) -> &[u32] {
        &self.members[self.starts[aggregate] as usize..self.starts[aggregate + 1] as usize]
    }
}

/// A graph and its coarser ones.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hierarchy {
    pub(crate) fine: Rows,
    pub(crate) diagonal: Vec<f32>,
    pub(crate) levels: Vec<Coarser>,
}

impl Hierarchy {
    /// Of a matrix with this diagonal; `neighbors` appends what a node is linked to with what conductance, which may repeat.
    pub(crate) fn new(diagonal: Vec<f32>, neighbors: impl Fn(usize, &mut Vec<(u32, f32)>)) -> Self {
        let fine = Rows::new(diagonal.len(), neighbors);
        let mut levels: Vec<Coarser> = Vec::new();
        let mut rows = fine.clone();
        while rows.pattern.rows() > COARSEST && levels.len() < MOST_LEVELS {
            let above = levels.last().map_or(&diagonal, |level| &level.diagonal);
            let coarser = Coarser::new(&rows, above);
            if coarser.diagonal.len() as f32 > USEFUL * rows.pattern.rows() as f32 {
                break;
            }
            rows = Rows { pattern: coarser.pattern.clone(), values: coarser.values.clone() };
            levels.push(coarser);
        }
        Self { fine, diagonal, levels }
    }
}
