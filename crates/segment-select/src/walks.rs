//! The equations of random walks, several at once.
//!
//! Walks on one graph read the same rows, and a product costs what reading them costs: up to [`LANES`] walks are computed in the
//! time of about one. Each comes out as it does alone, to the last bit: what is no part of one walk has a zero there, and sums
//! keep their order.

use rayon::prelude::*;

use crate::graph::Graph;

/// What a walk meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Mark {
    Free,
    Positive,
    Negative,
}

/// Walks of one solve.
const LANES: usize = 4;
/// A walk tires with this probability per step: it reaches some 30 superpixels.
const TIRING: f32 = 1e-3;
/// Steps of the solver; the residual falls below a thousandth long before on all scenes that were tried.
const STEPS: usize = 150;
/// A solve ends when the square of its preconditioned residual falls to this share.
const RESIDUAL: f64 = 1e-9;
/// Rows of a product that are one task.
const CHUNK: usize = 2048;

/// Probability of meeting a positive mark first, `[nodes]`.
pub(crate) fn probabilities(graph: &Graph, marks: &[Mark]) -> Vec<f32> {
    let [alone] = System::new(graph, &[marks]).solved();
    alone
}

/// [`probabilities`] of several walks.
pub(crate) fn probabilities_of(graph: &Graph, walks: &[&[Mark]]) -> Vec<Vec<f32>> {
    walks
        .chunks(LANES)
        .flat_map(|walks| match *walks {
            [a] => System::new(graph, &[a]).solved().to_vec(),
            [a, b] => System::new(graph, &[a, b]).solved().to_vec(),
            [a, b, c] => System::new(graph, &[a, b, c, c]).solved()[..3].to_vec(),
            [a, b, c, d] => System::new(graph, &[a, b, c, d]).solved().to_vec(),
            _ => Vec::new(),
        })
        .collect()
}

/// A value of each walk.
type Lanes<const N: usize> = [f32; N];

/// The equations of what is free in any of the walks.
struct System<'a, const N: usize> {
    marks: [&'a [Mark]; N],
    /// Nodes that are free in any.
    free: Vec<u32>,
    /// Rows among them, in one piece, so that a product reads memory once.
    rows: Vec<(u32, f32)>,
    offsets: Vec<usize>,
    diagonal: Vec<f32>,
    /// 1 where a node is free in a walk, else 0.
    is_free: Vec<Lanes<N>>,
    /// What each node sees of positive marks.
    right: Vec<Lanes<N>>,
}

impl<'a, const N: usize> System<'a, N> {
    fn new(graph: &Graph, marks: &[&'a [Mark]; N]) -> Self {
        let n = marks.first().map_or(0, |marks| marks.len());
        let free_in = |i: usize| marks.map(|marks| marks[i] == Mark::Free);
        let free: Vec<u32> =
            (0..n as u32).filter(|&i| free_in(i as usize).contains(&true)).collect();
        let mut of_free = vec![u32::MAX; n];
        free.iter().zip(0..).for_each(|(&i, k)| of_free[i as usize] = k);
        let mut system = Self {
            marks: *marks,
            rows: Vec::new(),
            offsets: vec![0],
            diagonal: Vec::with_capacity(free.len()),
            is_free: Vec::with_capacity(free.len()),
            right: Vec::with_capacity(free.len()),
            free,
        };
        for &i in &system.free {
            let mut seen = [0.0; N];
            for (j, c) in graph.row(i as usize) {
                if of_free[j] != u32::MAX {
                    system.rows.push((of_free[j], c));
                }
                for (seen, marks) in seen.iter_mut().zip(marks) {
                    *seen += if marks[j] == Mark::Positive { c } else { 0.0 };
                }
            }
            let is_free = free_in(i as usize).map(|free| f32::from(u8::from(free)));
            system.offsets.push(system.rows.len());
            system.right.push(std::array::from_fn(|l| seen[l] * is_free[l]));
            system.is_free.push(is_free);
            system.diagonal.push((graph.degrees[i as usize] * (1.0 + TIRING)).max(1e-12));
        }
        system
    }

    /// The matrix times `x`.
    fn product(&self, x: &[Lanes<N>], out: &mut [Lanes<N>]) {
        out.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, out)| {
            for (k, value) in out.iter_mut().enumerate() {
                let i = chunk * CHUNK + k;
                let mut off = [0.0f32; N];
                for &(j, c) in &self.rows[self.offsets[i]..self.offsets[i + 1]] {
                    let x = &x[j as usize];
                    for l in 0..N {
                        off[l] += c * x[l];
                    }
                }
                for l in 0..N {
                    value[l] = (self.diagonal[i] * x[i][l] - off[l]) * self.is_free[i][l];
                }
            }
        });
    }

    /// Conjugate gradients with the diagonal as preconditioner.
    fn solved(self) -> [Vec<f32>; N] {
        let m = self.free.len();
        let (mut x, mut r, mut q) =
            (vec![[0.0f32; N]; m], self.right.clone(), vec![[0.0f32; N]; m]);
        let over = |r: &Lanes<N>, d: f32| r.map(|r| r / d);
        let mut z: Vec<Lanes<N>> = r.iter().zip(&self.diagonal).map(|(r, &d)| over(r, d)).collect();
        let mut p = z.clone();
        let mut rz = dot(&r, &z);
        let start = rz;
        for _ in 0..STEPS {
            let goes_on: [bool; N] = std::array::from_fn(|l| rz[l] > RESIDUAL * start[l]);
            if !goes_on.contains(&true) {
                break;
            }
            self.product(&p, &mut q);
            let pq = dot(&p, &q);
            // A walk that has ended stays as it is.
            let only = |l: usize, value: f64| if goes_on[l] { value as f32 } else { 0.0 };
            let alpha: Lanes<N> = std::array::from_fn(|l| only(l, rz[l] / pq[l]));
            for i in 0..m {
                for l in 0..N {
                    x[i][l] += alpha[l] * p[i][l];
                    r[i][l] -= alpha[l] * q[i][l];
                    z[i][l] = r[i][l] / self.diagonal[i];
                }
            }
            let next = dot(&r, &z);
            let beta: Lanes<N> = std::array::from_fn(|l| only(l, next[l] / rz[l]));
            rz = std::array::from_fn(|l| if goes_on[l] { next[l] } else { rz[l] });
            for (p, z) in p.iter_mut().zip(&z) {
                for l in 0..N {
                    p[l] = z[l] + beta[l] * p[l];
                }
            }
        }
        std::array::from_fn(|l| self.walk(l, &x))
    }

    /// A walk on all nodes.
    fn walk(&self, lane: usize, x: &[Lanes<N>]) -> Vec<f32> {
        let marks = self.marks[lane];
        let is_positive = |m: &Mark| f32::from(u8::from(*m == Mark::Positive));
        let mut out: Vec<f32> = marks.iter().map(is_positive).collect();
        for (&i, x) in self.free.iter().zip(x) {
            if marks[i as usize] == Mark::Free {
                out[i as usize] = x[lane];
            }
        }
        out
    }
}

/// Inner products.
fn dot<const N: usize>(a: &[Lanes<N>], b: &[Lanes<N>]) -> [f64; N] {
    let mut sums = [0.0f64; N];
    for (a, b) in a.iter().zip(b) {
        for l in 0..N {
            sums[l] += f64::from(a[l]) * f64::from(b[l]);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use motes_math::rng::keyed_rng;
    use rand::RngExt as _;

    use super::*;
    use crate::graph::Link;

    /// A grid with edges of any strength, and marks of a walk.
    fn grid(side: u32) -> Graph {
        let mut random = keyed_rng(3, 0, 0);
        let mut links = Vec::new();
        for y in 0..side {
            for x in 0..side {
                let here = y * side + x;
                let others = [(x + 1 < side, here + 1), (y + 1 < side, here + side)];
                for (_, there) in others.iter().filter(|(inside, _)| *inside) {
                    let strength = random.random::<f32>();
                    links.push(Link { nodes: [here, *there], weight: 1.0, strength, contact: 0.0 });
                }
            }
        }
        Graph::new((side * side) as usize, &links)
    }

    fn marks(nodes: usize, key: u64) -> Vec<Mark> {
        let mut random = keyed_rng(key, 1, 0);
        let mark = |_| match random.random::<f32>() {
            v if v < 0.01 * key as f32 => Mark::Positive,
            v if v > 0.9 => Mark::Negative,
            _ => Mark::Free,
        };
        (0..nodes).map(mark).collect()
    }

    #[test]
    fn walks_together_are_the_walks_alone_to_the_last_bit() {
        let graph = grid(70);
        // The first has nothing to meet, the last is all marks.
        let mut all: Vec<Vec<Mark>> = (0..6).map(|key| marks(4900, key)).collect();
        all.push(vec![Mark::Positive; 4900]);
        let alone: Vec<Vec<f32>> = all.iter().map(|marks| probabilities(&graph, marks)).collect();
        assert!(alone[0].iter().all(|p| *p == 0.0));
        assert!(alone[1].iter().any(|p| *p > 0.2 && *p < 0.8));
        for count in 1..=all.len() {
            let some: Vec<&[Mark]> = all[..count].iter().map(Vec::as_slice).collect();
            let together = probabilities_of(&graph, &some);
            assert_eq!(together.len(), count);
            for (k, (a, b)) in together.iter().zip(&alone).enumerate() {
                let same = a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
                assert!(same, "walk {k} of {count}");
            }
        }
    }

    #[test]
    fn a_walk_between_two_marks_meets_the_nearer_one() {
        let links: Vec<Link> = (0..9)
            .map(|i| Link { nodes: [i, i + 1], weight: 1.0, strength: 0.0, contact: 0.0 })
            .collect();
        let mut marks = vec![Mark::Free; 10];
        (marks[0], marks[9]) = (Mark::Positive, Mark::Negative);
        let found = probabilities(&Graph::new(10, &links), &marks);
        // Harmonic: a straight line, but for what tires.
        for (i, p) in found.iter().enumerate() {
            assert!((p - (1.0 - i as f32 / 9.0)).abs() < 0.02, "{i}: {p}");
        }
    }
}
