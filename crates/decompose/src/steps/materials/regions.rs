//! Parts of one roughness and kind.
//!
//! The shortest description wins (Rissanen 1978): parts are merged as long as a common label costs less than the
//! labels of two parts, so materials differ only where the photos show it.

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec3;
use motes_math::disjoint_sets::DisjointSets;
use motes_math::knn::nearest_neighbors;

use super::profile::Profile;
use crate::appearance::Kind;
use crate::observation::Sample;

/// Points beside a point.
pub(super) const BESIDE: usize = 8;

/// How parts are found.
#[derive(Clone, Copy, Debug)]
pub(super) struct RegionOptions<'a> {
    /// Number of pieces to start from.
    pub pieces: usize,
    /// What one more part costs, in units of the profile's cost.
    pub price: f32,
    /// Observations of neighboring points err together: costs count this much.
    pub evidence: f32,
    /// What every pair of neighbors of two parts costs, in the same units.
    pub border: f32,
    /// The points beside every one, nearest first, `[P, BESIDE]`.
    pub neighbors: &'a [u32],
}

/// Parts of the surface.
#[derive(Clone, Debug)]
pub(super) struct Regions {
    /// Part of every sample.
    pub of_sample: Vec<u32>,
    /// Index of the best label per part.
    pub label: Vec<usize>,
    /// Summed costs by label, per part.
    pub costs: Vec<Vec<f32>>,
}

/// What is known of the kind of a point beforehand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Claim {
    /// Nothing.
    #[default]
    None,
    /// It belongs to no metal; nor does a part that it is in.
    NoMetal,
    /// It belongs to a metal, and its part to nothing else.
    Metal,
}

impl Claim {
    pub(super) fn allows(self, kind: Kind) -> bool {
        self == Self::None || (self == Self::Metal) == (kind == Kind::Metal)
    }
}

impl Regions {
    /// Indices of the samples of a part.
    pub(super) fn members(&self, part: usize) -> Vec<usize> {
        let of = self.of_sample.iter().enumerate();
        of.filter(|(_, own)| **own as usize == part).map(|(p, _)| p).collect()
    }

    /// Numbers the parts from 0 on without gaps, sums their costs, and gives each the label that costs it least.
    pub(super) fn choose_labels(
        &mut self,
        profile: &Profile,
        options: &RegionOptions<'_>,
        claims: &[Claim],
    ) {
        let used: BTreeSet<u32> = self.of_sample.iter().copied().collect();
        let number: BTreeMap<u32, u32> = used.into_iter().zip(0..).collect();
        self.of_sample.iter_mut().for_each(|part| *part = number[part]);
        let claim;
        (self.costs, claim) = tally(&self.of_sample, number.len(), profile, options, claims);
        let best = |(costs, claim): (&Vec<f32>, &Claim)| {
            let priced = |label: usize| costs[label] + price(profile, label, *claim);
            (0..costs.len()).min_by(|&x, &y| priced(x).total_cmp(&priced(y))).unwrap_or(0)
        };
        self.label = self.costs.iter().zip(&claim).map(best).collect();
    }

    /// Kind of a sample.
    pub(super) fn kind(&self, p: usize, profile: &Profile) -> Kind {
        profile.labels[self.label[self.of_sample[p] as usize]].kind
    }
}

/// Costs of `n` parts by label, and what is known of each.
fn tally(
    of_sample: &[u32],
    n: usize,
    profile: &Profile,
    options: &RegionOptions<'_>,
    claims: &[Claim],
) -> (Vec<Vec<f32>>, Vec<Claim>) {
    let mut costs = vec![vec![0.0; profile.labels.len()]; n];
    let mut claim = vec![Claim::None; n];
    for (p, &part) in of_sample.iter().enumerate() {
        let k = part as usize;
        claim[k] = joint(claim[k], claims[p]);
        for (sum, c) in costs[k].iter_mut().zip(profile.costs_of(p)) {
            *sum += options.evidence * c;
        }
    }
    (costs, claim)
}

/// [`RegionOptions::neighbors`] of samples.
pub(super) fn beside(samples: &[Sample]) -> Vec<u32> {
    let positions: Vec<[f32; 3]> = samples.iter().map(|s| s.position.to_array()).collect();
    nearest_neighbors(&positions, BESIDE)
}

/// Divides `samples` into parts along the borders of compact pieces. Flat pieces and what stands on them, and what is claimed to be
/// metal and what is not, are known to be different things: their parts do not merge.
pub(super) fn merged_pieces(
    samples: &[Sample],
    profile: &Profile,
    options: &RegionOptions<'_>,
    claims: &[Claim],
) -> Regions {
    if samples.is_empty() {
        return Regions { of_sample: Vec::new(), label: Vec::new(), costs: Vec::new() };
    }
    let piece = pieces(samples, claims, options.pieces);
    let n = piece.iter().max().map_or(0, |&m| m as usize + 1);
    let (mut costs, mut claim) = tally(&piece, n, profile, options, claims);
    let priced = |costs: &mut dyn Iterator<Item = f32>, claim: Claim| {
        let all = costs.enumerate().map(|(label, c)| c + price(profile, label, claim));
        all.fold(f32::INFINITY, f32::min)
    };
    let mut edges = adjacency(samples, claims, options.neighbors, &piece);
    let mut sets = DisjointSets::new(n);
    loop {
        // What merging saves: a price, minus what a common label loses.
        let gain = |a: usize, b: usize| {
            let mut both = costs[a].iter().zip(&costs[b]).map(|(x, y)| x + y);
            let joint = priced(&mut both, joint(claim[a], claim[b]));
            let own = |k: usize| priced(&mut costs[k].iter().copied(), claim[k]);
            options.price - (joint - own(a) - own(b))
        };
        let top = edges
            .iter()
            .map(|&(a, b)| (gain(a, b), a, b))
            .max_by(|x, y| x.0.total_cmp(&y.0).then((y.1, y.2).cmp(&(x.1, x.2))));
        let Some((saved, a, b)) = top else { break };
        if !(saved > 0.0) {
            break;
        }
        let moved = std::mem::take(&mut costs[b]);
        costs[a].iter_mut().zip(&moved).for_each(|(x, y)| *x += y);
        sets.join(a as u32, b as u32);
        claim[a] = joint(claim[a], claim[b]);
        edges = edges
            .iter()
            .map(|&(x, y)| {
                let (x, y) = (if x == b { a } else { x }, if y == b { a } else { y });
                (x.min(y), x.max(y))
            })
            .filter(|(x, y)| x != y)
            .collect();
    }
    let root = sets.labels();
    let of_sample = piece.iter().map(|&k| root[k as usize]).collect();
    let mut regions = Regions { of_sample, label: Vec::new(), costs: Vec::new() };
    regions.choose_labels(profile, options, claims);
    regions
}

/// What a label costs a part of which this is known.
fn price(profile: &Profile, label: usize, claim: Claim) -> f32 {
    let is_allowed = claim.allows(profile.labels[label].kind);
    if is_allowed { profile.prices[label] } else { f32::INFINITY }
}

/// Of a part of two, which are both claimed to be metal or neither is.
fn joint(a: Claim, b: Claim) -> Claim {
    if a == Claim::None { b } else { a }
}

/// Whether two points can be of one part.
pub(super) fn may_join(samples: &[Sample], claims: &[Claim], p: usize, q: usize) -> bool {
    let is_metal = |p: usize| claims[p] == Claim::Metal;
    samples[p].sheet == samples[q].sheet && is_metal(p) == is_metal(q)
}

/// Compact pieces of like direction: farthest points as seeds, everything to its nearest.
fn pieces(samples: &[Sample], claims: &[Claim], wanted: usize) -> Vec<u32> {
    let (low, high) = samples.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), s| {
        (l.min(s.position), h.max(s.position))
    });
    let size = (high - low).max_element().max(f32::MIN_POSITIVE);
    let distance = |a: usize, b: usize| {
        let (p, q) = (&samples[a], &samples[b]);
        let bend = (p.normal - q.normal).length_squared() * 1e-3;
        let gap = if may_join(samples, claims, a, b) { 0.0 } else { 1e3 };
        ((p.position - q.position) / size).length_squared() + bend + gap
    };
    let mut nearest = vec![f32::INFINITY; samples.len()];
    let mut piece = vec![0u32; samples.len()];
    let mut seed = 0;
    for k in 0..wanted.min(samples.len()) {
        for (p, near) in nearest.iter_mut().enumerate() {
            let d = distance(p, seed);
            if d < *near {
                (*near, piece[p]) = (d, k as u32);
            }
        }
        seed = (0..samples.len())
            .max_by(|&a, &b| nearest[a].total_cmp(&nearest[b]).then(b.cmp(&a)))
            .unwrap_or(0);
        if !(nearest[seed] > 0.0) {
            break;
        }
    }
    piece
}

fn adjacency(
    samples: &[Sample],
    claims: &[Claim],
    neighbors: &[u32],
    piece: &[u32],
) -> BTreeSet<(usize, usize)> {
    let pairs = neighbors.iter().enumerate().map(|(k, &q)| (k / BESIDE, q as usize));
    pairs
        .filter(|&(p, q)| piece[p] != piece[q] && may_join(samples, claims, p, q))
        .map(|(p, q)| (piece[p].min(piece[q]) as usize, piece[p].max(piece[q]) as usize))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::profile::{Profile, labels};
    use super::*;

    /// Kinds of two halves of a strip, of which all points are explained best as a dielectric, and a little worse otherwise.
    fn kinds(claims: &[Claim]) -> [Kind; 2] {
        let strip = (0..80)
            .map(|p| Sample { position: Vec3::X * p as f32, ..Sample::facing_z(Vec::new()) });
        let strip: Vec<Sample> = strip.collect();
        let labels = labels(1);
        let costs = [0.5, 0.1, 0.2].repeat(strip.len());
        let base_color_linear = vec![Vec3::ONE; costs.len()];
        let profile = Profile { prices: vec![0.0; 3], costs, base_color_linear, labels };
        let neighbors = &beside(&strip);
        let options =
            RegionOptions { pieces: 10, price: 5.0, evidence: 1.0, border: 0.1, neighbors };
        let found = merged_pieces(&strip, &profile, &options, claims);
        [10, 70].map(|p| found.kind(p, &profile))
    }

    #[test]
    fn claims_of_metal_hold_and_stay_among_themselves() {
        assert_eq!(kinds(&[Claim::None; 80]), [Kind::Dielectric; 2]);
        let mut claims = [Claim::None; 80];
        claims[..40].fill(Claim::Metal);
        assert_eq!(kinds(&claims), [Kind::Metal, Kind::Dielectric]);
        claims[40..].fill(Claim::NoMetal);
        assert_eq!(kinds(&claims), [Kind::Metal, Kind::Dielectric]);
    }
}
