//! What came along with an object: the ground of the place where it was captured.

use glam::{DVec2, DVec3};
use motes_scene::Gaussians;

use super::clusters::outside_largest;
use super::ground::{find_ground, rows_on};
use crate::EditState;

/// Ground under an object covers at most this many times the area that the object itself covers seen from above.
const OWN_GROUND: f64 = 2.5;
/// Less of what stands on the ground than this share is noise of it.
const LEAST_STANDING: f64 = 0.05;
/// Cells along a side of the picture from above.
const CELLS: usize = 64;
/// Times the usual distance of neighbors that still connects, as `keep_largest` has it.
const TOUCH: f64 = 4.0;

/// A splat that is a whole capture.
#[derive(Clone, Debug, PartialEq)]
pub struct Surroundings {
    /// Rows of the object: the largest cluster of what stands on the ground.
    pub object: Vec<u32>,
    /// Area of the ground over the area of what stands on it.
    pub ratio: f64,
}

/// Finds ground that came along: flat, below almost all other matter, and wider than it. `None` for an object alone.
pub fn find_surroundings(gaussians: &Gaussians, up: DVec3) -> Option<Surroundings> {
    let ground = find_ground(gaussians, up)?;
    let is_on = rows_on(gaussians, &ground);
    let height = |row: u32| {
        DVec3::from_array(gaussians.means[row as usize].map(f64::from)).dot(up) - ground.height
    };
    let mut on = vec![false; gaussians.len()];
    is_on.iter().for_each(|row| on[*row as usize] = true);
    let others: Vec<u32> = (0..gaussians.len() as u32).filter(|r| !on[*r as usize]).collect();
    let standing: Vec<u32> =
        others.into_iter().filter(|row| height(*row) > ground.half_thickness).collect();
    if (standing.len() as f64) < LEAST_STANDING * gaussians.len() as f64 {
        return None;
    }
    let state = EditState::new("", gaussians.clone(), None, None, up);
    let outside = outside_largest(&state, &standing, TOUCH);
    let mut gone = outside.iter().copied().peekable();
    let object: Vec<u32> =
        standing.iter().copied().filter(|row| gone.next_if_eq(row).is_none()).collect();
    let areas = [
        areas_from_above(gaussians, &is_on, &is_on, up),
        areas_from_above(gaussians, &is_on, &object, up),
    ];
    let ratio = areas[0] as f64 / areas[1].max(1) as f64;
    // A table top has its legs below it; ground has nothing.
    let below = (0..gaussians.len() as u32).filter(|r| height(*r) < -ground.half_thickness).count();
    let is_lowest = below * 4 < standing.len();
    (is_lowest && ratio > OWN_GROUND).then_some(Surroundings { object, ratio })
}

/// Cells of the picture of `frame` from above that `rows` are in.
fn areas_from_above(gaussians: &Gaussians, frame: &[u32], rows: &[u32], up: DVec3) -> usize {
    let x = up.any_orthonormal_vector();
    let y = up.cross(x);
    let at = |row: &u32| {
        let p = DVec3::from_array(gaussians.means[*row as usize].map(f64::from));
        DVec2::new(p.dot(x), p.dot(y))
    };
    let (low, high) = frame
        .iter()
        .map(at)
        .filter(|p| p.is_finite())
        .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let cell = ((high - low).max_element() / CELLS as f64).max(f64::MIN_POSITIVE);
    let mut seen = vec![false; (CELLS + 1) * (CELLS + 1)];
    for row in rows {
        let p = (at(row) - low) / cell;
        if p.min_element() >= 0.0 && p.max_element() <= CELLS as f64 {
            seen[p.y as usize * (CELLS + 1) + p.x as usize] = true;
        }
    }
    seen.iter().filter(|s| **s).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block on a ground of `side`, a point per 0.05.
    fn block_on(side: f32) -> Gaussians {
        let n = (side / 0.05) as i32;
        let mut points: Vec<[f32; 3]> = (0..n * n)
            .map(|k| [(k % n) as f32, (k / n) as f32, 0.0].map(|v| v * 0.05))
            .map(|[x, y, z]| [x - side / 2.0, y - side / 2.0, z])
            .collect();
        let flat = points.len();
        for k in 0..1000 {
            let (i, j, z) = (k % 10, k / 10 % 10, k / 100);
            points.push([i as f32 * 0.05 - 0.25, j as f32 * 0.05 - 0.25, 0.08 + z as f32 * 0.05]);
        }
        let mut gaussians = motes_testkit::random_gaussians(1, points.len(), 0);
        for (row, point) in points.iter().enumerate() {
            gaussians.means[row] = *point;
            gaussians.opacity_logits[row] = 4.0;
            gaussians.rotations[row] = [1.0, 0.0, 0.0, 0.0];
            gaussians.log_scales[row] = if row < flat { [-3.5, -3.5, -7.0] } else { [-3.5; 3] };
        }
        gaussians
    }

    #[test]
    fn ground_that_came_along_is_found() {
        let capture = block_on(3.0);
        let found = find_surroundings(&capture, DVec3::Z).unwrap();
        assert!(found.object.len() >= 990 && found.object.len() <= 1000, "{}", found.object.len());
        assert!(found.ratio > 10.0, "{}", found.ratio);
        assert_eq!(find_surroundings(&block_on(0.5), DVec3::Z), None, "its own base");
        assert_eq!(find_surroundings(&block_on(3.0), -DVec3::Z), None, "a table upside down");
        assert_eq!(find_surroundings(&Gaussians::empty(0), DVec3::Z), None);
    }
}
