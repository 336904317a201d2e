//! Where something can stand: ground that nothing stands on.
//!
//! The ground is divided into cells. A cell is taken where matter stands above it lower than the object is tall, and ground
//! where something lies flat at its height. Cells that taken ones enclose are the inside of something: objects are hollow. The
//! place is the one nearest to a middle whose disc of cells is free.

use glam::{DVec2, DVec3};
use motes_math::sigmoid::sigmoid;
use motes_scene::Gaussians;

use super::ground::{Ground, rows_on};

/// Cells of the radius of the object: finer ones say no more.
const CELLS_OF_RADIUS: f64 = 4.0;
/// Most cells along a side.
const MOST_CELLS: f64 = 256.0;
/// Fainter Gaussians are no matter to stand in.
const LEAST_OPACITY: f32 = 0.1;
/// Share of the disc that is to be ground.
const LEAST_GROUND: f64 = 0.6;
/// How far a Gaussian reaches, standard deviations.
const REACH: f64 = 1.5;
/// Share of the ground on either side that is left out of the search: stray Gaussians far outside.
const TAIL: f64 = 0.02;

/// Coordinates on the ground.
struct Level {
    x: DVec3,
    y: DVec3,
}

impl Level {
    fn of(&self, p: DVec3) -> DVec2 {
        DVec2::new(p.dot(self.x), p.dot(self.y))
    }
}

/// The point of the ground nearest to `middle` where something of a `radius` across and a `height` along up stands free, world
/// units; `None` where there is no such place.
pub fn free_place(
    gaussians: &Gaussians,
    ground: &Ground,
    middle: DVec3,
    radius: f64,
    height: f64,
) -> Option<DVec3> {
    let x = ground.up.any_orthonormal_vector();
    let level = Level { x, y: ground.up.cross(x) };
    let on = rows_on(gaussians, ground);
    let point = |row: u32| DVec3::from_array(gaussians.means[row as usize].map(f64::from));
    let grid = Grid::over(on.iter().map(|row| level.of(point(*row))), radius)?;
    let cells = grid.size[0] * grid.size[1];
    let (mut is_ground, mut taken) = (vec![false; cells], vec![false; cells]);
    let on_ground: std::collections::HashSet<u32> = on.iter().copied().collect();
    for row in 0..gaussians.len() as u32 {
        let p = point(row);
        let above = p.dot(ground.up) - ground.height;
        if !p.is_finite() || sigmoid(gaussians.opacity_logits[row as usize]) < LEAST_OPACITY {
            continue;
        }
        let widest = gaussians.log_scales[row as usize].into_iter().fold(f32::MIN, f32::max);
        let reach = (REACH * f64::from(widest).exp()).min(radius);
        if on_ground.contains(&row) {
            grid.mark(level.of(p), reach, &mut is_ground);
        } else if above > 2.0 * ground.half_thickness && above - reach < height {
            grid.mark(level.of(p), reach, &mut taken);
        }
    }
    grid.take_enclosed(&is_ground, &mut taken);
    let center = level.of(middle);
    let mut order: Vec<usize> = (0..cells).filter(|c| is_ground[*c] && !taken[*c]).collect();
    let far = |c: &usize| grid.center(*c).distance_squared(center);
    order.sort_by(|a, b| far(a).total_cmp(&far(b)).then(a.cmp(b)));
    let disc = grid.disc(radius);
    let found = order.into_iter().find(|cell| {
        let mut covered = 0usize;
        let free = disc.iter().all(|step| match grid.neighbor(*cell, *step) {
            Some(c) => {
                covered += usize::from(is_ground[c]);
                !taken[c]
            }
            None => true,
        });
        free && covered as f64 >= LEAST_GROUND * disc.len() as f64
    })?;
    let at = grid.center(found);
    Some(level.x * at.x + level.y * at.y + ground.up * ground.height)
}

/// Square cells over the ground.
struct Grid {
    low: DVec2,
    cell: f64,
    size: [usize; 2],
}

impl Grid {
    fn over(points: impl Iterator<Item = DVec2>, radius: f64) -> Option<Self> {
        let (mut xs, mut ys): (Vec<f64>, Vec<f64>) =
            points.filter(|p| p.is_finite()).map(|p| (p.x, p.y)).unzip();
        if xs.is_empty() || !(radius > 0.0) {
            return None;
        }
        let bounds = |values: &mut Vec<f64>| {
            values.sort_by(f64::total_cmp);
            let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
            (at(TAIL), at(1.0 - TAIL))
        };
        let ((x0, x1), (y0, y1)) = (bounds(&mut xs), bounds(&mut ys));
        let side = (x1 - x0).max(y1 - y0);
        let cell = (radius / CELLS_OF_RADIUS).max(side / MOST_CELLS).max(f64::MIN_POSITIVE);
        let count = |low: f64, high: f64| (((high - low) / cell) as usize + 1).min(257);
        Some(Self { low: DVec2::new(x0, y0), cell, size: [count(x0, x1), count(y0, y1)] })
    }

    fn center(&self, cell: usize) -> DVec2 {
        let at = DVec2::new((cell % self.size[0]) as f64, (cell / self.size[0]) as f64);
        self.low + (at + 0.5) * self.cell
    }

    /// Cells within `reach` of a point.
    fn mark(&self, at: DVec2, reach: f64, cells: &mut [bool]) {
        let low = ((at - reach - self.low) / self.cell).floor();
        let high = ((at + reach - self.low) / self.cell).floor();
        let span = |low: f64, high: f64, n: usize| {
            (low.max(0.0) as usize)..((high + 1.0).clamp(0.0, n as f64) as usize)
        };
        for j in span(low.y, high.y, self.size[1]) {
            for i in span(low.x, high.x, self.size[0]) {
                cells[j * self.size[0] + i] = true;
            }
        }
    }

    /// Takes what is not connected with the largest open ground.
    fn take_enclosed(&self, is_ground: &[bool], taken: &mut [bool]) {
        let mut region_of: Vec<Option<usize>> = vec![None; taken.len()];
        let mut areas = Vec::new();
        for start in 0..taken.len() {
            if taken[start] || region_of[start].is_some() {
                continue;
            }
            let region = areas.len();
            let (mut area, mut open) = (0usize, vec![start]);
            region_of[start] = Some(region);
            while let Some(cell) = open.pop() {
                area += usize::from(is_ground[cell]);
                for step in [[1, 0], [-1, 0], [0, 1], [0, -1]] {
                    let next = self.neighbor(cell, step);
                    if let Some(next) = next.filter(|c| !taken[*c] && region_of[*c].is_none()) {
                        region_of[next] = Some(region);
                        open.push(next);
                    }
                }
            }
            areas.push(area);
        }
        let largest = (0..areas.len()).max_by_key(|r| (areas[*r], std::cmp::Reverse(*r)));
        for (taken, region) in taken.iter_mut().zip(region_of) {
            *taken |= region != largest;
        }
    }

    /// Steps to the cells of a disc.
    fn disc(&self, radius: f64) -> Vec<[i64; 2]> {
        let n = ((radius / self.cell).ceil() as i64).min(256);
        let most = (radius / self.cell).powi(2).max(0.5);
        let all = (-n..=n).flat_map(|j| (-n..=n).map(move |i| [i, j]));
        all.filter(|[i, j]| (i * i + j * j) as f64 <= most).collect()
    }

    fn neighbor(&self, cell: usize, [i, j]: [i64; 2]) -> Option<usize> {
        let x = (cell % self.size[0]) as i64 + i;
        let y = (cell / self.size[0]) as i64 + j;
        let inside = (0..self.size[0] as i64).contains(&x) && (0..self.size[1] as i64).contains(&y);
        inside.then(|| y as usize * self.size[0] + x as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::changes::ground::find_ground;

    /// A table of 2 by 2 with a block of half its width in the middle.
    fn table(block: bool) -> Gaussians {
        let mut points: Vec<[f32; 3]> = Vec::new();
        for i in 0..40 {
            for j in 0..40 {
                points.push([i as f32 / 20.0 - 1.0, j as f32 / 20.0 - 1.0, 0.0]);
            }
        }
        let flat = points.len();
        for k in 0..if block { 800 } else { 0 } {
            let (i, j, z) = (k % 10, k / 10 % 10, k / 100);
            points.push([i as f32 / 10.0 - 0.5, j as f32 / 10.0 - 0.5, 0.05 + z as f32 * 0.06]);
        }
        let mut gaussians = motes_testkit::random_gaussians(1, points.len(), 0);
        for (row, point) in points.iter().enumerate() {
            gaussians.means[row] = *point;
            gaussians.opacity_logits[row] = 4.0;
            gaussians.rotations[row] = [1.0, 0.0, 0.0, 0.0];
            gaussians.log_scales[row] = if row < flat { [-3.0, -3.0, -7.0] } else { [-3.0; 3] };
        }
        gaussians
    }

    #[test]
    fn the_middle_is_taken_where_something_stands_on_it() {
        let bare = table(false);
        let ground = find_ground(&bare, DVec3::Z).unwrap();
        let at = free_place(&bare, &ground, DVec3::ZERO, 0.2, 0.3).unwrap();
        assert!(at.truncate().length() < 0.1, "{at}");
        let full = table(true);
        let ground = find_ground(&full, DVec3::Z).unwrap();
        let at = free_place(&full, &ground, DVec3::ZERO, 0.2, 0.3).unwrap();
        // The block reaches 0.5, a Gaussian of it another 0.07.
        let outside = at.truncate().abs().max_element();
        assert!((0.65..0.95).contains(&outside) && at.z.abs() < 0.02, "{at}");
        assert_eq!(free_place(&full, &ground, DVec3::ZERO, 3.0, 0.3), None, "no room");
    }

    #[test]
    fn the_inside_of_a_hollow_object_is_not_free() {
        let mut hollow = table(true);
        let rows: Vec<u32> = (0..hollow.len() as u32)
            .filter(|row| {
                let [x, y, z] = hollow.means[*row as usize];
                z < 0.01 || x.abs().max(y.abs()) > 0.35
            })
            .collect();
        hollow.gather(&rows);
        let ground = find_ground(&hollow, DVec3::Z).unwrap();
        let at = free_place(&hollow, &ground, DVec3::ZERO, 0.1, 0.3).unwrap();
        let outside = at.truncate().abs().max_element();
        assert!((0.55..0.95).contains(&outside), "{at}");
    }
}
