//! The plane that things stand on.

use glam::{DQuat, DVec3};
use motes_math::median::quantile;
use motes_math::sigmoid::sigmoid;
use motes_scene::{ColumnValues, ExtraColumn, Gaussians};

use crate::EditState;

/// Cells of the histogram of heights.
const CELLS: usize = 512;
/// Cosine between up and the shortest axis of a Gaussian that lies on the ground: 30 degrees, for noise.
const LEAST_COSINE: f64 = 0.866;
/// The ground ends where a cell has less than this share of the fullest one.
const TAIL: f64 = 0.1;
/// Cells beyond that on either side.
const SPARE: f64 = 1.5;
/// Name of the column of [`mark_catcher`].
pub const CATCHER_COLUMN: &str = "shadow_catcher";

/// A level plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Unit, away from the matter.
    pub up: DVec3,
    /// Height along up, world units.
    pub height: f64,
    /// What is nearer than this belongs to it, world units.
    pub half_thickness: f64,
}

/// The level plane with the largest area of Gaussians that lie flat; `None` when nothing lies flat.
pub fn find_ground(gaussians: &Gaussians, up: DVec3) -> Option<Ground> {
    let flat: Vec<(f64, f64)> =
        (0..gaussians.len()).filter_map(|row| height_and_area(gaussians, row, up)).collect();
    if flat.is_empty() {
        return None;
    }
    // The scene without its farthest percent: a stray height must not stretch the cells.
    let mut heights: Vec<f64> = flat.iter().map(|f| f.0).collect();
    heights.sort_by(f64::total_cmp);
    let at = |share: f64| heights[((heights.len() - 1) as f64 * share) as usize];
    let (low, high) = (at(0.01), at(0.99));
    let cell = ((high - low) / CELLS as f64).max(f64::MIN_POSITIVE);
    let mut areas = [0.0; CELLS + 1];
    for (height, area) in &flat {
        let i = (height - low) / cell;
        if (0.0..=CELLS as f64).contains(&i) {
            areas[i as usize] += area;
        }
    }
    let smooth = |i: usize| {
        let side = |k: Option<usize>| k.and_then(|k| areas.get(k)).copied().unwrap_or(0.0);
        areas[i] + 0.5 * (side(i.checked_sub(1)) + side(Some(i + 1)))
    };
    let best = (0..=CELLS).max_by(|a, b| smooth(*a).total_cmp(&smooth(*b)).then(b.cmp(a)))?;
    // As thick as it is noisy: down to a tenth of its peak.
    let tall = |i: &usize| smooth(*i) >= TAIL * smooth(best);
    let first = (0..=best).rev().take_while(tall).last().unwrap_or(best);
    let last = (best..=CELLS).take_while(tall).last().unwrap_or(best);
    let guess = low + 0.5 * (first + last + 1) as f64 * cell;
    let half_thickness = (0.5 * (last - first) as f64 + SPARE) * cell;
    let near = flat.iter().filter(|(h, _)| (h - guess).abs() <= half_thickness);
    let (sum, weight) = near.fold((0.0, 0.0), |(s, w), (h, a)| (s + h * a, w + a));
    let height = if weight > 0.0 { sum / weight } else { guess };
    Some(Ground { up, height, half_thickness })
}

/// Height and visible area of a Gaussian that lies flat.
fn height_and_area(gaussians: &Gaussians, row: usize, up: DVec3) -> Option<(f64, f64)> {
    let scales = gaussians.log_scales[row].map(|s| f64::from(s).exp());
    let thin = (0..3).min_by(|a, b| scales[*a].total_cmp(&scales[*b]))?;
    let [w, x, y, z] = gaussians.rotations[row].map(f64::from);
    let axis = DQuat::from_xyzw(x, y, z, w).normalize() * DVec3::AXES[thin];
    let area = scales[(thin + 1) % 3] * scales[(thin + 2) % 3];
    let area = area * f64::from(sigmoid(gaussians.opacity_logits[row]));
    let height = DVec3::from_array(gaussians.means[row].map(f64::from)).dot(up);
    let lies = axis.dot(up).abs() >= LEAST_COSINE && height.is_finite() && area > 0.0;
    (lies && area.is_finite()).then_some((height, area))
}

/// Rows of the Gaussians that lie flat on a plane, ascending.
pub fn rows_on(gaussians: &Gaussians, ground: &Ground) -> Vec<u32> {
    let on = |row: &u32| {
        height_and_area(gaussians, *row as usize, ground.up)
            .is_some_and(|(h, _)| (h - ground.height).abs() <= ground.half_thickness)
    };
    (0..gaussians.len() as u32).filter(on).collect()
}

/// How far from the plane a point may lie that the depth of a picture shows on it, world units: depth is that of the centers of
/// Gaussians, which are beside the ray by twice their width at most.
pub fn depth_slack(gaussians: &Gaussians, ground: &Ground) -> f64 {
    let widest = |row: u32| gaussians.log_scales[row as usize].into_iter().fold(f32::MIN, f32::max);
    let mut widths: Vec<f32> = rows_on(gaussians, ground).into_iter().map(widest).collect();
    let usual = quantile(&mut widths, 0.5).map_or(0.0, |log| f64::from(log).exp());
    2.0 * (ground.half_thickness + usual)
}

/// Marks the Gaussians of `rows` in the column `shadow_catcher` (1: shadows fall on it), in place of an older mark.
pub fn mark_catcher(state: &mut EditState, rows: &[u32]) {
    let mut values = vec![0; state.len()];
    rows.iter().for_each(|row| values[*row as usize] = 1);
    let values = ColumnValues::U8(values);
    match state.gaussians.extra.iter_mut().find(|c| c.name == CATCHER_COLUMN) {
        Some(column) => column.values = values,
        None => state.gaussians.extra.push(ExtraColumn { name: CATCHER_COLUMN.into(), values }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_found_under_clutter() {
        let mut gaussians = motes_testkit::random_gaussians(3, 2000, 0);
        for i in 0..1200 {
            gaussians.means[i][2] = 0.3 + 0.002 * ((i * 7 % 11) as f32 - 5.0);
            gaussians.rotations[i] = [1.0, 0.0, 0.0, 0.0];
            gaussians.log_scales[i] = [-3.0, -3.0, -6.0];
            gaussians.opacity_logits[i] = 2.0;
        }
        for i in 1200..2000 {
            gaussians.log_scales[i] = [-3.5; 3];
        }
        let ground = find_ground(&gaussians, DVec3::Z).unwrap();
        assert!((ground.height - 0.3).abs() < 0.01, "{ground:?}");
        let on = rows_on(&gaussians, &ground);
        assert!(on.iter().filter(|r| **r < 1200).count() > 800, "{} {ground:?}", on.len());
        let mut state = EditState::new("t", gaussians, None, None, DVec3::Z);
        mark_catcher(&mut state, &on);
        mark_catcher(&mut state, &on[..1]);
        assert_eq!(state.gaussians.extra.len(), 1);
        assert_eq!(find_ground(&Gaussians::empty(0), DVec3::Z), None);
    }
}
