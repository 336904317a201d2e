//! One size of a depth map, and its equations.

/// Difference of brightness (sRGB-encoded) at which smoothness counts half, and what is left of it at edges.
const EDGE: f32 = 0.03;
const LEAST_EDGE: f32 = 0.02;

/// Values per pixel, `[height, width]`.
pub(super) struct Grid {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Inverse depth of the Gaussians, voxels from the middle.
    pub(super) data: Vec<f32>,
    /// 0 where there is none.
    pub(super) weight: Vec<f32>,
    /// Brightness, sRGB-encoded.
    pub(super) luma: Vec<f32>,
}

/// A second difference: four pixels with coefficients.
struct Difference {
    at: [u32; 4],
    times: [f32; 4],
    weight: f32,
}

/// The equations of one solve.
pub(super) struct System<'a> {
    grid: &'a Grid,
    weight: Vec<f32>,
    differences: Vec<Difference>,
}

impl Grid {
    /// Means of two by two pixels of a picture `[height, width]`; values count by their weight.
    pub(super) fn halved(
        width: usize,
        height: usize,
        of: impl Fn(usize) -> ((f32, f32), f32),
    ) -> Self {
        let (w, h) = (width.div_ceil(2), height.div_ceil(2));
        let mut grid = Self {
            width: w,
            height: h,
            data: Vec::with_capacity(w * h),
            weight: Vec::with_capacity(w * h),
            luma: Vec::with_capacity(w * h),
        };
        for y in 0..h {
            for x in 0..w {
                let (mut sum, mut weights, mut luma, mut count) = (0.0, 0.0, 0.0, 0.0);
                for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (i, j) = (2 * x + i, 2 * y + j);
                    if i < width && j < height {
                        let ((value, weight), l) = of(j * width + i);
                        sum += value * weight;
                        weights += weight;
                        luma += l;
                        count += 1.0;
                    }
                }
                grid.data.push(if weights > 0.0 { sum / weights } else { 0.0 });
                grid.weight.push(weights / count);
                grid.luma.push(luma / count);
            }
        }
        grid
    }

    /// Value between the centers of pixels that have one; `None` where none of the four has.
    pub(super) fn between(&self, values: &[f32], [x, y]: [f32; 2]) -> Option<f32> {
        let at = |v: f32, most: usize| {
            let v = v.clamp(0.0, (most - 1) as f32);
            let low = (v as usize).min(most.saturating_sub(2));
            (low, (low + 1).min(most - 1), v - low as f32)
        };
        let (x0, x1, u) = at(x, self.width);
        let (y0, y1, v) = at(y, self.height);
        let four = [
            (y0 * self.width + x0, (1.0 - u) * (1.0 - v)),
            (y0 * self.width + x1, u * (1.0 - v)),
            (y1 * self.width + x0, (1.0 - u) * v),
            (y1 * self.width + x1, u * v),
        ];
        let known = four.iter().filter(|(k, _)| self.weight[*k] > 0.0);
        // A little of each, so that a pixel that lies on one without a value takes the others'.
        let (sum, weight) = known.fold((0.0, 0.0), |(s, n), &(k, share)| {
            (s + values[k] * (share + 1e-4), n + share + 1e-4)
        });
        (weight > 0.0).then(|| sum / weight)
    }

    /// Values of a grid of half the size, on this one.
    pub(super) fn enlarged(&self, coarser: &Self, values: &[f32]) -> Vec<f32> {
        let of = |k: usize| {
            let at = [k % self.width, k / self.width].map(|v| (v as f32 + 0.5) * 0.5 - 0.5);
            coarser.between(values, at).unwrap_or(self.data[k])
        };
        (0..self.data.len()).map(of).collect()
    }

    /// The quadratic cost that touches the robust one at `u`. A deviation from the data, and a second difference, count a
    /// quarter where they are as large as `widths`.
    pub(super) fn weighted(
        &self,
        u: &[f32],
        smoothness: f32,
        [outlier, bend_width]: [f32; 2],
    ) -> System<'_> {
        let robust = |d: f32, width: f32| (1.0 + (d / width).powi(2)).powi(-2);
        let data = self.data.iter().zip(u).zip(&self.weight);
        let weight = data.map(|((d, u), w)| w * robust(d - u, outlier)).collect();
        let mut differences = Vec::with_capacity(3 * u.len());
        let mut add = |at: [usize; 4], times: [f32; 4], factor: f32| {
            if at.iter().any(|&k| !(self.weight[k] > 0.0)) {
                return;
            }
            let bend: f32 = at.iter().zip(times).map(|(&k, t)| t * u[k]).sum();
            let luma = at.map(|k| self.luma[k]);
            let (low, high) =
                luma.iter().fold((f32::MAX, f32::MIN), |(l, h), &v| (l.min(v), h.max(v)));
            let edge = (1.0 + ((high - low) / EDGE).powi(2)).recip().max(LEAST_EDGE);
            let weight = factor * smoothness * edge * robust(bend, bend_width);
            differences.push(Difference { at: at.map(|k| k as u32), times, weight });
        };
        let w = self.width;
        for y in 0..self.height {
            for x in 0..w {
                let k = y * w + x;
                if x > 0 && x + 1 < w {
                    add([k - 1, k, k + 1, k], [1.0, -1.0, 1.0, -1.0], 1.0);
                }
                if y > 0 && y + 1 < self.height {
                    add([k - w, k, k + w, k], [1.0, -1.0, 1.0, -1.0], 1.0);
                }
                if x + 1 < w && y + 1 < self.height {
                    add([k, k + 1, k + w, k + w + 1], [1.0, -1.0, -1.0, 1.0], 2.0);
                }
            }
        }
        System { grid: self, weight, differences }
    }
}

impl System<'_> {
    /// The right side.
    pub(super) fn right(&self) -> impl Iterator<Item = f32> + '_ {
        self.weight.iter().zip(&self.grid.data).map(|(w, d)| w * d)
    }

    /// The matrix times `u`.
    pub(super) fn product(&self, u: &[f32]) -> Vec<f32> {
        let mut out: Vec<f32> = self.weight.iter().zip(u).map(|(w, u)| w * u).collect();
        for d in &self.differences {
            let at = d.at.map(|k| k as usize);
            let bend: f32 = at.iter().zip(d.times).map(|(&k, t)| t * u[k]).sum();
            for (k, t) in at.into_iter().zip(d.times) {
                out[k] += d.weight * bend * t;
            }
        }
        out
    }
}
