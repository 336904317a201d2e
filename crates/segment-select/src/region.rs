//! Sets of superpixels that a prompt can mean, and what each costs.

use crate::diffusion::{Step, sweep};
use crate::enclosed::enclosed;
use crate::index::SceneIndex;
use crate::seeds::membership;
use crate::walks::{Mark, probabilities};

/// A part is at most this share of its whole.
pub(crate) const PART_SHARE: f32 = 0.6;
/// The set of least `(conductance + CLOSED + CONTACT contact) * area^AREA_POWER` is meant. Conductances far
/// below `CLOSED` are all alike: several objects that touch are together always a little better closed
/// than each, and then the smaller set is wanted. An object rests on its support; what touches other things along
/// much of its border, or hangs in the air, is rather a part of one.
const AREA_POWER: f32 = 0.4;
pub(crate) const CLOSED: f32 = 0.015;
const CONTACT: f32 = 0.2;
/// Where a smaller set is known to be incomplete: the next larger one that is closed, not the one that is meant.
const NEXT_POWER: f32 = 0.8;
/// Something lies inside a set from this share of its area on. On all objects that were tried it is less for the object,
/// 0.05 to 0.1 for one loop of a knot.
pub(crate) const INSIDE: f32 = 0.015;
/// What lies inside a set costs this much of it where it is just enough to be looked for.
const INCOMPLETE: f32 = 0.5;
/// Times that what lies inside is taken along.
const TAKINGS: usize = 8;
/// What is added to the cost of a set that does not rest on the support plane, in shares of it: what lies on another
/// thing is still found.
const ALOFT: f32 = 0.4;
/// A set rests from about this many superpixels per view at the plane on.
const RESTING: f32 = 0.1;

/// What says against a set being what is meant.
fn cost(s: &Step, power: f32) -> f32 {
    let aloft = 1.0 + ALOFT * (-s.resting / RESTING).exp();
    (s.conductance + CLOSED + CONTACT * s.contact) * s.area.powf(power) * aloft
}

/// The cheapest set of a chain: its length and last step.
fn best_set(chain: &[Step], least: f32, most: f32, power: f32) -> Option<(usize, Step)> {
    let usable =
        chain.iter().copied().enumerate().filter(|(_, s)| s.area >= least && s.area <= most);
    let best = usable.min_by(|a, b| cost(&a.1, power).total_cmp(&cost(&b.1, power)));
    best.map(|(k, last)| (k + 1, last))
}

/// The cheapest set of a chain with areas from `least` to `most`, the cheapest one that is clearly smaller, and so on; each
/// with its last step.
pub(crate) fn nested(
    chain: &[Step],
    least: f32,
    mut most: f32,
) -> impl Iterator<Item = (Vec<u32>, Step)> {
    std::iter::from_fn(move || {
        let (length, last) = best_set(chain, least, most, AREA_POWER)?;
        most = PART_SHARE * last.area;
        Some((chain[..length].iter().map(|s| s.node).collect(), last))
    })
}

/// A set, its last step, what lies inside it and the share of its area that this is.
#[derive(Clone, Debug)]
pub(crate) struct Region {
    pub(crate) nodes: Vec<u32>,
    pub(crate) last: Step,
    pub(crate) inside: Vec<u32>,
    pub(crate) share: f32,
}

impl Region {
    pub(crate) fn new(index: &SceneIndex, steps: &[Step], last: Step, marks: &[Mark]) -> Self {
        let nodes: Vec<u32> = steps.iter().map(|s| s.node).collect();
        let (inside, share) = enclosed(index, &nodes, marks);
        Self { nodes, last, inside, share }
    }
}

/// The whole object.
pub(crate) fn whole(
    index: &SceneIndex,
    chain: &[Step],
    marks: &[Mark],
    least: f32,
) -> Option<Region> {
    let (count, last) = best_set(chain, least, f32::INFINITY, AREA_POWER)?;
    let first = Region::new(index, &chain[..count], last, marks);
    if first.share < INSIDE {
        return Some(first);
    }
    // It may be a piece of one thing with another thing: from the smallest closed one on.
    let smallest = best_set(chain, least.max(0.25 * last.area), last.area, NEXT_POWER)
        .map(|(count, last)| Region::new(index, &chain[..count], last, marks))
        .filter(|r| r.share >= INSIDE);
    let completed = completed(index, smallest.as_ref().unwrap_or(&first), marks);
    Some(completed.unwrap_or(first))
}

/// While something lies inside a region, the walk starts from that too and the next larger set is taken; `None` where
/// this never ends.
pub(crate) fn completed(index: &SceneIndex, region: &Region, marks: &[Mark]) -> Option<Region> {
    let mut marks = marks.to_vec();
    let mut found: Option<Region> = None;
    for _ in 0..TAKINGS {
        let current = found.as_ref().unwrap_or(region);
        current.inside.iter().for_each(|&n| marks[n as usize] = Mark::Positive);
        let next = next_larger(index, current.last.area * (1.0 + current.share), &marks)?;
        if next.share < INSIDE {
            return Some(next);
        }
        found = Some(next);
    }
    None
}

/// The next closed set from an area on.
pub(crate) fn next_larger(index: &SceneIndex, area: f32, marks: &[Mark]) -> Option<Region> {
    let chain = sweep(index, &probabilities(&index.graph, marks), marks);
    let (count, last) = best_set(&chain, area, f32::INFINITY, NEXT_POWER)?;
    Some(Region::new(index, &chain[..count], last, marks))
}

/// A set as a chain of its own, so that sets of different origin compare.
pub(crate) fn measured(index: &SceneIndex, nodes: &[u32], marks: &[Mark]) -> Option<Region> {
    let is_in: Vec<f32> =
        membership(index, nodes).into_iter().map(|m| f32::from(u8::from(m))).collect();
    let chain = sweep(index, &is_in, marks);
    let last = *chain.last()?;
    Some(Region::new(index, &chain, last, marks))
}

/// What a set costs with what lies inside it.
pub(crate) fn price(region: &Region) -> f32 {
    let incomplete = 1.0 + INCOMPLETE * region.share.max(0.0) / INSIDE;
    cost(&region.last, AREA_POWER) * incomplete
}
