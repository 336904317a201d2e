//! The outline of a ball, found in a picture.
//!
//! A Hough transform for circles: edges vote along their gradient, on both sides, for centers at every radius (Duda & Hart 1972; Kimme,
//! Ballard & Sklansky 1975). The votes of a circle are divided by its circumference, so that large and small ones compare. The best one is
//! then moved to where the gradient across it, mean over the circle, is largest.

use motes_scene::ImageF32;

use super::Outline;

/// Longer side of the picture that votes, pixels.
const SIDE: usize = 320;
/// Radii in shares of the shorter side.
const RADII: (f64, f64) = (0.12, 0.5);
/// Share of the circumference that has to be an edge.
const LEAST_SHARE: f64 = 0.25;
/// Share of the best that a larger circle needs to be preferred.
const NEARLY: f64 = 0.6;
/// Points of the outline that are looked at.
const POINTS: usize = 256;

/// The outline of the ball that fills most of a picture (any encoding); `None` where no circle stands out.
pub fn find_ball(picture: &ImageF32) -> Option<Outline> {
    let factor = picture.width.max(picture.height).div_ceil(SIDE).max(1);
    let gray = Gray::of(picture, factor);
    let coarse = hough(&gray)?;
    let full = Gray::of(picture, 1);
    let scale = factor as f64;
    let first = Outline { center: coarse.center.map(|v| v * scale), radius: coarse.radius * scale };
    Some(refined(&full, first, scale))
}

/// Log luminance: an edge is a ratio.
struct Gray {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl Gray {
    fn of(picture: &ImageF32, factor: usize) -> Self {
        let (width, height) = (picture.width / factor, picture.height / factor);
        let value = |x: usize, y: usize| {
            let block = (0..factor * factor).map(|k| {
                let p = picture.pixel(x * factor + k % factor, y * factor + k / factor);
                p.iter().take(3).map(|v| v.clamp(0.0, 1.0)).sum::<f32>() / 3.0
            });
            (block.sum::<f32>() / (factor * factor) as f32 + 0.02).ln()
        };
        let values = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Self { width, height, values: values.map(|(x, y)| value(x, y)).collect() }
    }

    /// Binomial, 5 x 5: directions of edges are those of the outline, not of its steps.
    fn smooth(&self) -> Self {
        let (w, h) = (self.width, self.height);
        let taps = [1.0, 4.0, 6.0, 4.0, 1.0f32];
        let pass = |values: &[f32], down: bool| -> Vec<f32> {
            let mean = |i: usize| {
                let (x, y) = (i % w, i / w);
                let (at, n) = if down { (y, h) } else { (x, w) };
                let tap = |(k, t): (usize, &f32)| {
                    let to = (at + k).saturating_sub(2).min(n - 1);
                    t / 16.0 * if down { values[to * w + x] } else { values[y * w + to] }
                };
                taps.iter().enumerate().map(tap).sum()
            };
            (0..w * h).map(mean).collect()
        };
        Self { width: w, height: h, values: pass(&pass(&self.values, false), true) }
    }

    fn at(&self, x: f64, y: f64) -> f64 {
        let clamp = |v: f64, n: usize| (v - 0.5).clamp(0.0, n as f64 - 1.001).max(0.0);
        let (x, y) = (clamp(x, self.width), clamp(y, self.height));
        let (x0, y0) = (x as usize, y as usize);
        let (s, t) = (x - x0 as f64, y - y0 as f64);
        let value = |x: usize, y: usize| {
            f64::from(self.values[y.min(self.height - 1) * self.width + x.min(self.width - 1)])
        };
        (value(x0, y0) * (1.0 - s) + value(x0 + 1, y0) * s) * (1.0 - t)
            + (value(x0, y0 + 1) * (1.0 - s) + value(x0 + 1, y0 + 1) * s) * t
    }
}

fn hough(gray: &Gray) -> Option<Outline> {
    let (w, h) = (gray.width, gray.height);
    if w < 16 || h < 16 {
        return None;
    }
    let gray = gray.smooth();
    let at = |x: usize, y: usize| gray.values[y * w + x];
    let mut edges: Vec<(f64, f64, f64, f64, f64)> = Vec::new();
    for y in 1..h - 1 {
        for x in 1..w - 1 {
            let gx = f64::from(at(x + 1, y) - at(x - 1, y));
            let gy = f64::from(at(x, y + 1) - at(x, y - 1));
            edges.push((x as f64 + 0.5, y as f64 + 0.5, gx, gy, gx.hypot(gy)));
        }
    }
    let mut strengths: Vec<f32> = edges.iter().map(|e| e.4 as f32).collect();
    let strong = f64::from(motes_math::median::quantile(&mut strengths, 0.9)?.max(0.02));
    let strength = |x: f64, y: f64| {
        let (i, k) = (x as usize, y as usize);
        let inside = (1..w - 1).contains(&i) && (1..h - 1).contains(&k);
        if inside { edges[(k - 1) * (w - 2) + i - 1].4 } else { 0.0 }
    };
    // Ridges only: a soft slope would vote for circles of many radii.
    let is_ridge = |e: &&(f64, f64, f64, f64, f64)| {
        let (dx, dy) = (e.2 / e.4, e.3 / e.4);
        e.4 >= strong && e.4 >= strength(e.0 + dx, e.1 + dy) && e.4 >= strength(e.0 - dx, e.1 - dy)
    };
    let edges: Vec<_> = edges.iter().filter(is_ridge).copied().collect();
    let short = w.min(h) as f64;
    let (first, last) = ((RADII.0 * short) as usize, (RADII.1 * short) as usize);
    let mut of_radius = Vec::new();
    for r in first..=last {
        let mut best = (0.0, None);
        let mut votes = vec![0.0f32; w * h];
        for (x, y, gx, gy, g) in &edges {
            for side in [-1.0, 1.0] {
                let (cx, cy) = (x + side * gx / g * r as f64, y + side * gy / g * r as f64);
                let inside = (0.0..w as f64).contains(&cx) && (0.0..h as f64).contains(&cy);
                if inside {
                    votes[cy as usize * w + cx as usize] += 1.0;
                }
            }
        }
        for y in 2..h - 2 {
            for x in 2..w - 2 {
                // Directions are off by a few degrees: a rim of one pixel lands in some 25 cells.
                let sum: f32 = (0..25).map(|k| votes[(y + k / 5 - 2) * w + x + k % 5 - 2]).sum();
                let share = f64::from(sum) / (std::f64::consts::TAU * r as f64);
                if share > best.0 {
                    let center = [x as f64 + 0.5, y as f64 + 0.5];
                    best = (share, Some(Outline { center, radius: r as f64 }));
                }
            }
        }
        of_radius.push(best);
    }
    // Round highlights on the ball are circles, too: the largest of nearly the best.
    let top = of_radius.iter().map(|b| b.0).fold(0.0, f64::max);
    let last = of_radius.into_iter().rev().find(|b| b.0 >= NEARLY * top)?;
    last.1.filter(|_| last.0 > LEAST_SHARE)
}

/// Mean over the circle of the step of log luminance across it.
fn contrast(gray: &Gray, outline: &Outline, reach: f64) -> f64 {
    let step = |k: usize| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / POINTS as f64).sin_cos();
        let at = |r: f64| gray.at(outline.center[0] + r * cos, outline.center[1] + r * sin);
        // A rim that differs strongly in a few places must not outweigh one that differs everywhere.
        (at(outline.radius + reach) - at(outline.radius - reach)).abs().min(0.5)
    };
    (0..POINTS).map(step).sum::<f64>() / POINTS as f64
}

fn refined(gray: &Gray, first: Outline, scale: f64) -> Outline {
    let mut best = first;
    let mut step = scale;
    while step > 0.1 {
        let reach = step.max(0.7);
        let mut score = contrast(gray, &best, reach);
        for _ in 0..8 {
            let before = best;
            for k in 0..6 {
                let mut other = best;
                let sign = if k % 2 == 0 { step } else { -step };
                match k / 2 {
                    2 => other.radius += sign,
                    axis => other.center[axis] += sign,
                }
                let its = contrast(gray, &other, reach);
                if its > score && other.radius > 1.0 {
                    (best, score) = (other, its);
                }
            }
            if best == before {
                break;
            }
        }
        step *= 0.5;
    }
    best
}
