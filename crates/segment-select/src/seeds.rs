//! What clicks, strokes and rectangles say about superpixels.

use crate::index::SceneIndex;
use crate::plane::SupportPlane;
use crate::raised::RaisedSupport;
use crate::walks::Mark;

/// Superpixels in the middle of a box that a walk starts from.
const BOX_SEEDS: usize = 5;

/// What a prompt says about superpixels.
#[derive(Clone, Debug, Default, PartialEq)]
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

/// The plane that is meant itself, of those that bound the scene. Who clicks a thing low down may hit what it stands on, in all
/// views or in some; who means the floor or a wall hits nothing else. A rectangle is drawn around a thing, whose middle may be a hole.
fn meant_plane<'a>(index: &'a SceneIndex, seeds: &Seeds) -> Option<&'a SupportPlane> {
    index.planes.iter().find(|plane| {
        let is_on = |n: &u32| plane.holds(index.segment(*n));
        let hits = |hit: &Vec<u32>| 2 * hit.iter().filter(|n| is_on(n)).count() > hit.len();
        match seeds.positive.is_empty() {
            true => seeds.boxes.iter().flatten().all(is_on),
            false => seeds.positive.iter().all(hits),
        }
    })
}

/// Superpixels as low as what is stood on that face another way: the feet of things. A walk that used them would run from one
/// thing to the next.
pub(crate) fn feet(index: &SceneIndex, seeds: &Seeds) -> Vec<u32> {
    if meant_plane(index, seeds).is_some() {
        return Vec::new();
    }
    let stands_on = stands_on(index, seeds);
    let is_foot = |&n: &u32| {
        let s = index.segment(n);
        index.planes.iter().any(|p| p.holds(s) && !p.is_faced_by(s))
            || stands_on.iter().any(|r| r.holds_foot(s))
    };
    (0..index.nodes() as u32).filter(is_foot).collect()
}

/// Where a walk starts and ends.
pub(crate) fn marks(index: &SceneIndex, seeds: &Seeds) -> Vec<Mark> {
    let mut marks = vec![Mark::Free; index.nodes()];
    let meant = meant_plane(index, seeds);
    let is_apart = |n: u32| match meant {
        Some(plane) => !plane.holds(index.segment(n)),
        None => index.planes.iter().any(|plane| plane.holds(index.segment(n))),
    };
    let stands_on = stands_on(index, seeds);
    let on_raised = |n: u32| stands_on.iter().any(|r| r.holds(index.segment(n)));
    for n in 0..index.nodes() as u32 {
        // Nothing drawn is nobody's.
        if index.segment(n).width == 0.0 || is_apart(n) || on_raised(n) {
            marks[n as usize] = Mark::Negative;
        }
    }
    seeds.outside.iter().for_each(|&n| marks[n as usize] = Mark::Negative);
    // What is nearest to the middle of a box is on the object more often than not; a few are enough.
    let middle = seeds
        .boxes
        .iter()
        .flat_map(|inside| inside.iter().filter(|&&n| !is_apart(n)).take(BOX_SEEDS));
    let positive = seeds.positive.iter().flatten();
    positive.chain(middle).for_each(|&n| marks[n as usize] = Mark::Positive);
    seeds.negative.iter().flatten().for_each(|&n| marks[n as usize] = Mark::Negative);
    marks
}

/// The raised planes that what is meant stands on: all clicks hit what they carry. Without clicks the middles of rectangles do.
fn stands_on<'a>(index: &'a SceneIndex, seeds: &Seeds) -> Vec<&'a RaisedSupport> {
    let hits: Vec<&[u32]> = match seeds.positive.is_empty() {
        true => seeds.boxes.iter().map(|inside| &inside[..inside.len().min(BOX_SEEDS)]).collect(),
        false => seeds.positive.iter().map(Vec::as_slice).collect(),
    };
    let carries = |r: &&RaisedSupport| {
        let most = |hit: &&[u32]| {
            2 * hit.iter().filter(|&&n| r.carries(index.segment(n))).count() > hit.len()
        };
        !hits.is_empty() && hits.iter().all(most)
    };
    index.raised.iter().filter(carries).collect()
}

/// Whether each superpixel is in a set.
pub(crate) fn membership(index: &SceneIndex, nodes: &[u32]) -> Vec<bool> {
    let mut is_in = vec![false; index.nodes()];
    nodes.iter().for_each(|&n| is_in[n as usize] = true);
    is_in
}

/// Whether most of what a click hits, in all views, is in a set.
pub(crate) fn holds(is_in: &[bool], click: &[u32]) -> bool {
    2 * click.iter().filter(|&&n| is_in[n as usize]).count() > click.len()
}

/// Number of clicks that a set contradicts: positive ones outside and negative ones inside.
pub(crate) fn contradictions(index: &SceneIndex, seeds: &Seeds, nodes: &[u32]) -> usize {
    let is_in = membership(index, nodes);
    seeds.positive.iter().filter(|click| !holds(&is_in, click)).count()
        + seeds.negative.iter().filter(|click| holds(&is_in, click)).count()
}
