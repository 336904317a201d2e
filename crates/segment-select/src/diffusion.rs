//! Regions around seeds: a random walk that hardly ever crosses an edge.
//!
//! The probability that a walk from a superpixel meets a positive seed before a negative one, or before it
//! tires, is harmonic (Grady 2006, "Random walks for image segmentation"). It is nearly constant over
//! what nothing parts and drops where edges are strong. Superpixels in the order of their probability
//! form a chain of sets; the sets with the least conductance (cut over volume; Andersen, Chung and Lang
//! 2006, "Local graph partitioning using PageRank vectors") are what a prompt can mean, from part to whole.

use rayon::prelude::*;

use crate::graph::Graph;
use crate::index::SceneIndex;

/// What a walk meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Mark {
    Free,
    Positive,
    Negative,
}

/// A walk tires with this probability per step: it reaches some 30 superpixels.
const TIRING: f32 = 1e-3;
/// Steps of the solver; the residual falls below a thousandth long before on all scenes that were tried.
const STEPS: usize = 150;

/// Probability of meeting a positive mark first, `[nodes]`.
pub(crate) fn probabilities(graph: &Graph, marks: &[Mark]) -> Vec<f32> {
    let n = marks.len();
    let mut of_free = vec![u32::MAX; n];
    let free: Vec<u32> = (0..n as u32).filter(|&i| marks[i as usize] == Mark::Free).collect();
    free.iter().zip(0..).for_each(|(&i, k)| of_free[i as usize] = k);
    // Rows among the free ones, in one piece, so that a product reads memory once.
    let mut rows: Vec<(u32, f32)> = Vec::new();
    let mut offsets = vec![0usize];
    let (mut right, mut diagonal) = (Vec::new(), Vec::new());
    for &i in &free {
        let mut seen = 0.0;
        for (j, c) in graph.row(i as usize) {
            match marks[j] {
                Mark::Free => rows.push((of_free[j], c)),
                Mark::Positive => seen += c,
                Mark::Negative => {}
            }
        }
        offsets.push(rows.len());
        right.push(seen);
        diagonal.push((graph.degrees[i as usize] * (1.0 + TIRING)).max(1e-12));
    }
    let product = |x: &[f32], out: &mut [f32]| {
        out.par_chunks_mut(2048).enumerate().for_each(|(chunk, out)| {
            for (k, value) in out.iter_mut().enumerate() {
                let i = chunk * 2048 + k;
                let off: f32 =
                    rows[offsets[i]..offsets[i + 1]].iter().map(|&(j, c)| c * x[j as usize]).sum();
                *value = diagonal[i] * x[i] - off;
            }
        });
    };
    let dot = |a: &[f32], b: &[f32]| -> f64 {
        a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
    };
    // Conjugate gradients with the diagonal as preconditioner.
    let m = free.len();
    let (mut x, mut r, mut q) = (vec![0.0f32; m], right, vec![0.0f32; m]);
    let mut z: Vec<f32> = r.iter().zip(&diagonal).map(|(r, d)| r / d).collect();
    let mut p = z.clone();
    let mut rz = dot(&r, &z);
    let start = rz;
    for _ in 0..STEPS {
        if !(rz > 1e-9 * start) {
            break;
        }
        product(&p, &mut q);
        let alpha = (rz / dot(&p, &q)) as f32;
        for i in 0..m {
            x[i] += alpha * p[i];
            r[i] -= alpha * q[i];
            z[i] = r[i] / diagonal[i];
        }
        let next = dot(&r, &z);
        let beta = (next / rz) as f32;
        rz = next;
        (0..m).for_each(|i| p[i] = z[i] + beta * p[i]);
    }
    let mut out: Vec<f32> =
        marks.iter().map(|m| if *m == Mark::Positive { 1.0 } else { 0.0 }).collect();
    free.iter().zip(&x).for_each(|(&i, &v)| out[i as usize] = v);
    out
}

/// Sets that leave less than this share of everything are everything.
const LEAST_REST: f64 = 0.15;

/// A set of a chain: the steps up to this one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    /// The superpixel that this step adds.
    pub(crate) node: u32,
    /// Superpixels of nominal size.
    pub(crate) area: f32,
    /// Cut over volume, 0 to 1.
    pub(crate) conductance: f32,
    /// Length of the border where it touches what is not its support, over the volume that an area of
    /// this size has where nothing parts it.
    pub(crate) contact: f32,
    /// Superpixels of nominal size just above the support plane, per view; infinite where there is no plane.
    pub(crate) resting: f32,
}

/// Superpixels lower than this many sides above the support plane rest on it.
const RESTING: f32 = 2.0;

/// Neighbors of a superpixel, about.
const NEIGHBORS: f32 = 4.0;

/// Chain of sets in the order of probability.
pub(crate) fn sweep(index: &SceneIndex, probabilities: &[f32], marks: &[Mark]) -> Vec<Step> {
    let graph = &index.graph;
    let mut order: Vec<u32> = (0..probabilities.len() as u32)
        .filter(|&i| marks[i as usize] != Mark::Negative && probabilities[i as usize] > 0.0)
        .collect();
    order.sort_by(|&a, &b| {
        probabilities[b as usize].total_cmp(&probabilities[a as usize]).then(a.cmp(&b))
    });
    let total: f64 = graph.degrees.iter().map(|&d| f64::from(d)).sum();
    let mut inside = vec![false; probabilities.len()];
    let (mut cut, mut volume, mut touching) = (0.0f64, 0.0f64, 0.0f64);
    let (mut area, mut resting) = (0.0f32, 0.0f32);
    let views = index.views.len() as f32;
    order
        .into_iter()
        .map(|i| {
            for (j, c) in graph.row(i as usize) {
                cut += f64::from(if inside[j] { -c } else { c });
            }
            for (j, length) in graph.contacts_of(i as usize) {
                if marks[j] != Mark::Negative {
                    touching += f64::from(if inside[j] { -length } else { length });
                }
            }
            inside[i as usize] = true;
            volume += f64::from(graph.degrees[i as usize]);
            area += index.area(i);
            resting += index.plane.map_or(f32::INFINITY, |plane| {
                let s = index.segment(i);
                let low = plane.height(s.point.into()) < RESTING * s.width + 2.5 * plane.noise;
                if low { index.area(i) / views } else { 0.0 }
            });
            // Of the smaller side: everything together is not an object.
            let side = volume.min(total - volume);
            let is_part = side > LEAST_REST * total || volume < 0.5 * total;
            let conductance = if is_part { cut / side.max(1e-12) } else { 1.0 };
            Step {
                node: i,
                area,
                conductance: conductance.clamp(0.0, 1.0) as f32,
                contact: touching.max(0.0) as f32 / (NEIGHBORS * area),
                resting,
            }
        })
        .collect()
}
