//! What a target is made of.
//!
//! On Gaussians with material columns the columns change, and the rows are noted for the light to follow. On a plain splat the
//! shown color stands for the base color: light and reflectance are not told apart, so only the color changes.

use motes_math::luminance::luminance;
use motes_scene::{Materials, Residual, attach_confidence, confidence_of};

use super::color::{ColorChange, ColorMode, show_linear, shown_linear};
use crate::EditState;

/// A change of material; `None` leaves a property as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MaterialChange {
    /// Base color.
    pub base_color: Option<ColorChange>,
    /// Perceptual, 0 to 1.
    pub roughness: Option<f32>,
    /// 0 to 1.
    pub metallic: Option<f32>,
}

/// What could be changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaterialOutcome {
    /// Material columns: the light has to follow.
    Columns,
    /// Shown colors alone.
    Shown,
}

/// Changes the material of the Gaussians of `rows`.
pub fn set_material(
    state: &mut EditState,
    rows: &[u32],
    change: &MaterialChange,
) -> MaterialOutcome {
    match Materials::of(&state.gaussians) {
        Ok(mut materials) => {
            change_columns(&mut materials, rows, change);
            // In place of the old ones, where they were: the order of the file stays.
            let names: Vec<String> = state.gaussians.extra.iter().map(|c| c.name.clone()).collect();
            materials.attach(&mut state.gaussians);
            let place = |name: &String| names.iter().position(|n| n == name);
            state.gaussians.extra.sort_by_key(|c| place(&c.name));
            rows.iter().for_each(|row| state.material_changed[*row as usize] = true);
            let is_another = change.roughness.is_some() || change.metallic.is_some();
            if let (true, Some(mut confidence)) = (is_another, confidence_of(&state.gaussians)) {
                // What was chosen is known.
                rows.iter().for_each(|row| confidence[*row as usize] = 1.0);
                attach_confidence(confidence, &mut state.gaussians);
            }
            if let (true, Ok(Some(mut residual))) = (is_another, Residual::of(&state.gaussians)) {
                // What was left unexplained of one lobe says nothing about another.
                residual.scale(rows.iter().map(|row| *row as usize), 0.0);
                residual.attach(&mut state.gaussians);
            }
            MaterialOutcome::Columns
        }
        Err(_) => {
            if let Some(color) = &change.base_color {
                change_shown(state, rows, color);
            }
            MaterialOutcome::Shown
        }
    }
}

fn change_columns(materials: &mut Materials, rows: &[u32], change: &MaterialChange) {
    if let Some(color) = &change.base_color {
        let mean = mean(rows.iter().map(|r| luminance(materials.base_color_linear[*r as usize])));
        for row in rows {
            let base = &mut materials.base_color_linear[*row as usize];
            *base = color.apply(*base, mean);
        }
    }
    let set = |values: &mut [f32], value: Option<f32>| {
        if let Some(value) = value {
            rows.iter().for_each(|row| values[*row as usize] = value);
        }
    };
    set(&mut materials.roughness, change.roughness);
    set(&mut materials.metallic, change.metallic);
}

fn change_shown(state: &mut EditState, rows: &[u32], color: &ColorChange) {
    let stride = 3 * state.gaussians.sh_coefficients();
    let shown: Vec<[f32; 3]> =
        rows.iter().map(|r| shown_linear(state.gaussians.sh_of(*r as usize))).collect();
    let mean = mean(shown.iter().map(|c| luminance(*c)));
    // What varies is the light, too: an even color would take it away.
    let mode = if color.mode == ColorMode::Even { ColorMode::Replace } else { color.mode };
    let color = ColorChange { mode, ..*color };
    for (row, old) in rows.iter().zip(shown) {
        let at = *row as usize * stride;
        show_linear(&mut state.gaussians.sh[at..at + stride], color.apply(old, mean));
    }
}

/// Of the finite values; 0 for none.
fn mean(values: impl Iterator<Item = f32>) -> f32 {
    let (mut sum, mut n) = (0.0, 0.0);
    for value in values.filter(|v| v.is_finite()) {
        sum += f64::from(value);
        n += 1.0;
    }
    if n > 0.0 { (sum / n) as f32 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use motes_scene::{ColumnValues, ExtraColumn};

    use super::*;

    fn replace(rgb_linear: [f32; 3]) -> MaterialChange {
        let base_color = Some(ColorChange { mode: ColorMode::Replace, rgb_linear });
        MaterialChange { base_color, roughness: Some(0.1), metallic: Some(1.0) }
    }

    #[test]
    fn columns_change_where_they_are_and_keep_their_place() {
        let mut gaussians = motes_testkit::random_gaussians(3, 4, 1);
        let materials = Materials {
            normals: vec![[0.0, 0.0, 1.0]; 4],
            base_color_linear: vec![[0.2; 3], [0.2; 3], [0.4; 3], [0.8; 3]],
            roughness: vec![0.5; 4],
            metallic: vec![0.0; 4],
            visibility: vec![1.0; 4],
            observations: vec![3; 4],
        };
        materials.attach(&mut gaussians);
        Residual { degree: 0, log_ratio_sh: vec![0.25; 12] }.attach(&mut gaussians);
        let label = ExtraColumn { name: "label".into(), values: ColumnValues::U8(vec![9; 4]) };
        gaussians.extra.insert(3, label);
        let before = gaussians.clone();
        let mut state = EditState::new("t", gaussians, None, None, DVec3::Z);
        let outcome = set_material(&mut state, &[1, 2], &replace([0.03, 0.06, 0.03]));
        assert_eq!(outcome, MaterialOutcome::Columns);
        let names =
            |g: &motes_scene::Gaussians| g.extra.iter().map(|c| c.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&state.gaussians), names(&before));
        let after = Materials::of(&state.gaussians).unwrap();
        assert_eq!((after.roughness[0], after.roughness[1]), (0.5, 0.1));
        // The brighter one is still twice as bright.
        let (a, b) = (after.base_color_linear[1], after.base_color_linear[2]);
        assert!(
            (b[1] / a[1] - 2.0).abs() < 1e-5 && (a[1] / a[0] - 2.0).abs() < 1e-5,
            "{a:?} {b:?}"
        );
        assert_eq!(state.material_changed, [false, true, true, false]);
        assert_eq!(state.gaussians.sh, before.sh, "the light follows later");
        let residual = Residual::of(&state.gaussians).unwrap().unwrap();
        let left = [0.25, 0.0, 0.0, 0.25].map(|v| [v; 3]).concat();
        assert_eq!(residual.log_ratio_sh, left, "it was about the old lobe");
        let even = ColorChange { mode: ColorMode::Even, rgb_linear: [0.03; 3] };
        let change = MaterialChange { base_color: Some(even), ..MaterialChange::default() };
        set_material(&mut state, &[1, 2], &change);
        let after = Materials::of(&state.gaussians).unwrap();
        assert_eq!(after.base_color_linear[1..3], [[0.03; 3]; 2]);
    }

    #[test]
    fn a_plain_splat_takes_the_color() {
        let gaussians = motes_testkit::random_gaussians(3, 4, 1);
        let before = gaussians.clone();
        let mut state = EditState::new("t", gaussians, None, None, DVec3::Z);
        assert_eq!(
            set_material(&mut state, &[2], &replace([0.5, 0.0, 0.0])),
            MaterialOutcome::Shown
        );
        let shown = shown_linear(state.gaussians.sh_of(2));
        assert!((shown[0] - 0.5).abs() < 1e-3 && shown[1] < 1e-3, "{shown:?}");
        assert_eq!(state.gaussians.sh_of(1), before.sh_of(1));
    }
}
