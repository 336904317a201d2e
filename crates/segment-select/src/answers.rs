//! The answers to clicks that contradict what was found.
//!
//! The set corrected; the set with and without what each click finds by itself, from the whole to small
//! pieces; a search anew with all clicks as seeds, likewise. They are many because a click says little about how
//! much is wrong; `corrections` chooses.

use crate::diffusion::{Step, sweep};
use crate::index::SceneIndex;
use crate::region::{INSIDE, Region, completed, nested, next_larger, whole};
use crate::seeds::{Seeds, holds, marks, membership};
use crate::walks::{Mark, probabilities, probabilities_of};

/// Sets of each size that a search anew gives, and that a click gives by itself.
const SIZES_ANEW: usize = 4;
const SIZES_OF_CLICK: usize = 6;

/// Sets that may be meant by all clicks, `found` being the answer so far and `all` the marks of the clicks.
pub(crate) fn answers(
    index: &SceneIndex,
    seeds: &Seeds,
    all: &[Mark],
    found: &Region,
    least: f32,
) -> Vec<Vec<u32>> {
    let is_in = membership(index, &found.nodes);
    let alone = alone(index, seeds, &is_in);
    let has_negative = !seeds.negative.is_empty();
    let swapped = has_negative.then(|| swapped(seeds, all));
    let walks: Vec<&[Mark]> = [all]
        .into_iter()
        .chain(swapped.as_deref())
        .chain(alone.iter().map(|(_, marks)| marks.as_slice()))
        .collect();
    let mut found_by = probabilities_of(&index.graph, &walks).into_iter();
    let mut next = || found_by.next().unwrap_or_default();
    let free = next();
    let opposed = if has_negative { opposed(all, &free, &next()) } else { all.to_vec() };
    // Without the negative clicks themselves, that is: the smallest change.
    let mut out = vec![found.nodes.clone(), trimmed_and_grown(index, seeds, &opposed, found)];
    let mut anew = |chain: &[Step], marks: &[Mark]| {
        out.extend(whole(index, chain, marks, least).map(|region| region.nodes));
        out.extend(nested(chain, least, f32::INFINITY).map(|set| set.0).take(SIZES_ANEW));
    };
    anew(&sweep(index, &free, all), all);
    if has_negative {
        anew(&sweep(index, &probabilities(&index.graph, &opposed), &opposed), &opposed);
    }
    let mut apart = is_in.clone();
    for (is_positive, marks, likely) in alone.iter().map(|(p, marks)| (*p, marks, next())) {
        let chain = sweep(index, &likely, marks);
        for (piece, _) in nested(&chain, 0.0, f32::INFINITY).take(SIZES_OF_CLICK) {
            let mut is_in = is_in.clone();
            piece.iter().for_each(|&n| is_in[n as usize] = is_positive);
            out.push(nodes(&is_in));
        }
        if !is_positive && let Some(object) = whole(index, &chain, marks, least) {
            object.nodes.iter().for_each(|&n| apart[n as usize] = false);
        }
    }
    out.push(nodes(&apart));
    out
}

/// Clicks that contradict a set, each as if it was the only one of its kind: whether it is positive, and its marks.
fn alone(index: &SceneIndex, seeds: &Seeds, is_in: &[bool]) -> Vec<(bool, Vec<Mark>)> {
    let kinds =
        [(&seeds.positive, &seeds.negative, true), (&seeds.negative, &seeds.positive, false)];
    let mut out = Vec::new();
    for (clicks, others, is_positive) in kinds {
        for click in clicks.iter().filter(|click| holds(is_in, click) != is_positive) {
            let positive = vec![click.clone()];
            let alone = Seeds { positive, negative: others.clone(), ..Seeds::default() };
            out.push((is_positive, marks(index, &alone)));
        }
    }
    out
}

fn nodes(is_in: &[bool]) -> Vec<u32> {
    (0..is_in.len() as u32).filter(|&n| is_in[n as usize]).collect()
}

/// The marks of a walk from the negative clicks to the positive ones.
pub(crate) fn swapped(seeds: &Seeds, marks: &[Mark]) -> Vec<Mark> {
    let mut swapped = marks.to_vec();
    swapped.iter_mut().filter(|m| **m == Mark::Positive).for_each(|m| *m = Mark::Negative);
    seeds.negative.iter().flatten().for_each(|&n| swapped[n as usize] = Mark::Positive);
    swapped
}

/// The marks, and negative what a walk from the negative clicks, `other`, meets before one from the positive ones, `likely`.
pub(crate) fn opposed(marks: &[Mark], likely: &[f32], other: &[f32]) -> Vec<Mark> {
    let mut marks = marks.to_vec();
    for (mark, (mine, other)) in marks.iter_mut().zip(likely.iter().zip(other)) {
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
