//! From a prompt to masks of all views: regions, then rounds of lifting and cutting.

use crate::corrections::{contradictions, corrected};
use crate::diffusion::{Mark, Step, probabilities, sweep};
use crate::index::SceneIndex;
use crate::intruders::intruders;
use crate::max_flow::MaxFlow;
use crate::rivals::alone;

/// What a prompt says about superpixels.
#[derive(Clone, Debug, Default)]
pub struct Seeds {
    /// Per positive click or stroke: the superpixels that it hits, the clicked one first.
    pub positive: Vec<Vec<u32>>,
    /// Likewise for negative ones.
    pub negative: Vec<Vec<u32>>,
    /// Clicks and strokes in the order in which they were made: whether each is positive.
    pub order: Vec<bool>,
    /// Superpixels outside a rectangle around the object.
    pub outside: Vec<u32>,
    /// Superpixels inside a rectangle around the object, per rectangle.
    pub boxes: Vec<Vec<u32>>,
}

impl Seeds {
    /// The first clicks, with the first positive one.
    pub(crate) fn first(&self, count: usize) -> Self {
        let order: Vec<bool> = self.order.iter().copied().take(count).collect();
        let positive = order.iter().filter(|&&p| p).count();
        Self {
            positive: self.positive.iter().take(positive.max(1)).cloned().collect(),
            negative: self.negative.iter().take(order.len() - positive).cloned().collect(),
            outside: self.outside.clone(),
            boxes: self.boxes.clone(),
            order,
        }
    }
}

/// Rounds of lifting, rendering and cutting, and the weight of smoothness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentOptions {
    /// Rounds; the issue of each is cut again along the edges of every view.
    pub rounds: usize,
    /// Cost of a cut along one superpixel side without any edge, against certainty of one superpixel.
    pub smoothness: f32,
}

impl Default for SegmentOptions {
    fn default() -> Self {
        Self { rounds: 3, smoothness: 1.0 }
    }
}

/// Regions of fewer superpixels per view are noise: what only one view shows is not an object.
const LEAST_PER_VIEW: f32 = 1.5;
/// Superpixels in the middle of a box that a walk starts from.
const BOX_SEEDS: usize = 5;
/// A part is at most this share of its whole.
pub(crate) const PART_SHARE: f32 = 0.6;
/// The set of least `(conductance + CLOSED + CONTACT contact) * area^AREA_POWER` is meant. Conductances far
/// below `CLOSED` are all alike: several objects that touch are together always a little better closed
/// than each, and then the smaller set is wanted. An object rests on its support; what touches other things along
/// much of its border, or hangs in the air, is rather a part of one.
pub(crate) const AREA_POWER: f32 = 0.4;
const CLOSED: f32 = 0.015;
const CONTACT: f32 = 0.2;
/// Where a smaller set is known to be incomplete: the next larger one that is closed, not the one that is meant.
const NEXT_POWER: f32 = 0.8;
/// Something lies inside a set from this share of its area on. On all objects that were tried it is less for the object,
/// 0.05 to 0.1 for one loop of a knot.
pub(crate) const INSIDE: f32 = 0.015;
/// What lies inside a set costs this much of it where it is just enough to be looked for.
pub(crate) const INCOMPLETE: f32 = 0.5;
/// Times that what lies inside is taken along.
const TAKINGS: usize = 8;
/// What is added to the cost of a set that does not rest on the support plane, in shares of it: what lies on another
/// thing is still found.
const ALOFT: f32 = 0.4;
/// A set rests from about this many superpixels per view at the plane on.
const RESTING: f32 = 0.1;

/// Where a walk starts and ends.
pub(crate) fn marks(index: &SceneIndex, seeds: &Seeds) -> Vec<Mark> {
    let mut marks = vec![Mark::Free; index.nodes()];
    let on_plane = |n: u32| {
        let s = index.segment(n);
        s.width > 0.0 && index.plane.is_some_and(|p| p.membership(s.point.into(), s.width) > 0.5)
    };
    // Who clicks a thing low down may hit what it stands on, in all views or in some; who means the support hits
    // nothing else. A rectangle is drawn around a thing, whose middle may be a hole.
    let is_on_plane = |hit: &Vec<u32>| 2 * hit.iter().filter(|&&n| on_plane(n)).count() > hit.len();
    let is_support = match seeds.positive.is_empty() {
        true => seeds.boxes.iter().flatten().all(|&n| on_plane(n)),
        false => seeds.positive.iter().all(is_on_plane),
    };
    for n in 0..index.nodes() as u32 {
        // Nothing drawn is nobody's.
        if index.segment(n).width == 0.0 || on_plane(n) != is_support {
            marks[n as usize] = Mark::Negative;
        }
    }
    seeds.outside.iter().for_each(|&n| marks[n as usize] = Mark::Negative);
    // What is nearest to the middle of a box is on the object more often than not; a few are enough.
    let middle = seeds
        .boxes
        .iter()
        .flat_map(|inside| inside.iter().filter(|&&n| on_plane(n) == is_support).take(BOX_SEEDS));
    let positive = seeds.positive.iter().flatten();
    positive.chain(middle).for_each(|&n| marks[n as usize] = Mark::Positive);
    seeds.negative.iter().flatten().for_each(|&n| marks[n as usize] = Mark::Negative);
    marks
}

/// What says against a set being what is meant.
pub(crate) fn cost(s: &Step, power: f32) -> f32 {
    let aloft = 1.0 + ALOFT * (-s.resting / RESTING).exp();
    (s.conductance + CLOSED + CONTACT * s.contact) * s.area.powf(power) * aloft
}

/// The cheapest set of a chain: its length and last step.
pub(crate) fn best_set(chain: &[Step], least: f32, most: f32, power: f32) -> Option<(usize, Step)> {
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
pub(crate) struct Region {
    pub(crate) nodes: Vec<u32>,
    pub(crate) last: Step,
    pub(crate) inside: Vec<u32>,
    pub(crate) share: f32,
}

impl Region {
    pub(crate) fn new(index: &SceneIndex, steps: &[Step], last: Step, marks: &[Mark]) -> Self {
        let nodes: Vec<u32> = steps.iter().map(|s| s.node).collect();
        let (inside, share) = intruders(index, &nodes, marks);
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

/// Masks of the regions that a prompt can mean and their scores, the largest first.
pub(crate) fn nested_regions(
    index: &SceneIndex,
    seeds: &Seeds,
    count: usize,
) -> Vec<(Vec<f32>, f32)> {
    let least = LEAST_PER_VIEW * index.views.len() as f32;
    let first_click = Seeds { negative: Vec::new(), ..seeds.first(1) };
    let marks_of_first = marks(index, &first_click);
    let likely = probabilities(&index.graph, &marks_of_first);
    let chain = sweep(index, &likely, &marks_of_first);
    let Some(mut whole) = whole(index, &chain, &marks_of_first, least) else {
        // Smaller than any object that was thought of: what is more likely than not.
        let likely = probabilities(&index.graph, &marks(index, seeds));
        let mask = likely.iter().map(|&p| f32::from(u8::from(p > 0.5))).collect();
        return vec![(mask, 0.0)];
    };
    whole = alone(index, &first_click, &marks_of_first, whole, least);
    // Each click corrects the answer to those before it.
    for count in 1..=seeds.order.len().max(1) {
        let so_far = if count < seeds.order.len() { seeds.first(count) } else { seeds.clone() };
        if contradictions(index, &so_far, &whole.nodes) > 0 {
            whole = corrected(index, &so_far, whole, least);
        }
    }
    let parts = nested(&chain, least, PART_SHARE * whole.last.area);
    let sets = [(whole.nodes, whole.last)].into_iter().chain(parts);
    let mask = |(nodes, last): (Vec<u32>, Step)| {
        let mut mask = vec![0.0; index.nodes()];
        nodes.into_iter().for_each(|n| mask[n as usize] = 1.0);
        (mask, 1.0 - last.conductance)
    };
    sets.take(count.max(1)).map(mask).collect()
}

/// Lifts, renders and cuts again until the views agree.
pub(crate) fn rounds(
    index: &SceneIndex,
    mut mask: Vec<f32>,
    seeds: &Seeds,
    options: &SegmentOptions,
) -> Vec<f32> {
    for _ in 0..options.rounds {
        let lifted = index.lift(&mask);
        let rendered = index.rendered(|i| if lifted[i] > 0.5 { 1.0 } else { 0.0 });
        mask = cut(index, &rendered, seeds, options);
    }
    mask
}

/// The cheapest masks near `wanted` (`[nodes]`, 0 to 1): each superpixel wants to be what it was
/// rendered as, and neighbors that nothing parts want to be alike.
pub(crate) fn cut(
    index: &SceneIndex,
    wanted: &[f32],
    seeds: &Seeds,
    options: &SegmentOptions,
) -> Vec<f32> {
    /// Capacities are whole numbers.
    const UNIT: f32 = 1000.0;
    /// More than any sum of others.
    const CERTAIN: i64 = 1 << 40;
    use rayon::prelude::*;

    let side = crate::view_data::SUPERPIXEL_PX as f32;
    let mut fixed = vec![0i8; index.nodes()];
    seeds.outside.iter().for_each(|&n| fixed[n as usize] = -1);
    seeds.positive.iter().flatten().for_each(|&n| fixed[n as usize] = 1);
    seeds.negative.iter().flatten().for_each(|&n| fixed[n as usize] = -1);
    (0..index.views.len())
        .into_par_iter()
        .flat_map_iter(|v| {
            let view = &index.views[v];
            let first = index.range(v).start;
            let mut graph = MaxFlow::new(view.segments.len());
            for (s, segment) in view.segments.iter().enumerate() {
                let share = wanted[first + s].clamp(0.02, 0.98);
                let certainty = (segment.area_px / (side * side)).min(2.0);
                let logit = (share / (1.0 - share)).ln() * certainty;
                match fixed[first + s] {
                    1 => graph.add_terminal(s, CERTAIN, 0),
                    -1 => graph.add_terminal(s, 0, CERTAIN),
                    _ if logit > 0.0 => graph.add_terminal(s, (logit * UNIT) as i64, 0),
                    _ => graph.add_terminal(s, 0, (-logit * UNIT) as i64),
                }
            }
            for (border, strength) in view.borders.iter().zip(&index.strengths[v]) {
                let cost = options.smoothness * border.length_px / side * (-4.0 * strength).exp();
                let [a, b] = border.segments.map(|s| s as usize);
                let cost = (cost * UNIT) as i64;
                graph.add_edge(a, b, cost, cost);
            }
            graph.solve();
            let side = |s: usize| if graph.is_source_side(s) { 1.0 } else { 0.0 };
            (0..view.segments.len()).map(side).collect::<Vec<f32>>()
        })
        .collect()
}
