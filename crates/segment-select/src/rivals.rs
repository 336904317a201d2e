//! What was found together with something else, alone.
//!
//! The chain of sets of one walk need not contain the cheapest set: where things touch, what is far away on the one
//! clicked may come after what is near on another. So superpixels of the set, from near to far, are tried as
//! places that do not belong to it, as if they had been clicked; a set that costs clearly less is taken.

use rayon::prelude::*;

use crate::answers::{opposed, swapped};
use crate::diffusion::sweep;
use crate::index::SceneIndex;
use crate::region::{Region, measured, price, whole};
use crate::seeds::{Seeds, contradictions, marks};
use crate::walks::{Mark, probabilities_of};

/// Places that are tried: in the order of the walk, where these shares of the area come before.
const PLACES: [f32; 2] = [0.5, 0.9];
/// Times that something is taken away.
const ROUNDS: usize = 2;
/// A set has to cost less than this share of what is had.
const CLEARLY: f32 = 0.95;

/// The set that a first click finds, without things that it only touches.
pub(crate) fn alone(
    index: &SceneIndex,
    seeds: &Seeds,
    marks_of_first: &[Mark],
    found: Region,
    least: f32,
) -> Region {
    let mut found = found;
    for _ in 0..ROUNDS {
        let Some(now) = measured(index, &found.nodes, marks_of_first) else { break };
        let limit = CLEARLY * price(&now);
        let against: Vec<Seeds> =
            places(index, &found.nodes).iter().filter_map(|p| without(index, seeds, *p)).collect();
        let opposed = opposed_by_each(index, &against);
        let walks: Vec<&[Mark]> = opposed.iter().map(Vec::as_slice).collect();
        let likely = probabilities_of(&index.graph, &walks);
        let answer = |(marks, likely): (&Vec<Mark>, &Vec<f32>)| {
            let nodes = whole(index, &sweep(index, likely, marks), marks, least)?.nodes;
            measured(index, &nodes, marks_of_first)
        };
        let answers: Vec<Region> = opposed.par_iter().zip(&likely).filter_map(answer).collect();
        let better = answers
            .into_iter()
            .filter(|region| contradictions(index, seeds, &region.nodes) == 0)
            .map(|region| (price(&region), region))
            .filter(|(price, _)| *price < limit)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match better {
            Some((_, region)) => found = region,
            None => break,
        }
    }
    found
}

/// The first click, and a place that does not belong to it; none where the click itself is.
fn without(index: &SceneIndex, seeds: &Seeds, place: u32) -> Option<Seeds> {
    let mut click = index.nodes_at(index.segment(place).point.into());
    click.push(place);
    let is_clicked = seeds.positive.iter().flatten().any(|n| click.contains(n));
    (!is_clicked).then(|| Seeds { negative: vec![click], ..seeds.clone() })
}

/// The marks of clicks, each set with what is nearer to its negative ones taken away.
fn opposed_by_each(index: &SceneIndex, clicks: &[Seeds]) -> Vec<Vec<Mark>> {
    let all: Vec<Vec<Mark>> = clicks.iter().map(|seeds| marks(index, seeds)).collect();
    let swapped = clicks.iter().zip(&all).map(|(seeds, all)| swapped(seeds, all));
    let swapped: Vec<Vec<Mark>> = swapped.collect();
    let walks: Vec<&[Mark]> = all.iter().chain(&swapped).map(Vec::as_slice).collect();
    let found = probabilities_of(&index.graph, &walks);
    let (mine, others) = found.split_at(clicks.len());
    all.iter()
        .zip(mine.iter().zip(others))
        .map(|(all, (mine, other))| opposed(all, mine, other))
        .collect()
}

/// Superpixels at shares of the area of a set that is in the order of a walk.
fn places(index: &SceneIndex, nodes: &[u32]) -> Vec<u32> {
    let total: f32 = nodes.iter().map(|&n| index.area(n)).sum();
    let mut area = 0.0;
    let mut out = Vec::new();
    for &n in nodes {
        area += index.area(n);
        if out.len() < PLACES.len() && area >= PLACES[out.len()] * total {
            out.push(n);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view_data::{Border, Segment, ViewData};
    use motes_raster::LabelVotes;
    use motes_scene::{Pinhole, Pose};

    /// Superpixels in a row, at these depths.
    fn row(depths: &[f32]) -> SceneIndex {
        let segment = |(k, &z): (usize, &f32)| Segment {
            center_px: [k as f32 + 0.5, 0.5],
            area_px: 81.0,
            point: [k as f32 * z, 0.0, z],
            normal: [0.0, 0.0, -1.0],
            width: 0.5,
            inverse_depth: [0.0, 0.0, 1.0 / z],
            ..Segment::default()
        };
        let border =
            |k: u32| Border { segments: [k, k + 1], length_px: 9.0, at_px: [k as f32 + 1.0, 0.5] };
        let n = depths.len();
        let view = ViewData {
            camera: Pinhole { fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5, width: n, height: 1 },
            camera_from_world: Pose::IDENTITY,
            labels: (0..n as u32).collect(),
            depth: depths.to_vec(),
            segments: depths.iter().enumerate().map(segment).collect(),
            borders: (0..n as u32 - 1).map(border).collect(),
            votes: LabelVotes { offsets: vec![0; n + 1], gaussians: vec![], weights: vec![] },
        };
        SceneIndex::new(vec![0], vec![view], 0)
    }

    #[test]
    fn two_things_are_taken_apart_and_one_is_not() {
        let seeds = Seeds { positive: vec![vec![2]], order: vec![true], ..Seeds::default() };
        // Something behind fills the rest of the row.
        for (second, expected) in [(2.0, 12), (1.0, 24)] {
            let depths: Vec<f32> = [vec![1.0; 12], vec![second; 12], vec![4.0; 40]].concat();
            let index = row(&depths);
            let marks = marks(&index, &seeds);
            let both: Vec<u32> = (0..24).collect();
            let found = measured(&index, &both, &marks).unwrap();
            let mut nodes = alone(&index, &seeds, &marks, found, 1.5).nodes;
            nodes.sort_unstable();
            assert_eq!(nodes, (0..expected).collect::<Vec<u32>>(), "at depth {second}");
        }
    }
}
