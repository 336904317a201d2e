//! The search for the depth of each grid pixel.

use super::pair::Pair;
use super::photo::Photo;

/// Samples per side of a patch.
const SIDE: usize = 5;
/// Pixels between samples.
const SPACING: f32 = 1.5;
const SAMPLES: usize = SIDE * SIDE;
/// Sparse points whose depths a pixel tries.
const SEEDS: usize = 4;
/// Steps of 2.5 % around each seed.
const STEPS: [f32; 5] = [-0.05, -0.025, 0.0, 0.025, 0.05];
/// Correlation from which a match counts.
const ACCEPT: f32 = 0.75;
/// Standard deviation of luminance below which a patch matches anything.
const MIN_CONTRAST: f32 = 0.015;

/// A depth and how well it matches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Match {
    pub(super) inverse_depth: f32,
    pub(super) correlation: f32,
}

/// Zero-mean samples of a patch with unit norm.
struct Patch([f32; SAMPLES]);

impl Patch {
    fn normalized(mut samples: [f32; SAMPLES]) -> Option<Self> {
        let mean = samples.iter().sum::<f32>() / SAMPLES as f32;
        let mut squares = 0.0;
        for v in &mut samples {
            *v -= mean;
            squares += *v * *v;
        }
        if !(squares > SAMPLES as f32 * MIN_CONTRAST * MIN_CONTRAST) {
            return None;
        }
        let scale = squares.sqrt().recip();
        Some(Self(samples.map(|v| v * scale)))
    }
}

/// Samples of an affine image of the patch: center and the images of unit steps along x and y.
fn sample(photo: &Photo, center: (f32, f32), u: (f32, f32), v: (f32, f32)) -> Option<Patch> {
    let reach = SPACING * (SIDE / 2) as f32;
    let extent_x = reach * (u.0.abs() + v.0.abs()) + 1.0;
    let extent_y = reach * (u.1.abs() + v.1.abs()) + 1.0;
    let (x, y) = (center.0 - 0.5, center.1 - 0.5);
    let inside = x > extent_x
        && y > extent_y
        && x + extent_x < (photo.width - 1) as f32
        && y + extent_y < (photo.height - 1) as f32;
    if !inside {
        return None;
    }
    let mut samples = [0.0; SAMPLES];
    for (k, value) in samples.iter_mut().enumerate() {
        let s = ((k % SIDE) as f32 - (SIDE / 2) as f32) * SPACING;
        let t = ((k / SIDE) as f32 - (SIDE / 2) as f32) * SPACING;
        let (px, py) = (x + s * u.0 + t * v.0, y + s * u.1 + t * v.1);
        let (i, j) = (px as usize, py as usize);
        let (a, b) = (px - i as f32, py - j as f32);
        let at = j * photo.width + i;
        let top = photo.luma[at] * (1.0 - a) + photo.luma[at + 1] * a;
        let bottom =
            photo.luma[at + photo.width] * (1.0 - a) + photo.luma[at + photo.width + 1] * a;
        *value = top * (1.0 - b) + bottom * b;
    }
    Patch::normalized(samples)
}

/// Mean of the two best correlations over the neighbors: one neighbor alone may be fooled, and
/// in some the pixel is hidden.
fn correlation(
    photos: &[Photo],
    pairs: &[Pair],
    reference: &Patch,
    (x, y): (f32, f32),
    inverse_depth: f32,
) -> f32 {
    let mut best = [-1.0f32; 2];
    for pair in pairs {
        let Some(center) = pair.transfer(x, y, inverse_depth) else { continue };
        let (Some(right), Some(below)) =
            (pair.transfer(x + 1.0, y, inverse_depth), pair.transfer(x, y + 1.0, inverse_depth))
        else {
            continue;
        };
        let u = (right.0 - center.0, right.1 - center.1);
        let v = (below.0 - center.0, below.1 - center.1);
        let Some(patch) = sample(&photos[pair.other], center, u, v) else { continue };
        let value: f32 = reference.0.iter().zip(&patch.0).map(|(a, b)| a * b).sum();
        if value > best[0] {
            best = [value, best[0]];
        } else if value > best[1] {
            best[1] = value;
        }
    }
    if best[1] > -1.0 || pairs.len() > 1 { 0.5 * (best[0] + best[1]) } else { best[0] }
}

/// Matches of the grid pixels of photo `i`, row by row.
pub(super) fn search_photo(
    photos: &[Photo],
    i: usize,
    pairs: &[Pair],
    step: usize,
) -> Vec<Option<Match>> {
    let photo = &photos[i];
    let mut matches = Vec::new();
    for y in (0..photo.height).step_by(step) {
        for x in (0..photo.width).step_by(step) {
            let at = (x as f32 + 0.5, y as f32 + 0.5);
            let reference = sample(photo, at, (1.0, 0.0), (0.0, 1.0));
            matches
                .push(reference.and_then(|patch| search_pixel(photos, photo, pairs, &patch, at)));
        }
    }
    matches
}

fn search_pixel(
    photos: &[Photo],
    photo: &Photo,
    pairs: &[Pair],
    patch: &Patch,
    at: (f32, f32),
) -> Option<Match> {
    let (count, seeds) = photo.nearest_depths::<SEEDS>(at.0, at.1);
    let mut best = Match { inverse_depth: 0.0, correlation: -1.0 };
    let try_depth = |inverse_depth: f32, best: &mut Match| {
        let correlation = correlation(photos, pairs, patch, at, inverse_depth);
        if correlation > best.correlation {
            *best = Match { inverse_depth, correlation };
        }
    };
    for seed in &seeds[..count] {
        for step in STEPS {
            try_depth(seed * (1.0 + step), &mut best);
        }
    }
    if !(best.correlation > 0.4) {
        return None;
    }
    // Halve the step around the best until it is a tenth of a percent.
    let mut step = 0.0125;
    for _ in 0..5 {
        let center = best.inverse_depth;
        try_depth(center * (1.0 - step), &mut best);
        try_depth(center * (1.0 + step), &mut best);
        step *= 0.5;
    }
    (best.correlation > ACCEPT).then_some(best)
}
