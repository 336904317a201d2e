//! Regions around seeds: a random walk that hardly ever crosses an edge.
//!
//! The probability that a walk from a superpixel meets a positive seed before a negative one, or before it
//! tires, is harmonic (Grady 2006, "Random walks for image segmentation"). It is nearly constant over
//! what nothing parts and drops where edges are strong. Superpixels in the order of their probability
//! form a chain of sets; the sets with the least conductance (cut over volume; Andersen, Chung and Lang
//! 2006, "Local graph partitioning using PageRank vectors") are what a prompt can mean, from part to whole.

use crate::index::SceneIndex;
use crate::plane::SupportPlane;
use crate::walks::Mark;

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
    /// Superpixels of nominal size just above what things stand on, per view; infinite where there is no plane.
    pub(crate) resting: f32,
}

/// Superpixels lower than this many sides above a plane rest on it.
const RESTING: f32 = 2.0;

/// Neighbors of a superpixel, about.
const NEIGHBORS: f32 = 4.0;

/// Area of a superpixel if it is just above what things stand on; infinite where there is no plane.
fn resting_area(index: &SceneIndex, node: u32) -> f32 {
    if index.planes.is_empty() {
        return f32::INFINITY;
    }
    let s = index.segment(node);
    let is_low = |p: &SupportPlane| p.height(s.point.into()) < p.reach(RESTING, s.width);
    let rests =
        index.planes.iter().any(is_low) || index.raised.iter().any(|r| r.is_near(s, RESTING));
    if rests { index.area(node) } else { 0.0 }
}

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
            resting += resting_area(index, i) / views;
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
