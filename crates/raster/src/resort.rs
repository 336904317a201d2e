//! Compositing with an order per pixel, for rendering.
//!
//! A Gaussian's depth differs from ray to ray, so one order for the image lets colors pop when
//! the camera turns. Radl et al. 2024, "StopThePop", keep a small window per pixel: what arrives
//! in nearly sorted order goes into the window, and the nearest of it leaves for compositing once
//! the window is full. Lists are sorted by the depth on the ray of the tile's center, so the
//! window only has to mend the rest.

use crate::forward::PairCount;
use crate::options::TILE;
use crate::strip::Strip;

/// Gaussians that wait per pixel.
const WINDOW: usize = 24;

/// What waits in the window of a pixel.
#[derive(Clone, Copy)]
struct Waiting {
    depth: f32,
    alpha: f32,
    color: [f32; 3],
}

/// A pixel while it is composited.
struct Pixel {
    color: [f32; 3],
    transmittance: f32,
    waiting: Vec<Waiting>,
}

impl Pixel {
    /// Farthest first, so that the nearest leaves at the end; equal depths leave in the order in
    /// which they came.
    fn insert(&mut self, new: Waiting) {
        let at = self.waiting.partition_point(|w| w.depth > new.depth);
        self.waiting.insert(at, new);
    }

    /// Composites the nearest; false when the pixel is finished.
    fn pop(&mut self, transmittance_min: f32) -> bool {
        let Some(nearest) = self.waiting.pop() else {
            return false;
        };
        let weight = nearest.alpha * self.transmittance;
        for (out, c) in self.color.iter_mut().zip(nearest.color) {
            *out += weight * c;
        }
        self.transmittance -= weight;
        self.transmittance >= transmittance_min
    }
}

impl Strip<'_> {
    /// As [`Self::forward`], each pixel in its own order.
    pub(crate) fn forward_resorted(&self, rows: &mut [f32]) -> PairCount {
        let parameters = &self.options.parameters;
        let (plane, degree) = (TILE * self.stride, usize::from(parameters.exp_degree));
        let mut pairs = PairCount::default();
        let mut waiting = Vec::with_capacity(WINDOW + 1);
        for p in 0..plane {
            let (px, py) = (p % self.stride, self.y * TILE + p / self.stride);
            let (x, y) = (px as f32 + 0.5, py as f32 + 0.5);
            waiting.clear();
            let mut pixel = Pixel { color: [0.0; 3], transmittance: 1.0, waiting };
            let mut open = true;
            if let Some((row, entries)) = self.bins.list_at(px, py) {
                for &entry in entries {
                    let splat = &row.splats[entry as usize];
                    pairs.visited += 1;
                    let Some(alpha) = splat.alpha_at(x, y, degree) else {
                        continue;
                    };
                    pairs.composited += 1;
                    let depth = splat.depth_at(x, y);
                    pixel.insert(Waiting { depth, alpha, color: splat.color });
                    if pixel.waiting.len() > WINDOW {
                        open = pixel.pop(parameters.transmittance_min);
                        if !open {
                            break;
                        }
                    }
                }
            }
            while open {
                open = pixel.pop(parameters.transmittance_min);
            }
            for c in 0..3 {
                rows[c * plane + p] =
                    pixel.color[c] + pixel.transmittance * self.options.background[c];
            }
            rows[3 * plane + p] = pixel.transmittance;
            waiting = pixel.waiting;
        }
        pairs
    }
}
