//! Lloyd's rounds on few centroids, by matrix products.

use rand::RngExt as _;

use crate::rng::keyed_rng;

/// Random stream of the first centroids.
const STREAM: u64 = 0x6b6d_6561_6e73;
/// Points per matrix product: its result stays in the second-level cache.
const BLOCK: usize = 64;

/// Centroids with what a search needs of them.
pub(super) struct Centroids {
    rows: Vec<f32>,
    /// `|c|²`.
    squares: Vec<f32>,
    dimensions: usize,
}

impl Centroids {
    pub(super) fn new(rows: Vec<f32>, dimensions: usize) -> Self {
        let square = |row: &[f32]| row.iter().map(|c| c * c).sum();
        let squares = rows.chunks_exact(dimensions).map(square).collect();
        Self { rows, squares, dimensions }
    }

    pub(super) fn len(&self) -> usize {
        self.squares.len()
    }

    pub(super) fn rows(&self) -> &[f32] {
        &self.rows
    }

    /// `|c|² - 2 x·c` of some points and all centroids, `[points, centroids]`.
    pub(super) fn scores(&self, points: &[f32], scores: &mut Vec<f32>) {
        let m = points.len() / self.dimensions;
        scores.clear();
        (0..m).for_each(|_| scores.extend_from_slice(&self.squares));
        product(points, &self.rows, self.dimensions, scores, self.len());
    }

    /// Calls `found(point, score, centroid)` with the best centroid of each point; of equal ones the first.
    pub(super) fn search(&self, points: &[f32], mut found: impl FnMut(usize, f32, u32)) {
        let mut scores = Vec::new();
        for (block, some) in points.chunks(BLOCK * self.dimensions).enumerate() {
            self.scores(some, &mut scores);
            for (i, row) in scores.chunks_exact(self.len()).enumerate() {
                let (best, score) = lowest(row);
                found(block * BLOCK + i, score, best);
            }
        }
    }
}

/// `scores -= 2 points centroidsᵀ`.
#[expect(unsafe_code, reason = "matrixmultiply takes raw pointers; the lengths are checked here")]
fn product(points: &[f32], rows: &[f32], dimensions: usize, scores: &mut [f32], k: usize) {
    let m = points.len() / dimensions;
    assert!(points.len() == m * dimensions && rows.len() == k * dimensions);
    assert_eq!(scores.len(), m * k, "room for all scores");
    let stride = dimensions as isize;
    // SAFETY: the three matrices have the lengths that their strides imply, checked above.
    unsafe {
        matrixmultiply::sgemm(
            m,
            dimensions,
            k,
            -2.0,
            points.as_ptr(),
            stride,
            1,
            rows.as_ptr(),
            1,
            stride,
            1.0,
            scores.as_mut_ptr(),
            k as isize,
            1,
        );
    }
}

/// Index and value of the lowest score; the first of equal ones. NaN is never lowest.
fn lowest(scores: &[f32]) -> (u32, f32) {
    // Two passes without branches are quicker than one with.
    const LANES: usize = 16;
    let (blocks, rest) = scores.as_chunks::<LANES>();
    let mut least = [f32::INFINITY; LANES];
    for block in blocks {
        for (least, score) in least.iter_mut().zip(block) {
            *least = if score < least { *score } else { *least };
        }
    }
    let least = least.iter().chain(rest).fold(f32::INFINITY, |a, &b| if b < a { b } else { a });
    (scores.iter().position(|&score| score == least).unwrap_or(0) as u32, least)
}

/// Rounds of Lloyd's algorithm from `clusters` different points; centroids without points move to the
/// points that are worst off.
pub(super) fn lloyd(
    points: &[f32],
    dimensions: usize,
    clusters: usize,
    iterations: u32,
    seed: u64,
    item: u64,
) -> Centroids {
    let n = points.len() / dimensions;
    let chosen = choose(n, clusters.min(n), seed, item);
    let row = |i: usize| &points[i * dimensions..(i + 1) * dimensions];
    let rows = chosen.iter().flat_map(|i| row(*i).iter().copied()).collect();
    let mut centroids = Centroids::new(rows, dimensions);
    if chosen.len() == n {
        return centroids; // every point is one
    }
    let mut labels = vec![0; n];
    let mut errors = vec![0.0f32; n];
    for _ in 0..iterations {
        centroids.search(points, |i, score, label| {
            labels[i] = label;
            errors[i] = score + row(i).iter().map(|x| x * x).sum::<f32>();
        });
        let mut rows = std::mem::take(&mut centroids.rows);
        let counts = move_to_means(points, dimensions, &labels, &mut rows);
        let empty: Vec<usize> = (0..counts.len()).filter(|c| counts[*c] == 0).collect();
        if !empty.is_empty() {
            let mut worst: Vec<usize> = (0..n).collect();
            worst.sort_unstable_by(|a, b| errors[*b].total_cmp(&errors[*a]).then(a.cmp(b)));
            for (cluster, i) in empty.into_iter().zip(worst) {
                rows[cluster * dimensions..(cluster + 1) * dimensions].copy_from_slice(row(i));
            }
        }
        centroids = Centroids::new(rows, dimensions);
    }
    centroids
}

/// `count` different numbers below `n`, in rising order.
fn choose(n: usize, count: usize, seed: u64, item: u64) -> Vec<usize> {
    let mut rng = keyed_rng(seed, STREAM, item);
    // Selection sampling: each number is taken with the chance that still has to be used up.
    let mut left = count;
    let mut chosen = Vec::with_capacity(count);
    for i in 0..n {
        if rng.random_range(0..n - i) < left {
            chosen.push(i);
            left -= 1;
        }
    }
    chosen
}

/// Moves each centroid to the mean of its points, in f64 and in the order of the points; those without
/// points stay. The numbers of points come back.
pub(super) fn move_to_means(
    points: &[f32],
    dimensions: usize,
    labels: &[u32],
    centroids: &mut [f32],
) -> Vec<u32> {
    let mut sums = vec![0.0f64; centroids.len()];
    let mut counts = vec![0u32; centroids.len() / dimensions];
    for (point, label) in points.chunks_exact(dimensions).zip(labels) {
        let at = *label as usize;
        counts[at] += 1;
        let sum = &mut sums[at * dimensions..(at + 1) * dimensions];
        sum.iter_mut().zip(point).for_each(|(sum, x)| *sum += f64::from(*x));
    }
    for ((centroid, sum), count) in
        centroids.chunks_exact_mut(dimensions).zip(sums.chunks_exact(dimensions)).zip(&counts)
    {
        if *count > 0 {
            let share = f64::from(*count).recip();
            centroid.iter_mut().zip(sum).for_each(|(c, s)| *c = (s * share) as f32);
        }
    }
    counts
}
