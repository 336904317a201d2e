//! The equations of random walks, several at once: conjugate gradients, preconditioned by a multigrid cycle.
//!
//! Walks on one graph read the same rows, and a product costs what reading them costs: up to [`LANES`] walks are computed in the
//! time of about one. Each comes out as it does alone, to the last bit: what is no part of one walk has a zero there, and sums
//! keep their order.

use crate::graph::Graph;
use crate::multigrid::{Lanes, Multigrid, by_block};

/// What a walk meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Mark {
    Free,
    Positive,
    Negative,
}

/// Walks of one solve.
const LANES: usize = 4;
/// Steps of the solver at most; scenes that were tried need 8 to 14.
const STEPS: usize = 60;
/// A solve ends when the square of its preconditioned residual falls to this share: about that of the energy of the error. From
/// 1e-6 on single clicks find other sets than the exact solution does.
const RESIDUAL: f64 = 1e-9;

/// Probability of meeting a positive mark first, `[nodes]`.
pub(crate) fn probabilities(graph: &Graph, marks: &[Mark]) -> Vec<f32> {
    let [alone] = solved(graph, &[marks]);
    alone
}

/// [`probabilities`] of several walks.
pub(crate) fn probabilities_of(graph: &Graph, walks: &[&[Mark]]) -> Vec<Vec<f32>> {
    walks
        .chunks(LANES)
        .flat_map(|walks| match *walks {
            [a] => solved(graph, &[a]).to_vec(),
            [a, b] => solved(graph, &[a, b]).to_vec(),
            [a, b, c] => solved(graph, &[a, b, c, c])[..3].to_vec(),
            [a, b, c, d] => solved(graph, &[a, b, c, d]).to_vec(),
            _ => Vec::new(),
        })
        .collect()
}

/// Conjugate gradients. Nothing that is marked has a value on the way.
fn solved<const N: usize>(graph: &Graph, marks: &[&[Mark]; N]) -> [Vec<f32>; N] {
    let hierarchy = graph.hierarchy();
    let nodes = graph.degrees.len();
    let is_free = |i: usize| marks.map(|marks| marks[i] == Mark::Free);
    let mut multigrid = Multigrid::new(hierarchy, is_free);
    let mut x = vec![[0.0f32; N]; nodes];
    let mut q = x.clone();
    let mut r = right(graph, marks);
    let (z, mut rz) = multigrid.cycle(&r);
    let mut p = z.to_vec();
    let start = rz;
    for _ in 0..STEPS {
        let goes_on: [bool; N] = std::array::from_fn(|l| rz[l] > RESIDUAL * start[l]);
        if !goes_on.contains(&true) {
            break;
        }
        // A walk that has ended stays as it is.
        let only = |l: usize, value: f64| if goes_on[l] { value as f32 } else { 0.0 };
        let pq = multigrid.product(&p, &mut q);
        let alpha: Lanes<N> = std::array::from_fn(|l| only(l, rz[l] / pq[l]));
        add(&mut x, &alpha, &p);
        add(&mut r, &alpha.map(|a| -a), &q);
        let (z, next) = multigrid.cycle(&r);
        let beta: Lanes<N> = std::array::from_fn(|l| only(l, next[l] / rz[l]));
        rz = std::array::from_fn(|l| if goes_on[l] { next[l] } else { rz[l] });
        by_block(&mut p, |first, p| {
            for (p, z) in p.iter_mut().zip(&z[first..]) {
                for l in 0..N {
                    p[l] = z[l] + beta[l] * p[l];
                }
            }
        });
    }
    std::array::from_fn(|l| walk(marks[l], l, &x))
}

/// What each free node sees of positive marks.
fn right<const N: usize>(graph: &Graph, marks: &[&[Mark]; N]) -> Vec<Lanes<N>> {
    let mut right = vec![[0.0f32; N]; graph.degrees.len()];
    for (l, marks) in marks.iter().enumerate() {
        let positive = marks.iter().enumerate().filter(|(_, mark)| **mark == Mark::Positive);
        for (j, c) in positive.flat_map(|(i, _)| graph.row(i)) {
            right[j][l] += if marks[j] == Mark::Free { c } else { 0.0 };
        }
    }
    right
}

fn add<const N: usize>(to: &mut [Lanes<N>], share: &Lanes<N>, what: &[Lanes<N>]) {
    by_block(to, |first, to| {
        for (to, what) in to.iter_mut().zip(&what[first..]) {
            for l in 0..N {
                to[l] += share[l] * what[l];
            }
        }
    });
}

/// A walk on all nodes.
fn walk<const N: usize>(marks: &[Mark], lane: usize, x: &[Lanes<N>]) -> Vec<f32> {
    let value = |(mark, x): (&Mark, &Lanes<N>)| match mark {
        Mark::Free => x[lane],
        Mark::Positive => 1.0,
        Mark::Negative => 0.0,
    };
    marks.iter().zip(x).map(value).collect()
}

#[cfg(test)]
mod tests {
    use motes_math::rng::keyed_rng;
    use rand::RngExt as _;

    use super::*;
    use crate::graph::{Link, TIRING};

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

    /// The same equations by Gauss-Seidel, node after node, until nothing changes.
    fn reference(graph: &Graph, marks: &[Mark]) -> Vec<f64> {
        let mut p: Vec<f64> =
            marks.iter().map(|m| f64::from(u8::from(*m == Mark::Positive))).collect();
        loop {
            let mut change = 0.0f64;
            for i in (0..p.len()).filter(|&i| marks[i] == Mark::Free) {
                let met: f64 = graph.row(i).map(|(j, c)| f64::from(c) * p[j]).sum();
                let d = f64::from(graph.degrees[i]) * (1.0 + f64::from(TIRING));
                let next = met / d.max(1e-12);
                change = change.max((next - p[i]).abs());
                p[i] = next;
            }
            if change < 1e-12 {
                return p;
            }
        }
    }

    /// `e' A e`, with nothing where a node is marked.
    fn energy(graph: &Graph, marks: &[Mark], e: &[f64]) -> f64 {
        let free = |i: usize| if marks[i] == Mark::Free { e[i] } else { 0.0 };
        let at = |i: usize| {
            let off: f64 = graph.row(i).map(|(j, c)| f64::from(c) * free(j)).sum();
            free(i) * (f64::from(graph.degrees[i]) * (1.0 + f64::from(TIRING)) * free(i) - off)
        };
        (0..e.len()).map(at).sum()
    }

    #[test]
    fn walks_are_what_a_plain_iteration_converges_to() {
        let graph = grid(70);
        assert!(graph.hierarchy().levels.len() >= 2, "several resolutions");
        for key in 1..4 {
            let marks = marks(4900, key);
            let exact = reference(&graph, &marks);
            let found = probabilities(&graph, &marks);
            let error: Vec<f64> =
                found.iter().zip(&exact).map(|(a, b)| f64::from(*a) - b).collect();
            let share = energy(&graph, &marks, &error) / energy(&graph, &marks, &exact);
            assert!(share < 1e-8, "{key}: energy {share:e}");
            // Where hardly anything holds a node to others, that is the least accurate.
            let worst = error.iter().fold(0.0f64, |worst, e| worst.max(e.abs()));
            assert!(worst < 2e-3, "{key}: {worst}");
        }
    }
}
