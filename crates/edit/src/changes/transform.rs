//! Rotation, uniform scale and translation of Gaussians.
//!
//! With `p ↦ s R p + t`: centers move, quaternions are multiplied by that of `R`, log scales grow by `ln s`, bands of spherical
//! harmonics and normals turn with `R`. The opacity of a Gaussian is that of its peak and stays. Covariances transform
//! exactly, whatever their shape, because `s` is uniform.

use glam::{DQuat, DVec3};
use motes_math::sh::sh_coefficients;
use motes_math::sh_rotation::ShRotation;
use motes_scene::{ColumnValues, Gaussians, Residual};
use rayon::prelude::*;

use crate::{EditState, Similarity};

/// Gaussians per task.
const CHUNK: usize = 4096;

/// Moves the Gaussians of `rows`, and notes it.
pub fn transform(state: &mut EditState, rows: &[u32], motion: &Similarity) {
    transform_gaussians(&mut state.gaussians, rows, motion);
    state.note_motion(rows, motion);
}

/// Moves the Gaussians of `rows`.
pub fn transform_gaussians(gaussians: &mut Gaussians, rows: &[u32], motion: &Similarity) {
    let n = gaussians.len();
    let chosen = Chosen::new(rows, n);
    let turned = motion.rotation.w.abs() != 1.0;
    for_chosen(&mut gaussians.means, &chosen, |mean| {
        let p = DVec3::from_array(mean.map(f64::from));
        *mean = motion.point(p).as_vec3().to_array();
    });
    if motion.scale != 1.0 {
        let shift = motion.scale.ln();
        for_chosen(&mut gaussians.log_scales, &chosen, |scales| {
            *scales = scales.map(|s| (f64::from(s) + shift) as f32);
        });
    }
    if !turned {
        return;
    }
    for_chosen(&mut gaussians.rotations, &chosen, |q| {
        let [w, x, y, z] = q.map(f64::from);
        let turned = motion.rotation * DQuat::from_xyzw(x, y, z, w);
        *q = [turned.w, turned.x, turned.y, turned.z].map(|v| v as f32);
    });
    if gaussians.sh_degree > 0 {
        let turn = ShRotation::new(motion.rotation_rows());
        let stride = 3 * gaussians.sh_coefficients();
        gaussians.sh.par_chunks_mut(stride * CHUNK).enumerate().for_each(|(chunk, values)| {
            for (i, sh) in values.chunks_exact_mut(stride).enumerate() {
                if chosen.has(chunk * CHUNK + i) {
                    turn.apply(sh);
                }
            }
        });
    }
    turn_normals(gaussians, rows, motion);
    turn_residual(gaussians, rows, motion);
}

/// Turns the columns `nx ny nz`, when they are floats.
fn turn_normals(gaussians: &mut Gaussians, rows: &[u32], motion: &Similarity) {
    let find = |name: &str| {
        gaussians
            .extra
            .iter()
            .position(|c| c.name == name && matches!(c.values, ColumnValues::F32(_)))
    };
    let [Some(x), Some(y), Some(z)] = ["nx", "ny", "nz"].map(find) else { return };
    let [mut nx, mut ny, mut nz] = [x, y, z].map(|at| take(gaussians, at));
    for row in rows.iter().map(|r| *r as usize) {
        let n = DVec3::new(nx[row].into(), ny[row].into(), nz[row].into());
        let turned = motion.direction(n).as_vec3();
        (nx[row], ny[row], nz[row]) = turned.into();
    }
    for (at, values) in [(x, nx), (y, ny), (z, nz)] {
        gaussians.extra[at].values = ColumnValues::F32(values);
    }
}

/// Turns the columns of the residual, when they belong together.
fn turn_residual(gaussians: &mut Gaussians, rows: &[u32], motion: &Similarity) {
    let Ok(Some(mut residual)) = Residual::of(gaussians) else { return };
    if residual.degree == 0 {
        return;
    }
    let turn = ShRotation::new(motion.rotation_rows());
    let stride = 3 * sh_coefficients(residual.degree);
    for row in rows.iter().map(|r| *r as usize) {
        turn.apply(&mut residual.log_ratio_sh[row * stride..(row + 1) * stride]);
    }
    residual.attach(gaussians);
}

fn take(gaussians: &mut Gaussians, at: usize) -> Vec<f32> {
    match &mut gaussians.extra[at].values {
        ColumnValues::F32(values) => std::mem::take(values),
        _ => Vec::new(),
    }
}

/// A set of rows that answers quickly.
enum Chosen {
    All,
    Some(Vec<bool>),
}

impl Chosen {
    fn new(rows: &[u32], n: usize) -> Self {
        if rows.len() == n {
            return Self::All;
        }
        let mut chosen = vec![false; n];
        rows.iter().for_each(|row| chosen[*row as usize] = true);
        Self::Some(chosen)
    }

    fn has(&self, row: usize) -> bool {
        match self {
            Self::All => true,
            Self::Some(chosen) => chosen[row],
        }
    }
}

fn for_chosen<T: Send>(values: &mut [T], chosen: &Chosen, change: impl Fn(&mut T) + Sync) {
    values.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, values)| {
        for (i, value) in values.iter_mut().enumerate() {
            if chosen.has(chunk * CHUNK + i) {
                change(value);
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use motes_raster::{RenderOptions, render};
    use motes_scene::{ExtraColumn, Pinhole, Pose};

    use super::*;

    fn psnr(a: &[f32], b: &[f32]) -> f64 {
        let sum: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum();
        -10.0 * (sum / a.len() as f64).log10()
    }

    fn picture(gaussians: &Gaussians, camera_from_world: &Pose) -> Vec<f32> {
        let camera = Pinhole { fx: 80.0, fy: 80.0, cx: 40.0, cy: 30.0, width: 80, height: 60 };
        render(gaussians, &camera, camera_from_world, &RenderOptions::default()).color.data
    }

    fn motion() -> Similarity {
        let turn = DQuat::from_axis_angle(DVec3::new(0.48, -0.6, 0.64), 1.234);
        Similarity::about(DVec3::new(0.3, 0.1, -0.2), turn, 1.7, DVec3::new(0.5, -1.0, 2.0))
    }

    fn camera() -> Pose {
        Pose::look_at(DVec3::new(0.0, -4.0, 1.0), DVec3::ZERO, DVec3::Z).unwrap()
    }

    fn anisotropic() -> Gaussians {
        let mut gaussians = motes_testkit::random_gaussians(5, 300, 3);
        for (i, scales) in gaussians.log_scales.iter_mut().enumerate() {
            scales[i % 3] += 1.2;
            scales[(i + 1) % 3] -= 1.5;
        }
        gaussians
    }

    #[test]
    fn a_motion_and_its_inverse_render_the_same() {
        let before = anisotropic();
        let mut after = before.clone();
        let rows: Vec<u32> = (0..300).collect();
        transform_gaussians(&mut after, &rows, &motion());
        let moved = psnr(&picture(&before, &camera()), &picture(&after, &camera()));
        assert!(moved < 30.0, "it moved: {moved}");
        transform_gaussians(&mut after, &rows, &motion().inverse());
        let back = psnr(&picture(&before, &camera()), &picture(&after, &camera()));
        assert!(back > 60.0, "{back} dB");
    }

    #[test]
    fn scene_and_camera_moved_together_show_the_same_picture() {
        // Tests every part at once: covariances, order, and colors that depend on the direction.
        let before = anisotropic();
        let mut after = before.clone();
        let rows: Vec<u32> = (0..300).collect();
        let motion = motion();
        transform_gaussians(&mut after, &rows, &motion);
        // p_camera scales with the scene, so only the pose's translation does.
        let pose = camera();
        let back = motion.inverse();
        let rotation = pose.rotation * back.rotation;
        let center = motion.point(pose.center_in_world());
        let moved = Pose { rotation, translation: -(rotation * center) };
        let db = psnr(&picture(&before, &pose), &picture(&after, &moved));
        assert!(db > 60.0, "{db} dB");
    }

    #[test]
    fn only_chosen_rows_move_and_normals_turn() {
        let mut gaussians = motes_testkit::random_gaussians(5, 3, 1);
        for (name, value) in [("nx", 1.0), ("ny", 0.0), ("nz", 0.0)] {
            let values = ColumnValues::F32(vec![value; 3]);
            gaussians.extra.push(ExtraColumn { name: name.into(), values });
        }
        let log_ratio_sh = gaussians.sh.clone();
        Residual { degree: 1, log_ratio_sh }.attach(&mut gaussians);
        let before = gaussians.clone();
        let quarter = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let motion = Similarity::about(DVec3::ZERO, quarter, 2.0, DVec3::ZERO);
        transform_gaussians(&mut gaussians, &[1], &motion);
        for row in [0, 2] {
            assert_eq!(gaussians.means[row], before.means[row]);
            assert_eq!(gaussians.sh_of(row), before.sh_of(row));
        }
        let [x, y, z] = before.means[1];
        for (is, should) in gaussians.means[1].iter().zip([-2.0 * y, 2.0 * x, 2.0 * z]) {
            assert!((is - should).abs() < 1e-6);
        }
        let ColumnValues::F32(ny) = &gaussians.extra[1].values else { panic!() };
        assert!((ny[1] - 1.0).abs() < 1e-6 && ny[0] == 0.0, "{ny:?}");
        let residual = Residual::of(&gaussians).unwrap().unwrap();
        assert_eq!(residual.log_ratio_sh, gaussians.sh, "it turns as colors do");
        assert!((gaussians.log_scales[1][0] - before.log_scales[1][0] - 2f32.ln()).abs() < 1e-6);
    }
}
