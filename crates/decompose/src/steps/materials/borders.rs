//! Borders of parts, point by point.
//!
//! Pieces that parts are merged from are compact, and one across a border belongs to both sides. Points move to the part beside them that
//! explains them best, then parts choose their labels again (iterated conditional modes, Besag 1986; labels between, Isack & Boykov 2012).

use super::profile::Profile;
use super::regions::{BESIDE, Claim, RegionOptions, Regions, may_join, merged_pieces};
use crate::observation::Sample;

/// Times that all points are looked at.
const ROUNDS: usize = 10;

/// Divides `samples` into parts: merged pieces, and then point by point.
pub(super) fn find_regions(
    samples: &[Sample],
    profile: &Profile,
    options: &RegionOptions<'_>,
    claims: &[Claim],
) -> Regions {
    let mut regions = merged_pieces(samples, profile, options, claims);
    settle(samples, profile, options, claims, &mut regions);
    regions
}

/// Moves points of `regions` to the parts of their neighbors, as long as that lowers what the points cost under the labels
/// of their parts plus `options.border` for every neighbor that is of another part. Labels follow after every round.
fn settle(
    samples: &[Sample],
    profile: &Profile,
    options: &RegionOptions<'_>,
    claims: &[Claim],
    regions: &mut Regions,
) {
    for _ in 0..ROUNDS {
        let mut moved = false;
        for p in 0..samples.len() {
            let own = regions.of_sample[p];
            let beside = || options.neighbors[p * BESIDE..][..BESIDE].iter().map(|&q| q as usize);
            let cost = |part: u32| {
                let foreign = beside().filter(|&q| regions.of_sample[q] != part).count();
                let label = regions.label[part as usize];
                options.evidence * profile.costs_of(p)[label] + options.border * foreign as f32
            };
            let mut best = (cost(own), own);
            for q in beside().filter(|&q| may_join(samples, claims, p, q)) {
                let part = regions.of_sample[q];
                let kind = profile.labels[regions.label[part as usize]].kind;
                if part != best.1 && claims[p].allows(kind) && cost(part) < best.0 {
                    best = (cost(part), part);
                }
            }
            if best.1 != own {
                regions.of_sample[p] = best.1;
                moved = true;
            }
        }
        if !moved {
            break;
        }
        regions.choose_labels(profile, options, claims);
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::profile::labels;
    use super::super::regions::beside;
    use super::*;
    use crate::appearance::Kind;

    const BORDER: usize = 27;

    /// A strip that is explained best as a dielectric up to [`BORDER`] and as a metal from there on, but for point 9, which is a little better
    /// explained as a metal; and which of its points are called metal.
    fn metal(border: f32, claims: &[Claim]) -> Vec<bool> {
        let at = |p: usize| Sample { position: Vec3::X * p as f32, ..Sample::facing_z(Vec::new()) };
        let strip: Vec<Sample> = (0..60).map(at).collect();
        let costs = (0..60).flat_map(|p| match p {
            9 => [0.9, 0.2, 0.1],
            p if p < BORDER => [0.9, 0.1, 0.7],
            _ => [0.9, 0.7, 0.1],
        });
        let profile = Profile {
            labels: labels(1),
            prices: vec![0.0; 3],
            costs: costs.collect(),
            base_color_linear: vec![Vec3::ONE; 180],
        };
        let neighbors = &beside(&strip);
        let options = RegionOptions { pieces: 4, price: 0.5, evidence: 1.0, border, neighbors };
        let found = find_regions(&strip, &profile, &options, claims);
        (0..60).map(|p| found.kind(p, &profile) == Kind::Metal).collect()
    }

    #[test]
    fn a_piece_across_a_border_is_divided() {
        let found = metal(0.1, &[Claim::None; 60]);
        assert!((0..60).all(|p| found[p] == (p >= BORDER)), "{found:?}");
    }

    #[test]
    fn a_point_goes_its_own_way_only_where_that_is_free_and_beside_its_part() {
        // It has nobody to join.
        assert!(!metal(0.0, &[Claim::None; 60])[9]);
        // What is claimed to be no metal joins none.
        let mut claims = [Claim::None; 60];
        claims[BORDER] = Claim::NoMetal;
        let found = metal(0.0, &claims);
        assert!(!found[BORDER] && found[BORDER + 8..].iter().all(|m| *m), "{found:?}");
    }
}
