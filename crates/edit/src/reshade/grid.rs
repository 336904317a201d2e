//! Cells of a plane: which are covered, which are open, and values that go on smoothly into the open ones.

use glam::Vec3;
use motes_scene::Surface;

use super::support::Plane;
use crate::grown::grown;

/// No more cells than this; larger places get larger cells.
const MAX_CELLS: f32 = 1e6;

/// Rounds of smoothing over cells that nothing is known about.
const SMOOTHING: usize = 64;

/// Square cells over a rectangle of a plane.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub(super) plane: Plane,
    low: [f32; 2],
    pub(super) pitch: f32,
    pub(super) size: [usize; 2],
    /// Height of the ground over the plane per cell, world units; empty where it is the plane.
    pub(super) heights: Vec<f32>,
}

impl Grid {
    /// Cells of `pitch` over the feet of `points` and `margin` around, world units.
    pub(super) fn over(plane: Plane, points: &[Vec3], pitch: f32, margin: f32) -> Option<Self> {
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for p in points.iter().filter(|p| p.is_finite()) {
            let flat = plane.flat(*p);
            for k in 0..2 {
                low[k] = low[k].min(flat[k] - margin);
                high[k] = high[k].max(flat[k] + margin);
            }
        }
        let extent = [high[0] - low[0], high[1] - low[1]];
        if !(extent[0] > 0.0 && extent[1] > 0.0 && pitch > 0.0) {
            return None;
        }
        let pitch = pitch.max((extent[0] * extent[1] / MAX_CELLS).sqrt());
        let size = extent.map(|e| (e / pitch).ceil() as usize + 1);
        // A sliver can have few cells in area and too many along.
        (size[0].checked_mul(size[1])? <= 4 * MAX_CELLS as usize).then_some(Self {
            plane,
            low,
            pitch,
            size,
            heights: Vec::new(),
        })
    }

    /// The same place with every cell divided into `factor` along a side.
    pub(super) fn divided(&self, factor: usize) -> Self {
        let size = self.size.map(|n| n * factor);
        let parent = |c: usize| (c / size[0]) / factor * self.size[0] + (c % size[0]) / factor;
        let heights = if self.heights.is_empty() {
            Vec::new()
        } else {
            (0..size[0] * size[1]).map(|c| self.heights[parent(c)]).collect()
        };
        Self { plane: self.plane, low: self.low, pitch: self.pitch / factor as f32, size, heights }
    }

    pub(super) fn cells(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// The cell under coordinates of the plane.
    pub(super) fn cell(&self, flat: [f32; 2]) -> Option<usize> {
        let at = |k: usize| {
            let i = ((flat[k] - self.low[k]) / self.pitch).floor();
            (i >= 0.0 && i < self.size[k] as f32).then_some(i as usize)
        };
        Some(at(1)? * self.size[0] + at(0)?)
    }

    /// The middle of a cell, coordinates of the plane.
    pub(super) fn middle(&self, cell: usize) -> [f32; 2] {
        self.corner_at([(cell % self.size[0]) as f32 + 0.5, (cell / self.size[0]) as f32 + 0.5])
    }

    /// A place in units of cells.
    pub(super) fn corner_at(&self, at: [f32; 2]) -> [f32; 2] {
        [self.low[0] + self.pitch * at[0], self.low[1] + self.pitch * at[1]]
    }

    /// Marks the cells that a triangle is over: those whose middle is inside, and those of its corners.
    pub(super) fn mark(&self, marks: &mut [bool], triangle: [Vec3; 3]) {
        let flat = triangle.map(|p| self.plane.flat(p));
        if flat.iter().flatten().any(|v| !v.is_finite()) {
            return;
        }
        flat.iter().filter_map(|f| self.cell(*f)).for_each(|cell| marks[cell] = true);
        let range = |k: usize| {
            let (low, high) = flat
                .iter()
                .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), f| (l.min(f[k]), h.max(f[k])));
            let index = |v: f32| ((v - self.low[k]) / self.pitch).max(0.0) as usize;
            index(low)..(index(high) + 1).min(self.size[k])
        };
        for y in range(1) {
            for x in range(0) {
                let cell = y * self.size[0] + x;
                marks[cell] |= inside(flat, self.middle(cell));
            }
        }
    }

    /// Cells under triangles of vertices that stay, by the heights of their corners over the ground.
    pub(super) fn under_triangles(
        &self,
        surface: &Surface,
        stays: &impl Fn(u32) -> bool,
        is_meant: impl Fn([f32; 3]) -> bool,
    ) -> Vec<bool> {
        let mut marks = vec![false; self.cells()];
        for corners in surface.triangles.iter().filter(|t| t.iter().all(|v| stays(*v))) {
            let triangle = corners.map(|v| Vec3::from(surface.vertices[v as usize]));
            if is_meant(triangle.map(|p| self.height(p))) {
                self.mark(&mut marks, triangle);
            }
        }
        marks
    }

    /// The cells of `marks` and all cells that touch them, `rounds` times.
    pub(super) fn grown(&self, marks: &[bool], rounds: usize) -> Vec<bool> {
        grown(self.size, marks, rounds)
    }

    /// The cells of `marks` without those that touch others, `rounds` times. What is beyond the edge counts as marked.
    pub(super) fn shrunk(&self, marks: &[bool], rounds: usize) -> Vec<bool> {
        let others: Vec<bool> = marks.iter().map(|marked| !marked).collect();
        self.grown(&others, rounds).into_iter().map(|other| !other).collect()
    }

    /// The up to eight cells around one.
    pub(super) fn around(&self, cell: usize) -> impl Iterator<Item = usize> {
        self.within(cell, 1)
    }

    /// The cells of the square of `2 steps + 1` around one, without it.
    pub(super) fn within(&self, cell: usize, steps: usize) -> impl Iterator<Item = usize> {
        let [width, height] = self.size;
        let (x, y) = (cell % width, cell / width);
        let columns = x.saturating_sub(steps)..(x + steps + 1).min(width);
        (y.saturating_sub(steps)..(y + steps + 1).min(height))
            .flat_map(move |j| columns.clone().map(move |i| j * width + i))
            .filter(move |n| *n != cell)
    }
}

impl Grid {
    /// Means over the cells around, again and again, where a cell is not `known`: pushed values are
    /// blocks, a membrane has no edges.
    pub(super) fn smooth<const C: usize>(&self, values: &mut Vec<[f32; C]>, known: &[bool]) {
        for _ in 0..SMOOTHING {
            let smooth = |c: usize| {
                let (mut sum, mut count) = ([0.0f32; C], 0.0f32);
                for n in self.around(c) {
                    sum.iter_mut().zip(values[n]).for_each(|(s, v)| *s += v);
                    count += 1.0;
                }
                sum.map(|s| s / count.max(1.0))
            };
            let next = (0..values.len()).map(|c| if known[c] { values[c] } else { smooth(c) });
            *values = next.collect();
        }
    }
}

/// Sums over squares of `2 radius + 1` cells, in time that does not depend on the radius. Squares of zeros sum to zero exactly.
pub(super) fn boxed<const C: usize>(
    [width, height]: [usize; 2],
    values: &[[f32; C]],
    radius: usize,
) -> Vec<[f32; C]> {
    let along = |values: &[[f32; C]], length: usize, at: &dyn Fn(usize, usize) -> usize| {
        let mut out = vec![[0.0f32; C]; values.len()];
        let mut until = vec![[0.0f64; C]; length + 1];
        for line in 0..values.len() / length {
            for i in 0..length {
                let from = values[at(line, i)];
                until[i + 1] = std::array::from_fn(|k| until[i][k] + f64::from(from[k]));
            }
            for i in 0..length {
                let (first, end) = (i.saturating_sub(radius), (i + radius + 1).min(length));
                out[at(line, i)] =
                    std::array::from_fn(|k| (until[end][k] - until[first][k]) as f32);
            }
        }
        out
    };
    let rows = along(values, width, &|line, i| line * width + i);
    along(&rows, height, &|line, i| i * width + line)
}

fn inside([a, b, c]: [[f32; 2]; 3], p: [f32; 2]) -> bool {
    let side =
        |a: [f32; 2], b: [f32; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    let (s, t, u) = (side(a, b), side(b, c), side(c, a));
    (s >= 0.0 && t >= 0.0 && u >= 0.0) || (s <= 0.0 && t <= 0.0 && u <= 0.0)
}

/// Values of cells where `weight` is above 0, continued into all others: pull to coarser and coarser
/// means, push back where nothing is known (Gortler et al. 1996, The Lumigraph).
///
/// `values` is `[cells, C]`, already times `weight`; returns means.
pub(super) fn pull_push<const C: usize>(
    size: [usize; 2],
    mut values: Vec<[f32; C]>,
    mut weight: Vec<f32>,
) -> Vec<[f32; C]> {
    if size[0] > 1 || size[1] > 1 {
        let half = size.map(|n| n.div_ceil(2));
        let mut coarse = vec![[0.0f32; C]; half[0] * half[1]];
        let mut coarse_weight = vec![0.0f32; half[0] * half[1]];
        let parent = |cell: usize| (cell / size[0]) / 2 * half[0] + (cell % size[0]) / 2;
        for cell in 0..values.len() {
            let to = parent(cell);
            coarse_weight[to] += weight[cell];
            (0..C).for_each(|k| coarse[to][k] += values[cell][k]);
        }
        // What one cell knows well enough is not blended: weights saturate on the way up.
        for (v, w) in coarse.iter_mut().zip(&mut coarse_weight) {
            if *w > 1.0 {
                v.iter_mut().for_each(|v| *v /= *w);
                *w = 1.0;
            }
        }
        let coarse = pull_push(half, coarse, coarse_weight);
        for cell in 0..values.len() {
            let missing = (1.0 - weight[cell]).max(0.0);
            let from = &coarse[parent(cell)];
            (0..C).for_each(|k| values[cell][k] += missing * from[k]);
            weight[cell] += missing;
        }
    }
    for (v, w) in values.iter_mut().zip(&weight) {
        if *w > 0.0 {
            v.iter_mut().for_each(|v| *v /= *w);
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_cells_keep_their_values_and_others_lie_between() {
        let size = [9, 6];
        let known = |c: usize| c.is_multiple_of(9) || c % 9 == 8;
        let value = |c: usize| if c.is_multiple_of(9) { 1.0 } else { 3.0 };
        let weight: Vec<f32> = (0..54).map(|c| f32::from(u8::from(known(c)))).collect();
        let values = (0..54).map(|c| [weight[c] * value(c)]).collect();
        let filled = pull_push(size, values, weight);
        for (c, [v]) in filled.into_iter().enumerate() {
            assert!(if known(c) { v == value(c) } else { (1.0..=3.0).contains(&v) }, "{c}: {v}");
        }
        assert_eq!(pull_push([1, 1], vec![[0.0]], vec![0.0]), [[0.0]], "nothing is known");
    }
}
