//! Ground that is not a plane: heights over one.
//!
//! Where no plane holds the surface around an object closely, a looser one is taken as reference and the heights of the surface over
//! it are averaged per cell, continued under the object as a membrane, and smoothed: a height field, of which a plane is the case
//! without heights. Steep and far surface, that of other objects, has no say.

use glam::Vec3;
use motes_math::median::{median, quantile};
use relight::Probe;

use super::grid::{Grid, boxed, pull_push};

/// The reference plane is looked for within these shares of the object's size, as few as find one.
pub(super) const LOOSE: [f32; 3] = [0.03, 0.06, 0.12];
/// Steeper surface does not count as ground: 37 degrees.
pub(super) const LEVEL: f32 = 0.8;
/// Heights are means over squares of `2 SMOOTH + 1` cells, twice.
const SMOOTH: usize = 3;
/// This share of the level surface near the plane lies within the tolerance of a height field.
const HELD_SHARE: f32 = 0.7;
/// Points so many times farther off than usual belong to something else.
const OUTLIER: f32 = 4.0;
/// Fewer points do not make a field.
const LEAST_POINTS: usize = 64;

/// A point of a surface and the normal of its triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Oriented {
    pub(super) point: Vec3,
    pub(super) normal: Vec3,
}

/// Gives the grid the heights of `around` over its plane, within `reach` of it and not in the cells `under` an object. Returns
/// the first of `tolerances` that holds most of them; none when none does.
pub(super) fn raise(
    grid: &mut Grid,
    around: &[Oriented],
    under: &[bool],
    reach: f32,
    tolerances: impl Iterator<Item = f32>,
) -> Option<f32> {
    let normal = grid.plane.normal;
    let places: Vec<(usize, f32, Vec3)> = around
        .iter()
        .filter(|o| o.normal.dot(normal) >= LEVEL)
        .filter_map(|o| {
            let height = grid.plane.height(o.point);
            let cell = grid.cell(grid.plane.flat(o.point))?;
            (height.abs() <= reach && !under[cell]).then_some((cell, height, o.point))
        })
        .collect();
    if places.len() < LEAST_POINTS {
        return None;
    }
    fit(grid, &places);
    let mut off: Vec<f32> = places.iter().map(|(.., p)| grid.height(*p).abs()).collect();
    let usual = median(off.iter().map(|v| f64::from(*v)))? as f32;
    let mut near = off.iter().map(|v| *v <= OUTLIER * usual);
    let kept: Vec<_> = places.iter().filter(|_| near.next() == Some(true)).copied().collect();
    fit(grid, &kept);
    off = places.iter().map(|(.., p)| grid.height(*p).abs()).collect();
    let held = quantile(&mut off, HELD_SHARE)?;
    tolerances.into_iter().find(|tolerance| held <= *tolerance)
}

/// Heights by the means of places: cell, height over the plane, point.
fn fit(grid: &mut Grid, places: &[(usize, f32, Vec3)]) {
    let mut sums = vec![[0.0f32; 2]; grid.cells()];
    for (cell, height, _) in places {
        sums[*cell][0] += height;
        sums[*cell][1] += 1.0;
    }
    let means = sums.iter().map(|[h, n]| [if *n > 0.0 { h / n } else { 0.0 }]).collect();
    let weight: Vec<f32> = sums.iter().map(|[_, n]| f32::from(u8::from(*n > 0.0))).collect();
    let known: Vec<bool> = weight.iter().map(|w| *w > 0.0).collect();
    let mut heights = pull_push(grid.size, means, weight);
    grid.smooth(&mut heights, &known);
    for _ in 0..2 {
        let with_count: Vec<[f32; 2]> = heights.iter().map(|[h]| [*h, 1.0]).collect();
        let sums = boxed(grid.size, &with_count, SMOOTH);
        heights = sums.iter().map(|[h, n]| [h / n]).collect();
    }
    grid.heights = heights.into_iter().map(|[h]| h).collect();
}

impl Grid {
    /// Whether the ground is not a plane.
    pub(super) fn is_uneven(&self) -> bool {
        !self.heights.is_empty()
    }

    /// Height of the ground over the plane, between the middles of cells bilinear.
    pub(super) fn field_at(&self, flat: [f32; 2]) -> f32 {
        if self.heights.is_empty() {
            return 0.0;
        }
        let corner = self.middle(0);
        let at = [0, 1].map(|k| {
            let v = (flat[k] - corner[k]) / self.pitch;
            let v = v.max(0.0).min((self.size[k] - 1) as f32);
            (v as usize, v.fract())
        });
        let value = |dx: usize, dy: usize| {
            let x = (at[0].0 + dx).min(self.size[0] - 1);
            let y = (at[1].0 + dy).min(self.size[1] - 1);
            self.heights[y * self.size[0] + x]
        };
        let (u, v) = (at[0].1, at[1].1);
        let low = value(0, 0) * (1.0 - u) + value(1, 0) * u;
        let high = value(0, 1) * (1.0 - u) + value(1, 1) * u;
        low * (1.0 - v) + high * v
    }

    /// Height of a point over the ground, along the normal of the plane.
    pub(super) fn height(&self, p: Vec3) -> f32 {
        self.plane.height(p) - self.field_at(self.plane.flat(p))
    }

    /// The point of the ground with these coordinates.
    pub(super) fn point(&self, flat: [f32; 2]) -> Vec3 {
        self.plane.point(flat) + self.plane.normal * self.field_at(flat)
    }

    /// Unit normal of the ground.
    pub(super) fn normal(&self, flat: [f32; 2]) -> Vec3 {
        if self.heights.is_empty() {
            return self.plane.normal;
        }
        let slope = |k: usize| {
            let (mut low, mut high) = (flat, flat);
            low[k] -= self.pitch;
            high[k] += self.pitch;
            (self.field_at(high) - self.field_at(low)) / (2.0 * self.pitch)
        };
        let [u, v] = self.plane.axes;
        (self.plane.normal - u * slope(0) - v * slope(1)).normalize()
    }

    /// The ground in the middle of a cell, with random numbers of its own from `first_item` on.
    pub(super) fn probe(&self, cell: usize, first_item: u64) -> Probe {
        let flat = self.middle(cell);
        let item = first_item + cell as u64;
        Probe { position: self.point(flat), normal: self.normal(flat), item }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use motes_math::rng::keyed_rng;
    use rand::RngExt;

    use super::super::support::Plane;
    use super::*;

    #[test]
    fn waves_are_found_and_go_on_under_an_object() {
        let plane = Plane::new(DVec3::Z, DVec3::new(0.0, 0.0, 1.0));
        let wave = |p: Vec3| 1.0 + 0.1 * (2.0 * p.x).sin() * (1.5 * p.y).cos();
        let corners = [Vec3::new(-1.0, -1.0, 1.0), Vec3::new(1.0, 1.0, 1.0)];
        let mut grid = Grid::over(plane, &corners, 0.04, 0.0).expect("a grid");
        let mut rng = keyed_rng(1, 2, 3);
        let mut random = || rng.random_range(-1.0f32..1.0);
        let mut around: Vec<Oriented> = (0..6000)
            .map(|_| {
                let p = Vec3::new(random(), random(), 0.0);
                Oriented { point: p.with_z(wave(p) + 0.002 * random()), normal: Vec3::Z }
            })
            .collect();
        // A wall is not ground.
        around.extend(
            (0..500).map(|k| Oriented {
                point: Vec3::new(0.6, k as f32 / 500.0, 1.15),
                normal: Vec3::X,
            }),
        );
        let under: Vec<bool> =
            (0..grid.cells()).map(|c| grid.middle(c).iter().all(|v| v.abs() < 0.3)).collect();
        let tolerance = raise(&mut grid, &around, &under, 0.3, [1e-5, 0.01, 0.05].into_iter());
        assert_eq!(tolerance, Some(0.01));
        for (c, is_under) in under.iter().enumerate() {
            let p = grid.point(grid.middle(c));
            let bound = if *is_under { 0.03 } else { 0.02 };
            assert!((p.z - wave(p)).abs() < bound, "{p}: {}", wave(p));
            assert!(grid.height(p).abs() < 1e-5);
        }
        let n = grid.normal(plane.flat(Vec3::new(0.0, -0.6, 1.0)));
        let truth = Vec3::new(-0.2 * (0.9f32).cos(), 0.0, 1.0).normalize();
        assert!(n.dot(truth) > 0.999, "{n} {truth}");
        assert_eq!(raise(&mut grid, &around[..9], &under, 0.3, [1.0].into_iter()), None);
    }
}
