//! What further clicks make of the set that the first one found.
//!
//! A click that contradicts the set says either that it is nearly right, or that it is another thing. Three answers
//! compete: the set corrected, a search anew with all clicks as seeds, and the set with what each click sets out by
//! itself added or taken away.

use crate::diffusion::{Mark, Step, probabilities, sweep};
use crate::index::SceneIndex;
use crate::segment::{
    AREA_POWER, INSIDE, Region, Seeds, completed, cost, marks, next_larger, whole,
};

/// Whether each superpixel is in a set.
fn membership(index: &SceneIndex, nodes: &[u32]) -> Vec<bool> {
    let mut is_in = vec![false; index.nodes()];
    nodes.iter().for_each(|&n| is_in[n as usize] = true);
    is_in
}

/// Whether most of what a click hits, in all views, is in a set.
fn holds(is_in: &[bool], click: &[u32]) -> bool {
    2 * click.iter().filter(|&&n| is_in[n as usize]).count() > click.len()
}

/// Number of clicks that a set contradicts: positive ones outside and negative ones inside.
pub(crate) fn contradictions(index: &SceneIndex, seeds: &Seeds, nodes: &[u32]) -> usize {
    let is_in = membership(index, nodes);
    seeds.positive.iter().filter(|click| !holds(&is_in, click)).count()
        + seeds.negative.iter().filter(|click| holds(&is_in, click)).count()
}

/// The answer to all clicks where they contradict what was found: the one with the fewest contradictions; of
/// those the one with nothing inside it, then the one of the least cost.
pub(crate) fn corrected(index: &SceneIndex, seeds: &Seeds, found: Region, least: f32) -> Region {
    let all = marks(index, seeds);
    let answers = [
        Some(trimmed_and_grown(index, seeds, &all, &found)),
        anew(index, seeds, &all, least),
        Some(clicks_apart(index, seeds, &found, least)),
    ];
    let measured = answers.into_iter().flatten().filter_map(|nodes| measured(index, &nodes, &all));
    let key = |region: &Region| {
        let wrong = contradictions(index, seeds, &region.nodes);
        (wrong, region.share >= INSIDE)
    };
    measured
        .map(|region| (key(&region), region))
        .min_by(|(a, ra), (b, rb)| {
            let costs = [ra, rb].map(|r| cost(&r.last, AREA_POWER));
            a.cmp(b).then(costs[0].total_cmp(&costs[1]))
        })
        .map_or(found, |(_, region)| region)
}

/// A set as a chain of its own, so that sets of different origin compare.
fn measured(index: &SceneIndex, nodes: &[u32], marks: &[Mark]) -> Option<Region> {
    let is_in: Vec<f32> =
        membership(index, nodes).into_iter().map(|m| f32::from(u8::from(m))).collect();
    let chain = sweep(index, &is_in, marks);
    let last = *chain.last()?;
    Some(Region::new(index, &chain, last, marks))
}

/// Marks what a walk from the negative clicks meets before one from the positive ones.
fn oppose(index: &SceneIndex, seeds: &Seeds, marks: &mut [Mark]) {
    if seeds.negative.is_empty() {
        return;
    }
    let likely = probabilities(&index.graph, marks);
    let mut opposed = marks.to_vec();
    opposed.iter_mut().filter(|m| **m == Mark::Positive).for_each(|m| *m = Mark::Negative);
    seeds.negative.iter().flatten().for_each(|&n| opposed[n as usize] = Mark::Positive);
    let other = probabilities(&index.graph, &opposed);
    for (mark, (mine, other)) in marks.iter_mut().zip(likely.iter().zip(&other)) {
        if *mark == Mark::Free && other > mine {
            *mark = Mark::Negative;
        }
    }
}

/// The set without what is nearer to negative clicks; what is left stays, and grows as far as the positive
/// clicks that it misses need.
fn trimmed_and_grown(index: &SceneIndex, seeds: &Seeds, all: &[Mark], found: &Region) -> Vec<u32> {
    let mut marks = all.to_vec();
    oppose(index, seeds, &mut marks);
    let kept = |&n: &u32| marks[n as usize] != Mark::Negative;
    let nodes: Vec<u32> = found.nodes.iter().copied().filter(kept).collect();
    let is_in = membership(index, &nodes);
    if seeds.positive.iter().all(|click| holds(&is_in, click)) {
        return nodes;
    }
    nodes.iter().for_each(|&n| marks[n as usize] = Mark::Positive);
    let area = nodes.iter().map(|&n| index.area(n)).sum();
    let Some(larger) = next_larger(index, area, &marks) else { return nodes };
    match larger.share < INSIDE {
        true => larger.nodes,
        false => completed(index, &larger, &marks).unwrap_or(larger).nodes,
    }
}

/// What all clicks find together; a superpixel is of the kind that a walk meets first.
fn anew(index: &SceneIndex, seeds: &Seeds, all: &[Mark], least: f32) -> Option<Vec<u32>> {
    let mut marks = all.to_vec();
    oppose(index, seeds, &mut marks);
    searched(index, &marks, least)
}

fn searched(index: &SceneIndex, marks: &[Mark], least: f32) -> Option<Vec<u32>> {
    let chain: Vec<Step> = sweep(index, &probabilities(&index.graph, marks), marks);
    whole(index, &chain, marks, least).map(|region| region.nodes)
}

/// The set, with what each positive click outside it finds by itself and without what each negative one
/// inside it finds; neither reaches clicks of the other kind.
fn clicks_apart(index: &SceneIndex, seeds: &Seeds, found: &Region, least: f32) -> Vec<u32> {
    let mut is_in = membership(index, &found.nodes);
    for (own, others, adds) in
        [(&seeds.positive, &seeds.negative, true), (&seeds.negative, &seeds.positive, false)]
    {
        for click in own {
            if holds(&is_in, click) == adds {
                continue;
            }
            let alone = Seeds {
                positive: vec![click.clone()],
                negative: others.clone(),
                outside: seeds.outside.clone(),
                boxes: Vec::new(),
            };
            let object = searched(index, &marks(index, &alone), least).unwrap_or_default();
            object.iter().for_each(|&n| is_in[n as usize] = adds);
        }
    }
    (0..index.nodes() as u32).filter(|&n| is_in[n as usize]).collect()
}
