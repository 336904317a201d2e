//! The best few values for many: optimal scalar quantization.
//!
//! Values fall into bins that are even half by value and half by rank; the bins are split into `k` runs of
//! least squared error by dynamic programming. The cost of runs fulfils the quadrangle inequality, so the
//! best split moves in one direction and divide and conquer finds all of a row in O(bins log bins)
//! (Wu 1991).

use rayon::prelude::*;

/// Bins: far more than any codebook has values.
const BINS: usize = 4096;

/// Sums of a run of bins.
struct Prefix {
    weight: Vec<f64>,
    first: Vec<f64>,
    second: Vec<f64>,
}

impl Prefix {
    /// Squared error of bins `a..b` around their mean.
    fn cost(&self, a: usize, b: usize) -> f64 {
        let weight = self.weight[b] - self.weight[a];
        if !(weight > 0.0) {
            return 0.0;
        }
        let first = self.first[b] - self.first[a];
        (self.second[b] - self.second[a] - first * first / weight).max(0.0)
    }

    fn mean(&self, a: usize, b: usize) -> f64 {
        (self.first[b] - self.first[a]) / (self.weight[b] - self.weight[a])
    }
}

/// At most `k` values, rising, such that the nearest of them is a good stand-in for each of `values`.
///
/// A bin of `n` values counts as `n^density`: 1 gives the least mean squared error, lower exponents
/// care more for rare values. Values must be finite. Without values there is one, 0.
pub fn codebook(values: &[f32], k: usize, density: f64) -> Vec<f32> {
    let mut sorted = values.to_vec();
    sorted.par_sort_unstable_by(f32::total_cmp);
    let (Some(low), Some(high)) = (sorted.first(), sorted.last()) else { return vec![0.0] };
    let (low, range) = (f64::from(*low), f64::from(*high) - f64::from(*low));
    if !(range > 0.0) || k < 2 {
        let mean = sorted.iter().map(|v| f64::from(*v)).sum::<f64>() / sorted.len() as f64;
        return vec![mean as f32];
    }
    let bins = bins(&sorted, low, range);
    let mut prefix = Prefix { weight: vec![0.0], first: vec![0.0], second: vec![0.0] };
    for (count, sum) in &bins {
        let (mean, weight) = (sum / count, count.powf(density));
        let last = prefix.weight.len() - 1;
        prefix.weight.push(prefix.weight[last] + weight);
        prefix.first.push(prefix.first[last] + weight * (mean - low));
        prefix.second.push(prefix.second[last] + weight * (mean - low).powi(2));
    }
    let n = bins.len();
    let mut costs: Vec<f64> = (0..=n).map(|b| prefix.cost(0, b)).collect();
    let mut splits: Vec<Vec<u32>> = Vec::new();
    for _ in 1..k.min(n) {
        let mut next = vec![f64::INFINITY; n + 1];
        let mut split = vec![0; n + 1];
        next[0] = 0.0;
        best_splits(&prefix, &costs, 1..n + 1, 0..n, &mut next, &mut split);
        splits.push(split);
        costs = next;
    }
    let mut book = Vec::new();
    let mut end = n;
    for split in splits.iter().rev() {
        let start = split[end] as usize;
        if start < end {
            book.push((low + prefix.mean(start, end)) as f32);
        }
        end = start;
    }
    if end > 0 {
        book.push((low + prefix.mean(0, end)) as f32);
    }
    book.reverse();
    book
}

/// Count and sum of each bin that has values.
fn bins(sorted: &[f32], low: f64, range: f64) -> Vec<(f64, f64)> {
    let mut bins: Vec<(f64, f64)> = Vec::new();
    let mut current = usize::MAX;
    for (rank, value) in sorted.iter().enumerate() {
        let by_rank = rank as f64 / sorted.len() as f64;
        let by_value = (f64::from(*value) - low) / range;
        let bin = (BINS as f64 * 0.5 * (by_rank + by_value)) as usize;
        if bin != current {
            bins.push((0.0, 0.0));
            current = bin;
        }
        if let Some((count, sum)) = bins.last_mut() {
            *count += 1.0;
            *sum += f64::from(*value);
        }
    }
    bins
}

/// For each `end` of `ends` the start in `starts` of the last run that costs least.
fn best_splits(
    prefix: &Prefix,
    before: &[f64],
    ends: std::ops::Range<usize>,
    starts: std::ops::Range<usize>,
    costs: &mut [f64],
    split: &mut [u32],
) {
    if ends.is_empty() {
        return;
    }
    let end = ends.start + (ends.end - ends.start) / 2;
    let mut best = starts.start;
    let last = starts.end.min(end);
    for (start, before) in (starts.start..last).zip(&before[starts.start..last.max(starts.start)]) {
        let cost = before + prefix.cost(start, end);
        if cost < costs[end] {
            costs[end] = cost;
            best = start;
        }
    }
    split[end] = best as u32;
    best_splits(prefix, before, ends.start..end, starts.start..best + 1, costs, split);
    best_splits(prefix, before, end + 1..ends.end, best..starts.end, costs, split);
}

/// The index of the nearest value of a rising codebook, the lower of two equally near.
pub fn nearest_in_codebook(book: &[f32], value: f32) -> usize {
    let above = book.partition_point(|entry| *entry < value);
    if above == 0 {
        return 0;
    }
    if above == book.len() || value - book[above - 1] <= book[above] - value {
        return above - 1;
    }
    above
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(book: &[f32], values: &[f32]) -> f64 {
        let squared = |v: &f32| f64::from(v - book[nearest_in_codebook(book, *v)]).powi(2);
        values.iter().map(squared).sum::<f64>() / values.len() as f64
    }

    #[test]
    fn few_different_values_come_back() {
        let values: Vec<f32> = (0..1000).map(|i| [0.5, -2.0, 7.0][i % 3]).collect();
        assert_eq!(codebook(&values, 16, 1.0), [-2.0, 0.5, 7.0]);
        assert_eq!(codebook(&[], 16, 1.0), [0.0]);
        assert_eq!(codebook(&[3.0; 5], 16, 1.0), [3.0]);
    }

    #[test]
    fn even_values_get_even_steps_and_crowds_get_more() {
        let even: Vec<f32> = (0..10_000).map(|i| i as f32 / 10_000.0).collect();
        let book = codebook(&even, 10, 1.0);
        assert_eq!(book.len(), 10);
        for (i, value) in book.iter().enumerate() {
            assert!((value - (i as f32 + 0.5) / 10.0).abs() < 2e-3, "{i}: {value}");
        }
        // The optimum of a density f has steps in proportion to f^(-1/3), so a third of the
        // squared error of even steps is gone for the cube of an even value.
        let crowded: Vec<f32> = even.iter().map(|v| v.powi(3)).collect();
        let steps: Vec<f32> = (0..64).map(|i| (i as f32 + 0.5) / 64.0).collect();
        let best = codebook(&crowded, 64, 1.0);
        assert!(error(&best, &crowded) < 0.7 * error(&steps, &crowded));
    }

    #[test]
    fn the_split_is_that_of_trying_all() {
        let values = [0.0, 0.1, 0.2, 5.0, 5.1, 9.0, 9.5, 9.6f32];
        let mut least = f64::INFINITY;
        for a in 1..7 {
            for b in a + 1..8 {
                let mean = |part: &[f32]| part.iter().sum::<f32>() / part.len() as f32;
                let book = [mean(&values[..a]), mean(&values[a..b]), mean(&values[b..])];
                least = least.min(error(&book, &values));
            }
        }
        assert!((error(&codebook(&values, 3, 1.0), &values) - least).abs() < 1e-9);
    }

    #[test]
    fn the_nearest_entry_is_found() {
        let book = [0.0, 1.0, 4.0];
        for (value, expected) in [(-1.0, 0), (0.4, 0), (0.6, 1), (2.6, 2), (9.0, 2), (0.5, 0)] {
            assert_eq!(nearest_in_codebook(&book, value), expected, "{value}");
        }
    }
}
