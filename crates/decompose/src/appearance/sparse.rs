//! Shading integrated at few pixels, and interpolated between them where it is smooth.
//!
//! The picture is cut into cells. Where the four corners of a cell agree within the tolerance and their noise, and all pixels in it
//! show one piece of the surface, the rest of the cell is bilinear; elsewhere it is cut into four, down to single pixels (adaptive
//! sampling of the image plane, Whitted 1980; interpolated irradiance, Ward et al. 1988).

use glam::Vec3;
use rayon::prelude::*;

/// Corners may differ by so many standard deviations of their noise beyond the tolerance.
const DEVIATIONS: f32 = 2.0;

/// The shading of a pixel: radiance is `b slope + offset`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Shade {
    pub slope: Vec3,
    pub offset: Vec3,
    /// Luminance of a gray pixel.
    pub gray: f32,
    /// Variance of it.
    pub variance: f32,
}

impl Shade {
    fn mix(corners: &[(Self, f32); 4]) -> Self {
        let mut out = Self::default();
        for (corner, weight) in corners {
            out.slope += corner.slope * *weight;
            out.offset += corner.offset * *weight;
        }
        out
    }
}

/// Edge of the first cells in pixels, and by how much of their brightness corners may be off their mean.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spacing {
    pub pixels: usize,
    pub tolerance: f32,
}

/// Pixels of a rectangle, borders included: `[x0, y0, x1, y1]`.
#[derive(Clone, Copy)]
struct Cell([usize; 4]);

impl Cell {
    fn corners(self, width: usize) -> [usize; 4] {
        let Self([x0, y0, x1, y1]) = self;
        [y0 * width + x0, y0 * width + x1, y1 * width + x0, y1 * width + x1]
    }

    /// All pixels with their bilinear weights of the corners.
    fn pixels(self, width: usize) -> impl Iterator<Item = (usize, [f32; 4])> {
        let Self([x0, y0, x1, y1]) = self;
        (y0..=y1).flat_map(move |y| {
            (x0..=x1).map(move |x| {
                let s = (x - x0) as f32 / (x1 - x0).max(1) as f32;
                let t = (y - y0) as f32 / (y1 - y0).max(1) as f32;
                let weights = [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t];
                (y * width + x, weights)
            })
        })
    }

    fn is_single(self) -> bool {
        let Self([x0, y0, x1, y1]) = self;
        x1 - x0 <= 1 && y1 - y0 <= 1
    }

    fn quarters(self) -> impl Iterator<Item = Self> {
        let Self([x0, y0, x1, y1]) = self;
        let halves = |a: usize, b: usize| {
            let middle = a.midpoint(b);
            if b - a > 1 { vec![[a, middle], [middle, b]] } else { vec![[a, b]] }
        };
        let (columns, rows) = (halves(x0, x1), halves(y0, y1));
        rows.into_iter().flat_map(move |[t, b]| {
            columns.clone().into_iter().map(move |[l, r]| Self([l, t, r, b]))
        })
    }
}

fn first_cells([width, height]: [usize; 2], spacing: usize) -> Vec<Cell> {
    let lines = |size: usize| -> Vec<[usize; 2]> {
        let last = size - 1;
        let starts = (0..last.max(1)).step_by(spacing);
        starts.map(|a| [a, (a + spacing).min(last)]).collect()
    };
    let columns = lines(width);
    lines(height)
        .into_iter()
        .flat_map(|[t, b]| columns.iter().map(move |[l, r]| Cell([*l, t, *r, b])))
        .collect()
}

/// The shading of all pixels. `shade` integrates one; `is_between` says whether a pixel shows the piece of surface that the four
/// corners show, at these weights.
pub(super) fn shades(
    size: [usize; 2],
    spacing: Spacing,
    shade: impl Fn(usize) -> Shade + Sync + Send,
    is_between: impl Fn(usize, &[(usize, f32); 4]) -> bool + Sync,
) -> Vec<Shade> {
    let [width, height] = size;
    if spacing.pixels <= 1 || width == 0 || height == 0 {
        return (0..width * height).into_par_iter().with_min_len(64).map(shade).collect();
    }
    let mut out = vec![Shade::default(); width * height];
    let (mut is_integrated, mut is_known) = (vec![false; out.len()], vec![false; out.len()]);
    let mut cells = first_cells(size, spacing.pixels);
    while !cells.is_empty() {
        let mut asked: Vec<usize> = cells.iter().flat_map(|c| c.corners(width)).collect();
        asked.retain(|&i| !is_integrated[i]);
        asked.sort_unstable();
        asked.dedup();
        let found: Vec<Shade> = asked.par_iter().with_min_len(16).map(|&i| shade(i)).collect();
        for (&i, found) in asked.iter().zip(found) {
            (out[i], is_integrated[i], is_known[i]) = (found, true, true);
        }
        let smooth: Vec<bool> = cells
            .par_iter()
            .with_min_len(64)
            .map(|cell| {
                let corners = cell.corners(width);
                agree(corners.map(|i| out[i]), spacing.tolerance)
                    && cell.pixels(width).all(|(i, weights)| {
                        let weighted = std::array::from_fn(|k| (corners[k], weights[k]));
                        is_between(i, &weighted)
                    })
            })
            .collect();
        let mut rest = Vec::new();
        for (cell, smooth) in cells.into_iter().zip(smooth) {
            if cell.is_single() {
                continue;
            }
            if !smooth {
                rest.extend(cell.quarters());
                continue;
            }
            let corners = cell.corners(width).map(|i| out[i]);
            for (i, weights) in cell.pixels(width) {
                if !is_known[i] {
                    out[i] = Shade::mix(&std::array::from_fn(|k| (corners[k], weights[k])));
                    is_known[i] = true;
                }
            }
        }
        cells = rest;
    }
    out
}

/// Whether the corners of a cell differ by no more than the tolerance and their noise explain.
fn agree(corners: [Shade; 4], tolerance: f32) -> bool {
    let gray = corners.map(|c| c.gray);
    let (low, high) = gray.iter().fold((f32::INFINITY, 0.0f32), |(l, h), g| (l.min(*g), h.max(*g)));
    let mean = gray.iter().sum::<f32>() / 4.0;
    let noise = corners.iter().fold(0.0f32, |most, c| most.max(c.variance)).sqrt();
    high - low <= 2.0 * tolerance * mean + DEVIATIONS * noise
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    const SIZE: [usize; 2] = [53, 38];

    fn shade_of(gray: f32) -> Shade {
        Shade { slope: Vec3::splat(gray), offset: Vec3::splat(0.1 * gray), gray, variance: 0.0 }
    }

    fn with(spacing: usize, of: impl Fn(usize) -> f32 + Sync) -> (Vec<Shade>, usize) {
        let count = AtomicUsize::new(0);
        let shade = |i: usize| {
            count.fetch_add(1, Ordering::Relaxed);
            shade_of(of(i))
        };
        let spacing = Spacing { pixels: spacing, tolerance: 0.05 };
        let found = shades(SIZE, spacing, shade, |_, _| true);
        (found, count.into_inner())
    }

    #[test]
    fn what_is_linear_is_exact_and_costs_little() {
        let of = |i: usize| 1.0 + 5e-4 * (i % SIZE[0]) as f32 + 1e-3 * (i / SIZE[0]) as f32;
        for spacing in [1, 2, 3, 4, 8, 100] {
            let (found, count) = with(spacing, of);
            for (i, shade) in found.iter().enumerate() {
                assert!((shade.slope.x - of(i)).abs() < 1e-5, "{spacing}: {i} {shade:?}");
                assert!((shade.offset.y - 0.1 * of(i)).abs() < 1e-5);
            }
            let least = (SIZE[0].div_ceil(spacing) + 1) * (SIZE[1].div_ceil(spacing) + 1);
            assert!(count <= least.min(SIZE[0] * SIZE[1]), "{spacing}: {count} of {least}");
        }
    }

    #[test]
    fn an_edge_stays_sharp() {
        let of = |i: usize| if 2 * (i % SIZE[0]) > i / SIZE[0] + 20 { 1.0 } else { 0.2 };
        let (found, count) = with(4, of);
        assert!(found.iter().enumerate().all(|(i, s)| (s.slope.x - of(i)).abs() < 1e-6));
        assert!(count < SIZE[0] * SIZE[1] / 3, "{count}");
    }

    #[test]
    fn pixels_of_another_piece_are_integrated() {
        let island = 17 * SIZE[0] + 22;
        let shade = |i: usize| shade_of(if i == island { 5.0 } else { 1.0 });
        let spacing = Spacing { pixels: 8, tolerance: 0.05 };
        let found = shades(SIZE, spacing, shade, |i, _| i != island);
        assert!(found.iter().enumerate().all(|(i, s)| *s == shade(i) || i != island));
        assert_eq!(found[island].slope.x, 5.0);
    }

    #[test]
    fn pictures_of_any_size_are_filled() {
        for size in [[0, 0], [1, 1], [1, 7], [9, 1], [2, 2], [5, 4]] {
            let spacing = Spacing { pixels: 4, tolerance: 0.1 };
            let found = shades(size, spacing, |_| shade_of(2.0), |_, _| true);
            assert_eq!(found.len(), size[0] * size[1]);
            assert!(found.iter().all(|s| (s.slope.x - 2.0).abs() < 1e-6), "{size:?}");
        }
    }
}
