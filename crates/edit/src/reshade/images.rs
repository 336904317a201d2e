//! Where the matter of a source is after the edit: once, several times, or nowhere.

use std::collections::HashMap;
use std::num::NonZero;

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use motes_math::median::median;
use motes_math::sigmoid::sigmoid;
use motes_scene::{Gaussians, Surface};
use rayon::prelude::*;

use super::absorption::Absorption;
use crate::AT_REST;

/// Gaussians that are fainter do not say whose a vertex is.
const LEAST_OPACITY: f32 = 0.1;
/// Edges that are looked at.
const EDGES: usize = 10_000;
/// So many Gaussians vote on a vertex.
const VOTERS: NonZero<usize> = NonZero::new(5).unwrap();

/// What became of matter: the motions of its images, ascending, and the hole that it left.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Fate {
    pub(super) motions: Vec<u32>,
    pub(super) hole: Option<u32>,
}

impl Fate {
    /// Of matter that is where it was.
    pub(super) fn stayed() -> Self {
        Self { motions: vec![AT_REST], hole: None }
    }

    /// Whether matter is still (also) at its old place.
    pub(super) fn stays(&self) -> bool {
        self.motions.first() == Some(&AT_REST)
    }
}

/// Fates, each known by a number; number 0 is to have stayed.
#[derive(Debug)]
pub(super) struct Images {
    fates: Vec<Fate>,
    /// Number of the fate of every row of the source.
    of_row: Vec<u32>,
}

impl Images {
    /// Of `rows` rows of a source, by the `(row, motion)` that there is now.
    pub(super) fn new(rows: usize, now: impl Iterator<Item = (u32, u32)>) -> Self {
        let mut fates = vec![Fate::default(); rows];
        for (row, motion) in now {
            if let Some(fate) = fates.get_mut(row as usize)
                && !fate.motions.contains(&motion)
            {
                fate.motions.push(motion);
            }
        }
        fates.iter_mut().for_each(|fate| fate.motions.sort_unstable());
        Self::numbered(fates)
    }

    fn numbered(of_row: Vec<Fate>) -> Self {
        let mut fates = vec![Fate::stayed()];
        let mut known = HashMap::from([(Fate::stayed(), 0)]);
        let of_row = of_row
            .into_iter()
            .map(|fate| {
                *known.entry(fate).or_insert_with_key(|fate| {
                    fates.push(fate.clone());
                    fates.len() as u32 - 1
                })
            })
            .collect();
        Self { fates, of_row }
    }

    /// The same with other fates.
    pub(super) fn with_fates(&self, mut fate_of: impl FnMut(u32, &Fate) -> Fate) -> Self {
        let rows = 0..self.of_row.len() as u32;
        Self::numbered(rows.map(|row| fate_of(row, self.of_row(row))).collect())
    }

    /// The fate with a number.
    pub(super) fn fate(&self, number: u32) -> &Fate {
        &self.fates[number as usize]
    }

    /// The fate of a row.
    pub(super) fn of_row(&self, row: u32) -> &Fate {
        self.fate(self.of_row[row as usize])
    }

    /// The fate of every vertex: that of the matter there, and where there is none, of most of the nearest Gaussians that can be
    /// seen. Far from what changed it is to have stayed.
    pub(super) fn of_vertices(&self, gaussians: &Gaussians, surface: &Surface) -> Vec<u32> {
        let seen: Vec<u32> = (0..gaussians.len())
            .filter(|&i| {
                sigmoid(gaussians.opacity_logits[i]) >= LEAST_OPACITY
                    && Vec3::from(gaussians.means[i]).is_finite()
            })
            .map(|i| i as u32)
            .collect();
        if self.fates.len() == 1 || seen.is_empty() {
            return vec![0; surface.vertices.len()];
        }
        let points: Vec<[f32; 3]> = seen.iter().map(|&i| gaussians.means[i as usize]).collect();
        let Ok(tree) = ImmutableKdTree::<f32, 3>::new_from_slice(&points) else {
            return vec![0; surface.vertices.len()];
        };
        let is_changed = |row: u32| self.of_row[row as usize] != 0;
        let absorption = Absorption::around(gaussians, &seen, is_changed, usual_edge(surface));
        let vote = |vertex: &[f32; 3]| {
            let at = Vec3::from(*vertex).as_dvec3();
            if !at.is_finite() || !absorption.is_near(at) {
                return 0;
            }
            if let Some(fate) = absorption.kind_at(at, |row| self.of_row[row as usize]) {
                return fate;
            }
            let nearest = tree.query(vertex).nearest_n::<SquaredEuclidean<f32>>(VOTERS).execute();
            // In order of distance, so that the nearest wins a draw.
            let votes: Vec<u32> =
                nearest.iter().map(|n| self.of_row[seen[n.item as usize] as usize]).collect();
            let count = |fate: u32| votes.iter().filter(|v| **v == fate).count();
            votes.iter().rev().copied().max_by_key(|fate| count(*fate)).unwrap_or(0)
        };
        surface.vertices.par_iter().with_min_len(256).map(vote).collect()
    }
}

/// Median length of the edges, world units.
fn usual_edge(surface: &Surface) -> f32 {
    let step = surface.triangles.len().div_ceil(EDGES).max(1);
    let length = |[a, b, _]: &[u32; 3]| {
        let [a, b] = [a, b].map(|v| Vec3::from(surface.vertices[*v as usize]).as_dvec3());
        a.distance(b)
    };
    let lengths = surface.triangles.iter().step_by(step).map(length);
    median(lengths.filter(|l| l.is_finite())).unwrap_or(0.0) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_know_their_images() {
        // Row 0 stays, row 1 moves, row 2 is doubled, row 3 is gone; the last row is not of this source.
        let now = [(0, 0), (1, 1), (2, 0), (2, 1), (u32::MAX, 0)];
        let images = Images::new(4, now.into_iter());
        let motions: Vec<&[u32]> = (0..4).map(|r| &images.of_row(r).motions[..]).collect();
        assert_eq!(motions, [&[0][..], &[1], &[0, 1], &[]]);
        let stays: Vec<bool> = (0..4).map(|r| images.of_row(r).stays()).collect();
        assert_eq!(stays, [true, false, true, false]);
        let images = images
            .with_fates(|_, fate| Fate { hole: (!fate.stays()).then_some(7), ..fate.clone() });
        assert_eq!((0..4).map(|r| images.of_row(r).hole).filter(Option::is_some).count(), 2);
        assert!(images.of_row(0).stays() && images.of_row(1).motions == [1]);
    }
}
