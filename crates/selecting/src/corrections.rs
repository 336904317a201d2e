//! What further clicks make of the set that the first one found.
//!
//! A positive click outside the set says that it is too small: it grows. A negative one inside says that it is nearly
//! right, or that it is another thing; three answers compete: the set corrected, a search anew with all clicks as seeds,
//! and the set without what each negative click finds by itself.

use crate::diffusion::{Mark, Step, probabilities, sweep};
use crate::index::SceneIndex;
use crate::segment::{
    AREA_POWER, INSIDE, Region, Seeds, completed, cost, marks, next_larger, whole,
};

/// Whether each superpixel is in a set.
pub(crate) fn membership(index: &SceneIndex, nodes: &[u32]) -> Vec<bool> {
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
    let opposed = opposed(index, seeds, &all);
    let grown = trimmed_and_grown(index, seeds, &opposed, &found);
    let only_negative = Seeds { positive: Vec::new(), ..seeds.clone() };
    if contradictions(index, &only_negative, &found.nodes) == 0 {
        // Too little was found, not another thing.
        return measured(index, &grown, &all).unwrap_or(found);
    }
    let answers =
        [Some(grown), searched(index, &opposed, least), clicks_apart(index, seeds, &found, least)];
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

/// The marks, and negative what a walk from the negative clicks meets before one from the positive ones.
fn opposed(index: &SceneIndex, seeds: &Seeds, marks: &[Mark]) -> Vec<Mark> {
    let mut marks = marks.to_vec();
    if seeds.negative.is_empty() {
        return marks;
    }
    let likely = probabilities(&index.graph, &marks);
    let mut swapped = marks.clone();
    swapped.iter_mut().filter(|m| **m == Mark::Positive).for_each(|m| *m = Mark::Negative);
    seeds.negative.iter().flatten().for_each(|&n| swapped[n as usize] = Mark::Positive);
    let other = probabilities(&index.graph, &swapped);
    for (mark, (mine, other)) in marks.iter_mut().zip(likely.iter().zip(&other)) {
        if *mark == Mark::Free && other > mine {
            *mark = Mark::Negative;
        }
    }
    marks
}

/// The set without what is nearer to negative clicks; what is left stays, and grows as far as the positive
/// clicks that it misses need.
fn trimmed_and_grown(
    index: &SceneIndex,
    seeds: &Seeds,
    opposed: &[Mark],
    found: &Region,
) -> Vec<u32> {
    let mut marks = opposed.to_vec();
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

/// What the marks find as a whole.
fn searched(index: &SceneIndex, marks: &[Mark], least: f32) -> Option<Vec<u32>> {
    let chain: Vec<Step> = sweep(index, &probabilities(&index.graph, marks), marks);
    whole(index, &chain, marks, least).map(|region| region.nodes)
}

/// The set without what each negative click inside it finds by itself, short of the positive clicks.
fn clicks_apart(index: &SceneIndex, seeds: &Seeds, found: &Region, least: f32) -> Option<Vec<u32>> {
    let mut is_in = membership(index, &found.nodes);
    let mut is_other = false;
    for click in &seeds.negative {
        if !holds(&is_in, click) {
            continue;
        }
        let alone = Seeds {
            positive: vec![click.clone()],
            negative: seeds.positive.clone(),
            ..Seeds::default()
        };
        let object = searched(index, &marks(index, &alone), least).unwrap_or_default();
        object.iter().for_each(|&n| is_in[n as usize] = false);
        is_other |= !object.is_empty();
    }
    is_other.then(|| (0..index.nodes() as u32).filter(|&n| is_in[n as usize]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view_data::{Segment, ViewData};
    use motes_raster::LabelVotes;
    use motes_scene::{Pinhole, Pose};

    /// Superpixels in a row that nothing parts.
    fn row(count: usize) -> SceneIndex {
        let segment = |k: usize| Segment {
            area_px: 81.0,
            point: [k as f32, 0.0, 1.0],
            width: 1.0,
            ..Segment::default()
        };
        let view = ViewData {
            camera: Pinhole { fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5, width: count, height: 1 },
            camera_from_world: Pose::IDENTITY,
            labels: (0..count as u32).collect(),
            depth: vec![1.0; count],
            segments: (0..count).map(segment).collect(),
            borders: Vec::new(),
            votes: LabelVotes { offsets: vec![0; count + 1], gaussians: vec![], weights: vec![] },
        };
        SceneIndex::new(vec![0], vec![view], 0)
    }

    #[test]
    fn clicks_contradict_by_most_of_what_they_hit_and_in_their_order() {
        let index = row(6);
        let seeds = Seeds {
            positive: vec![vec![0], vec![2, 3, 4]],
            negative: vec![vec![1, 5]],
            order: vec![true, false, true],
            ..Seeds::default()
        };
        assert_eq!(contradictions(&index, &seeds, &[0, 1]), 1, "half of the negative one is in");
        assert_eq!(contradictions(&index, &seeds, &[0, 3, 4]), 0);
        assert_eq!(contradictions(&index, &seeds, &[1, 5]), 3);
        let two = seeds.first(2);
        assert_eq!((two.positive.len(), two.negative.len()), (1, 1));
        assert_eq!(contradictions(&index, &two, &[0]), 0, "the third is not made yet");
    }

    #[test]
    fn what_is_measured_is_the_set_without_what_is_excluded() {
        let index = row(6);
        let mut marks = vec![Mark::Free; 6];
        marks[2] = Mark::Negative;
        let region = measured(&index, &[1, 2, 3], &marks).unwrap();
        assert_eq!(region.nodes, [1, 3]);
        assert!((region.last.area - 2.0).abs() < 1e-6, "{}", region.last.area);
        assert!(measured(&index, &[2], &marks).is_none());
    }
}
