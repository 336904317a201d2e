//! Clipped texels of a panorama, by connected regions.

use glam::DVec3;
use motes_math::disjoint_sets::DisjointSets;

use crate::sphere::{texel_direction, texel_solid_angle};

/// Connected clipped texels of a panorama.
#[derive(Clone, Debug)]
pub struct Region {
    /// Indices of the texels.
    pub texels: Vec<usize>,
    /// Unit, axes of the map.
    pub direction: DVec3,
    /// Steradian.
    pub solid_angle: f64,
}

/// Clipped regions, the largest first.
pub fn clipped_regions(clipped: &[bool], width: usize) -> Vec<Region> {
    let height = clipped.len() / width;
    let mut sets = DisjointSets::new(clipped.len());
    for i in (0..clipped.len()).filter(|i| clipped[*i]) {
        let (x, y) = (i % width, i / width);
        let right = y * width + (x + 1) % width;
        if clipped[right] {
            sets.join(i as u32, right as u32);
        }
        if y + 1 < height && clipped[i + width] {
            sets.join(i as u32, (i + width) as u32);
        }
    }
    let labels = sets.labels();
    let mut of_label: std::collections::BTreeMap<u32, Vec<usize>> = Default::default();
    for i in (0..clipped.len()).filter(|i| clipped[*i]) {
        of_label.entry(labels[i]).or_default().push(i);
    }
    let region = |texels: Vec<usize>| {
        let omega = |i: &usize| texel_solid_angle(i / width, width, height);
        let toward = |i: &usize| texel_direction(i % width, i / width, width, height) * omega(i);
        let direction = texels.iter().map(toward).sum::<DVec3>().normalize_or(DVec3::Y);
        let solid_angle = texels.iter().map(omega).sum();
        Region { texels, direction, solid_angle }
    };
    let mut regions: Vec<Region> = of_label.into_values().map(region).collect();
    regions.sort_by(|a, b| {
        b.solid_angle.total_cmp(&a.solid_angle).then(a.texels[0].cmp(&b.texels[0]))
    });
    regions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clipped_texels_are_joined_over_the_seam() {
        let mut clipped = vec![false; 32 * 16];
        for (x, y) in [(31, 5), (0, 5), (1, 5), (10, 8)] {
            clipped[y * 32 + x] = true;
        }
        let regions = clipped_regions(&clipped, 32);
        assert_eq!(regions.iter().map(|r| r.texels.len()).collect::<Vec<_>>(), [3, 1]);
        let seam = texel_direction(0, 5, 32, 16);
        assert!(regions[0].direction.dot(seam) > 0.999);
    }
}
