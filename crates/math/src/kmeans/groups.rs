//! Points in coarse groups, and how the fine centroids are shared among them.

use rayon::prelude::*;

use super::KmeansOptions;
use super::lloyd::{Centroids, lloyd};

/// Points per group that its center is fitted to.
const SAMPLES_PER_GROUP: usize = 128;
/// Points of one task.
const CHUNK: usize = 4096;

/// A coarse quantization.
pub(super) struct Groups {
    centers: Centroids,
    /// Points of each group, rising.
    pub(super) members: Vec<Vec<u32>>,
    /// Sum of squared distances to the center, per group.
    errors: Vec<f64>,
}

/// Rows of some points, one after another.
pub(super) fn gather(points: &[f32], dimensions: usize, rows: &[u32]) -> Vec<f32> {
    let row = |i: &u32| &points[*i as usize * dimensions..(*i as usize + 1) * dimensions];
    rows.iter().flat_map(row).copied().collect()
}

impl Groups {
    pub(super) fn find(
        points: &[f32],
        dimensions: usize,
        count: usize,
        options: &KmeansOptions,
    ) -> Self {
        let n = points.len() / dimensions;
        let samples = (count * SAMPLES_PER_GROUP).min(n);
        // Evenly spread over the file, which may be sorted.
        let rows: Vec<u32> = (0..samples).map(|i| (i * n / samples) as u32).collect();
        let sample = gather(points, dimensions, &rows);
        let centers = lloyd(&sample, dimensions, count, options.iterations, options.seed, 0);
        let found: Vec<Vec<(u32, f32)>> = points
            .par_chunks(CHUNK * dimensions)
            .map(|some| {
                let mut found = vec![(0, 0.0); some.len() / dimensions];
                centers.search(some, |i, score, group| {
                    let row = &some[i * dimensions..(i + 1) * dimensions];
                    found[i] = (group, score + row.iter().map(|x| x * x).sum::<f32>());
                });
                found
            })
            .collect();
        let mut members = vec![Vec::new(); centers.len()];
        let mut errors = vec![0.0; centers.len()];
        for (i, (group, error)) in found.into_iter().flatten().enumerate() {
            members[group as usize].push(i as u32);
            errors[group as usize] += f64::from(error.max(0.0));
        }
        Self { centers, members, errors }
    }

    /// For each point the label of the nearest centroid among those of its `probes` nearest
    /// groups. `starts` are the labels of the first centroid of each group.
    pub(super) fn nearest(
        &self,
        points: &[f32],
        dimensions: usize,
        fitted: &[Centroids],
        starts: &[u32],
        probes: usize,
    ) -> Vec<u32> {
        let n = points.len() / dimensions;
        let mut visitors: Vec<Vec<u32>> = vec![Vec::new(); self.members.len()];
        let near: Vec<Vec<u32>> = points
            .par_chunks(CHUNK * dimensions)
            .map(|some| self.probed(some, probes.min(fitted.len())))
            .collect();
        let each = probes.min(fitted.len());
        for (i, groups) in near.iter().flat_map(|chunk| chunk.chunks_exact(each)).enumerate() {
            groups.iter().for_each(|group| visitors[*group as usize].push(i as u32));
        }
        drop(near);
        let mut best = vec![(f32::INFINITY, 0u32); n];
        // A batch of groups at a time bounds the memory; merged in the order of the groups.
        let tasks: Vec<usize> = (0..fitted.len()).filter(|g| fitted[*g].len() > 0).collect();
        for batch in tasks.chunks(64) {
            let found: Vec<Vec<(f32, u32)>> = batch
                .par_iter()
                .map(|&g| {
                    let own = gather(points, dimensions, &visitors[g]);
                    let mut found = Vec::with_capacity(visitors[g].len());
                    fitted[g]
                        .search(&own, |_, score, label| found.push((score, starts[g] + label)));
                    found
                })
                .collect();
            for (&g, found) in batch.iter().zip(found) {
                for (&i, candidate) in visitors[g].iter().zip(found) {
                    let best = &mut best[i as usize];
                    if candidate.0 < best.0 {
                        *best = candidate;
                    }
                }
            }
        }
        best.into_iter().map(|(_, label)| label).collect()
    }

    /// The nearest groups of some points, `probes` each, those without points left out as long as
    /// others are there.
    fn probed(&self, points: &[f32], probes: usize) -> Vec<u32> {
        let mut near = Vec::new();
        let mut scores = Vec::new();
        self.centers.scores(points, &mut scores);
        let mut order: Vec<(f32, u32)> = Vec::new();
        for row in scores.chunks_exact(self.centers.len()) {
            order.clear();
            order.extend(row.iter().zip(0..).map(|(score, group)| {
                let empty = self.members[group as usize].is_empty();
                (if empty { f32::INFINITY } else { *score }, group)
            }));
            if probes < order.len() {
                let before =
                    |a: &(f32, u32), b: &(f32, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
                order.select_nth_unstable_by(probes - 1, before);
            }
            near.extend(order[..probes].iter().map(|(_, group)| *group));
        }
        near
    }
}

/// How many of the centroids each group gets: in proportion to the square root of points times
/// squared error, at most one per point, at least one where there are points.
pub(super) fn shares(groups: &Groups, clusters: usize) -> Vec<usize> {
    let sizes: Vec<usize> = groups.members.iter().map(Vec::len).collect();
    let weights: Vec<f64> =
        sizes.iter().zip(&groups.errors).map(|(n, error)| (*n as f64 * error).sqrt()).collect();
    let mut shares: Vec<usize> = sizes.iter().map(|n| usize::from(*n > 0)).collect();
    // What a full group leaves goes to the others; each round fills a group or ends.
    loop {
        let left = clusters.saturating_sub(shares.iter().sum());
        let open: Vec<usize> =
            (0..sizes.len()).filter(|g| shares[*g] < sizes[*g] && weights[*g] > 0.0).collect();
        let total: f64 = open.iter().map(|g| weights[*g]).sum();
        if left == 0 || !(total > 0.0) {
            return shares;
        }
        let before = left;
        let mut given = 0;
        for &g in &open {
            let more = (left as f64 * weights[g] / total) as usize;
            let more = more.min(sizes[g] - shares[g]);
            shares[g] += more;
            given += more;
        }
        if given == 0 {
            // Fractions of one are left: to the heaviest.
            let mut heaviest = open;
            heaviest.sort_by(|a, b| weights[*b].total_cmp(&weights[*a]).then(a.cmp(b)));
            heaviest.into_iter().take(before).for_each(|g| shares[g] += 1);
        }
    }
}
