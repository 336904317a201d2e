//! Superpixels on color, depth and normal.
//!
//! SLIC (Achanta et al. 2012): k-means in a window around each center, then connected pieces. To color
//! and position come depth, in units of what a superpixel spans, and the normal, so that edges of
//! surfaces are edges of superpixels where colors agree.

/// What the clustering sees of a view; `[h, w]` each.
pub(crate) struct Pixels<'a> {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// CIE L*a*b*.
    pub(crate) lab: &'a [[f32; 3]],
    /// Camera z, world units; 0 where nothing is.
    pub(crate) depth: &'a [f32],
    /// Unit, any frame; 0 where unknown.
    pub(crate) normal: &'a [[f32; 3]],
    /// Pixels.
    pub(crate) focal: f32,
}

/// Rounds of k-means; Achanta et al. use 10.
const ROUNDS: usize = 8;
/// Color difference that weighs as much as one side of a superpixel.
const COLOR_UNIT: f32 = 12.0;
/// Weights and bounds of the terms; a bound keeps one noisy pixel from tearing a superpixel.
const POSITION_WEIGHT: f32 = 0.7;
const DEPTH_WEIGHT: f32 = 0.3;
const DEPTH_BOUND: f32 = 6.0;
const NORMAL_WEIGHT: f32 = 3.0;

#[derive(Clone, Copy, Default)]
struct Center {
    at: [f32; 2],
    lab: [f32; 3],
    depth: f32,
    normal: [f32; 3],
}

/// Superpixels of about `size` x `size` pixels: a label per pixel, and their number.
pub(crate) fn superpixels(pixels: &Pixels<'_>, size: usize) -> (Vec<u32>, usize) {
    let (w, h) = (pixels.width, pixels.height);
    let (columns, rows) = ((w / size).max(1), (h / size).max(1));
    let mut centers: Vec<Center> = (0..columns * rows)
        .map(|i| {
            let x = ((i % columns) as f32 + 0.5) * w as f32 / columns as f32;
            let y = ((i / columns) as f32 + 0.5) * h as f32 / rows as f32;
            let p = y as usize * w + x as usize;
            Center {
                at: [x, y],
                lab: pixels.lab[p],
                depth: pixels.depth[p],
                normal: pixels.normal[p],
            }
        })
        .collect();
    let mut labels = vec![0u32; w * h];
    let mut costs = vec![f32::INFINITY; w * h];
    for _ in 0..ROUNDS {
        costs.fill(f32::INFINITY);
        for (label, center) in centers.iter().enumerate() {
            let low = |v: f32| (v - size as f32 * 1.5).max(0.0) as usize;
            let high = |v: f32, end: usize| ((v + size as f32 * 1.5) as usize + 1).min(end);
            for y in low(center.at[1])..high(center.at[1], h) {
                for x in low(center.at[0])..high(center.at[0], w) {
                    let p = y * w + x;
                    let cost = cost(pixels, center, p, [x as f32 + 0.5, y as f32 + 0.5], size);
                    if cost < costs[p] {
                        costs[p] = cost;
                        labels[p] = label as u32;
                    }
                }
            }
        }
        move_centers(pixels, &labels, &mut centers);
    }
    connected(&labels, w, h, size * size / 4)
}

#[inline]
fn cost(pixels: &Pixels<'_>, center: &Center, p: usize, at: [f32; 2], size: usize) -> f32 {
    let squared =
        |a: &[f32], b: &[f32]| -> f32 { a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum() };
    let side = size as f32;
    let color = squared(&pixels.lab[p], &center.lab) / (COLOR_UNIT * COLOR_UNIT);
    let position = squared(&at, &center.at) / (side * side);
    let (z, z0) = (pixels.depth[p], center.depth);
    let span = side * z.max(z0) / pixels.focal;
    let depth = match (z > 0.0, z0 > 0.0) {
        (true, true) => (DEPTH_WEIGHT * ((z - z0) / span).powi(2)).min(DEPTH_BOUND),
        (false, false) => 0.0,
        _ => DEPTH_BOUND,
    };
    let n = (&pixels.normal[p], &center.normal);
    let aligned: f32 = n.0.iter().zip(n.1).map(|(a, b)| a * b).sum();
    let normal = NORMAL_WEIGHT * (1.0 - aligned).clamp(0.0, 1.0);
    color + POSITION_WEIGHT * position + depth + normal
}

fn move_centers(pixels: &Pixels<'_>, labels: &[u32], centers: &mut [Center]) {
    let mut sums = vec![(Center::default(), 0.0f32, 0.0f32); centers.len()];
    for (p, &label) in labels.iter().enumerate() {
        let (sum, count, deep) = &mut sums[label as usize];
        sum.at[0] += (p % pixels.width) as f32 + 0.5;
        sum.at[1] += (p / pixels.width) as f32 + 0.5;
        for k in 0..3 {
            sum.lab[k] += pixels.lab[p][k];
            sum.normal[k] += pixels.normal[p][k];
        }
        if pixels.depth[p] > 0.0 {
            sum.depth += pixels.depth[p];
            *deep += 1.0;
        }
        *count += 1.0;
    }
    for (center, (sum, count, deep)) in centers.iter_mut().zip(sums) {
        if count > 0.0 {
            let length = sum.normal.iter().map(|v| v * v).sum::<f32>().sqrt().max(1e-6);
            *center = Center {
                at: sum.at.map(|v| v / count),
                lab: sum.lab.map(|v| v / count),
                depth: if deep > 0.5 * count { sum.depth / deep } else { 0.0 },
                normal: sum.normal.map(|v| v / length),
            };
        }
    }
}

/// Connected pieces of `labels`; those below `least` pixels join the piece before them.
fn connected(labels: &[u32], w: usize, h: usize, least: usize) -> (Vec<u32>, usize) {
    const NONE: u32 = u32::MAX;
    let mut out = vec![NONE; labels.len()];
    let (mut count, mut piece) = (0u32, Vec::new());
    for start in 0..labels.len() {
        if out[start] != NONE {
            continue;
        }
        piece.clear();
        piece.push(start);
        out[start] = count;
        let mut neighbor = NONE;
        let mut next = 0;
        while next < piece.len() {
            let p = piece[next];
            next += 1;
            let (x, y) = (p % w, p / w);
            let around = [
                (x > 0).then(|| p - 1),
                (x + 1 < w).then_some(p + 1),
                (y > 0).then(|| p - w),
                (y + 1 < h).then_some(p + w),
            ];
            for q in around.into_iter().flatten() {
                if out[q] == NONE && labels[q] == labels[start] {
                    out[q] = count;
                    piece.push(q);
                } else if out[q] != NONE && out[q] != count && neighbor == NONE {
                    neighbor = out[q];
                }
            }
        }
        if piece.len() < least && neighbor != NONE {
            piece.iter().for_each(|&p| out[p] = neighbor);
        } else {
            count += 1;
        }
    }
    (out, count as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_of_depth_are_edges_of_superpixels() {
        let (w, h) = (80, 60);
        let inside = |p: usize| {
            let (x, y) = ((p % w) as f32 - 37.0, (p / w) as f32 - 29.0);
            x * x + y * y < 300.0
        };
        let lab = vec![[50.0, 0.0, 0.0]; w * h];
        let depth: Vec<f32> = (0..w * h).map(|p| if inside(p) { 2.0 } else { 3.0 }).collect();
        let normal = vec![[0.0, 0.0, -1.0]; w * h];
        let pixels =
            Pixels { width: w, height: h, lab: &lab, depth: &depth, normal: &normal, focal: 80.0 };
        let (labels, count) = superpixels(&pixels, 8);
        let mut share = vec![[0usize; 2]; count];
        for (p, &l) in labels.iter().enumerate() {
            share[l as usize][usize::from(inside(p))] += 1;
        }
        let wrong: usize = share.iter().map(|s| s[0].min(s[1])).sum();
        assert!(wrong < 30, "{wrong} of {} pixels on the wrong side", w * h);
        assert!((40..200).contains(&count), "{count}");
    }
}
