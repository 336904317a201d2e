//! What further clicks make of the set that the first one found.
//!
//! A positive click outside the set says that something is missing, a negative one inside that something is too much, or
//! that it is another thing altogether. The answers that compete are in `answers`; here they are weighed.

use crate::answers::answers;
use crate::depth::depth_in_view;
use crate::index::SceneIndex;
use crate::region::{CLOSED, Region, measured, price};
use crate::seeds::{Seeds, contradictions, holds, marks, membership};

/// A click is in the middle of what is wrong: an answer that changes less around it than there is to change costs
/// more, by this power of the ratio of the two depths.
const DEPTH_POWER: f32 = 0.2;
/// What is missing is as little as explains the click: an answer to a positive click costs more by this power of the area
/// that it changes.
const CHANGE_POWER: f32 = 0.2;
/// Added to the area that changes, superpixels: below it all changes are alike.
const CHANGE_OFFSET: f32 = 5.0;
/// What is missing is a thing or a piece of one, and ends where something parts it: an answer to positive clicks costs more by this
/// power of the conductance of the new border of what it changes.
const TORN_POWER: f32 = 0.35;
/// An answer that keeps less of the set than this share keeps nothing.
const LEAST_KEPT: f32 = 0.01;

/// The answer to all clicks where they contradict what was found: the one with the fewest contradictions; of
/// those the one that costs least for what it changes and what lies inside it.
pub(crate) fn corrected(index: &SceneIndex, seeds: &Seeds, found: Region, least: f32) -> Region {
    let all = marks(index, seeds);
    let error = Error::new(index, seeds, &found.nodes);
    let key = |region: &Region| {
        let wrong = contradictions(index, seeds, &region.nodes);
        (wrong, price(region) * error.unlikelihood(index, region))
    };
    answers(index, seeds, &all, &found, least)
        .into_iter()
        .filter_map(|nodes| measured(index, &nodes, &all))
        .map(|region| (key(&region), region))
        .min_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))
        .map_or(found, |(_, region)| region)
}

/// What the clicks that contradict a set say about what is wrong with it.
struct Error {
    /// The set.
    was_in: Vec<bool>,
    /// Where each contradicting click was made, whether it is positive, and how deep it lies in what can be wrong.
    clicks: Vec<(u32, bool, f32)>,
}

impl Error {
    fn new(index: &SceneIndex, seeds: &Seeds, found: &[u32]) -> Self {
        let was_in = membership(index, found);
        let of_kind = |clicks: &[Vec<u32>], is_positive: bool| {
            let wrong = |c: &&Vec<u32>| holds(&was_in, c) != is_positive;
            let first = clicks.iter().filter(wrong).filter_map(|c| c.first().copied());
            let depth = |n: u32| depth_in_view(index, n, |i| was_in[i] != is_positive);
            first.map(|n| (n, is_positive, depth(n))).collect::<Vec<_>>()
        };
        let mut clicks = of_kind(&seeds.positive, true);
        clicks.extend(of_kind(&seeds.negative, false));
        Self { was_in, clicks }
    }

    /// How little an answer explains that the clicks are where they are; 1 or more where it changes anything.
    fn unlikelihood(&self, index: &SceneIndex, answer: &Region) -> f32 {
        let is_in = membership(index, &answer.nodes);
        let (mut there, mut explained) = (0.0, 0.0);
        for &(node, is_positive, depth) in &self.clicks {
            there += depth;
            explained += depth_in_view(index, node, |i| {
                self.was_in[i] != is_positive && is_in[i] == is_positive
            });
        }
        let off_middle = if explained > 0.0 { there / explained } else { 1.0 };
        let changed = (0..index.nodes() as u32)
            .filter(|&n| self.was_in[n as usize] != is_in[n as usize])
            .map(|n| index.area(n))
            .sum::<f32>();
        let off_middle = off_middle.max(1.0).powf(DEPTH_POWER);
        if self.clicks.iter().any(|(_, is_positive, _)| !is_positive) {
            return off_middle;
        }
        let torn = (CLOSED + self.torn(index, &is_in)).powf(TORN_POWER * self.within());
        off_middle * (changed + CHANGE_OFFSET).powf(CHANGE_POWER) * torn / self.kept(index, &is_in)
    }

    /// Share of the set that an answer keeps: who points at what is missing takes nothing back.
    fn kept(&self, index: &SceneIndex, is_in: &[bool]) -> f32 {
        let (mut kept, mut all) = (0.0, 0.0);
        for n in (0..index.nodes()).filter(|&n| self.was_in[n]) {
            all += index.area(n as u32);
            kept += if is_in[n] { index.area(n as u32) } else { 0.0 };
        }
        (kept / f32::max(all, 1e-12)).max(LEAST_KEPT)
    }

    /// How far clicks are from the edge of what can be wrong, 0 at it to 1: there, the edge is off; far from it, a thing is.
    fn within(&self) -> f32 {
        let nearest = self.clicks.iter().map(|c| c.2).fold(f32::INFINITY, f32::min);
        1.0 - 1.0 / nearest.max(1.0)
    }

    /// Conductance of the border that an answer draws anew around what it changes, 0 to 1, over the volume of what changes: of what it
    /// adds to what it leaves out, or of what it takes away to what stays, whichever is more.
    fn torn(&self, index: &SceneIndex, is_in: &[bool]) -> f32 {
        let of = |is_added: bool| {
            let changes = |i: usize| self.was_in[i] != is_in[i] && is_in[i] == is_added;
            let stays = |j: usize| self.was_in[j] == is_in[j] && is_in[j] != is_added;
            let (mut cut, mut volume) = (0.0f64, 0.0f64);
            for i in (0..index.nodes()).filter(|&i| changes(i)) {
                volume += f64::from(index.graph.degrees[i]);
                let border = index.graph.row(i).filter(|(j, _)| stays(*j));
                cut += border.map(|(_, c)| f64::from(c)).sum::<f64>();
            }
            (cut / volume.max(1e-12)).min(1.0) as f32
        };
        of(true).max(of(false))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::{Graph, Link};
    use crate::view_data::{Border, Segment, ViewData};
    use crate::walks::Mark;
    use motes_raster::LabelVotes;
    use motes_scene::{Pinhole, Pose};

    /// Superpixels in a row that nothing parts.
    fn row(count: usize) -> SceneIndex {
        let segment = |k: usize| Segment {
            center_px: [k as f32 + 0.5, 0.5],
            area_px: 81.0,
            point: [k as f32, 0.0, 1.0],
            normal: [0.0, 0.0, -1.0],
            width: 1.0,
            inverse_depth: [0.0, 0.0, 1.0],
            ..Segment::default()
        };
        let border =
            |k: u32| Border { segments: [k, k + 1], length_px: 9.0, at_px: [k as f32 + 1.0, 0.5] };
        let view = ViewData {
            camera: Pinhole { fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5, width: count, height: 1 },
            camera_from_world: Pose::IDENTITY,
            labels: (0..count as u32).collect(),
            depth: vec![1.0; count],
            segments: (0..count).map(segment).collect(),
            borders: (0..count as u32 - 1).map(border).collect(),
            votes: LabelVotes { offsets: vec![0; count + 1], gaussians: vec![], weights: vec![] },
        };
        SceneIndex::new(vec![0], vec![view], 0)
    }

    #[test]
    fn an_answer_explains_that_a_click_is_in_the_middle_of_what_is_wrong() {
        let index = row(21);
        let found: Vec<u32> = (0..15).collect();
        let region = |nodes: Vec<u32>| measured(&index, &nodes, &[Mark::Free; 21]).unwrap();
        let seeds = Seeds { negative: vec![vec![10]], order: vec![false], ..Seeds::default() };
        let error = Error::new(&index, &seeds, &found);
        assert_eq!(error.clicks, [(10, false, 5.0)]);
        let unlikelihood = |nodes: Vec<u32>| error.unlikelihood(&index, &region(nodes));
        let without = |cut: std::ops::Range<u32>| (0..15).filter(|n| !cut.contains(n)).collect();
        assert!((unlikelihood((0..6).collect()) - 1.0).abs() < 1e-6, "all that there is around it");
        let hole = 5f32.powf(DEPTH_POWER);
        assert!((unlikelihood(without(10..11)) - hole).abs() < 1e-5, "a hole");
        assert!(unlikelihood(without(9..12)) < hole);
        // What is missing at the edge is as little as explains the click.
        let seeds = Seeds { positive: vec![vec![15]], order: vec![true], ..Seeds::default() };
        let error = Error::new(&index, &seeds, &found);
        let [little, much] =
            [18, 21].map(|end| error.unlikelihood(&index, &region((0..end).collect())));
        assert!(little < much, "{little} {much}");
    }

    #[test]
    fn a_positive_click_adds_a_thing_and_takes_nothing_back() {
        // Two things of ten superpixels, and what is behind them.
        let mut index = row(40);
        let parted: Vec<Link> = (0..39u32)
            .map(|k| {
                let strength = if k == 9 || k == 19 { 1.0 } else { 0.0 };
                Link { nodes: [k, k + 1], weight: 1.0, strength, contact: 0.0 }
            })
            .collect();
        index.graph = Graph::new(40, &parted);
        let region = |nodes: &[u32]| measured(&index, nodes, &[Mark::Free; 40]).unwrap();
        let seeds = Seeds { positive: vec![vec![14]], order: vec![true], ..Seeds::default() };
        let found: Vec<u32> = (0..10).collect();
        let error = Error::new(&index, &seeds, &found);
        let unlikelihood = |nodes: Vec<u32>| error.unlikelihood(&index, &region(&nodes));
        let both = unlikelihood((0..20).collect());
        assert!(both < unlikelihood((0..10).chain(13..16).collect()), "a piece of it");
        assert!(both < unlikelihood((0..24).collect()), "more than it");
        assert!(both < unlikelihood((5..20).collect()), "less of the first");
        // At the edge of the set only the edge is off.
        let seeds = Seeds { positive: vec![vec![10]], ..seeds };
        let error = Error::new(&index, &seeds, &found);
        let unlikelihood = |nodes: Vec<u32>| error.unlikelihood(&index, &region(&nodes));
        assert!(unlikelihood((0..11).collect()) < unlikelihood((0..20).collect()));
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
