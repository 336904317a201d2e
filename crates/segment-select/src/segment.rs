//! From a prompt to masks of all views: regions, then rounds of lifting and cutting.

use std::sync::{Arc, PoisonError};

use crate::corrections::corrected;
use crate::diffusion::{Step, sweep};
use crate::index::SceneIndex;
use crate::max_flow::MaxFlow;
use crate::region::{PART_SHARE, Region, nested, whole};
use crate::rivals::alone;
use crate::seeds::{Seeds, contradictions, marks};
use crate::walks::probabilities;

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
/// Masks of the regions that a prompt can mean and their scores, the largest first.
pub(crate) fn nested_regions(
    index: &SceneIndex,
    seeds: &Seeds,
    count: usize,
) -> Vec<(Vec<f32>, f32)> {
    let least = LEAST_PER_VIEW * index.views.len() as f32;
    let first_click = Seeds { negative: Vec::new(), ..seeds.first(1) };
    let first = first_answer(index, &first_click, least);
    let Some(mut whole) = first.whole.clone() else {
        // Smaller than any object that was thought of: what is more likely than not.
        let likely = probabilities(&index.graph, &marks(index, seeds));
        let mask = likely.iter().map(|&p| f32::from(u8::from(p > 0.5))).collect();
        return vec![(mask, 0.0)];
    };
    // Each click corrects the answer to those before it.
    for count in 1..=seeds.order.len().max(1) {
        let so_far = if count < seeds.order.len() { seeds.first(count) } else { seeds.clone() };
        if contradictions(index, &so_far, &whole.nodes) > 0 {
            whole = corrected(index, &so_far, whole, least);
        }
    }
    let parts = nested(&first.chain, least, PART_SHARE * whole.last.area);
    let sets = [(whole.nodes, whole.last)].into_iter().chain(parts);
    let mask = |(nodes, last): (Vec<u32>, Step)| {
        let mut mask = vec![0.0; index.nodes()];
        nodes.into_iter().for_each(|n| mask[n as usize] = 1.0);
        (mask, 1.0 - last.conductance)
    };
    sets.take(count.max(1)).map(mask).collect()
}

/// What the first click means: refining it asks for it again and again.
#[derive(Debug)]
pub(crate) struct FirstAnswer {
    seeds: Seeds,
    chain: Vec<Step>,
    whole: Option<Region>,
}

/// The answer to the first click, kept until another first click comes.
fn first_answer(index: &SceneIndex, first_click: &Seeds, least: f32) -> Arc<FirstAnswer> {
    let kept = || index.kept.lock().unwrap_or_else(PoisonError::into_inner);
    let known = kept().clone().and_then(|kept| kept.downcast::<FirstAnswer>().ok());
    if let Some(known) = known.filter(|known| known.seeds == *first_click) {
        return known;
    }
    let marks_of_first = marks(index, first_click);
    let likely = probabilities(&index.graph, &marks_of_first);
    let chain = sweep(index, &likely, &marks_of_first);
    let found = whole(index, &chain, &marks_of_first, least);
    let whole = found.map(|found| alone(index, first_click, &marks_of_first, found, least));
    let answer = Arc::new(FirstAnswer { seeds: first_click.clone(), chain, whole });
    *kept() = Some(Arc::<FirstAnswer>::clone(&answer));
    answer
}

/// Weight of the first masks in every round, against what is rendered. Where Gaussians are larger than what they show, such as
/// a leaf or a stalk, few of them lie mostly inside, and rounds without a memory lose it.
const FIRST_MASK: f32 = 0.35;

/// Lifts, renders and cuts again until the views agree.
pub(crate) fn rounds(
    index: &SceneIndex,
    first: &[f32],
    seeds: &Seeds,
    options: &SegmentOptions,
) -> Vec<f32> {
    let mut mask = first.to_vec();
    for _ in 0..options.rounds {
        let lifted = index.lift(&mask);
        let mut wanted = index.rendered(|i| if lifted[i] > 0.5 { 1.0 } else { 0.0 });
        for (wanted, first) in wanted.iter_mut().zip(first) {
            *wanted += FIRST_MASK * (first - *wanted);
        }
        mask = cut(index, &wanted, seeds, options);
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
