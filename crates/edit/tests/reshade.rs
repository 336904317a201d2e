//! Shadows follow what casts them: a ground, a box and a sun that are known exactly.

mod box_on_ground;

use box_on_ground::{
    BOX, BOX_CELLS, GROUND, GROUND_CELLS, error, ground, photographed, rows_of_box, state, state_of,
};
use edit::changes::decimate::decimate;
use edit::reshade::{ReshadeError, ReshadeOptions, ReshadeReport, moved_surface, reshade};
use edit::{EditState, Fill, Similarity};
use glam::{DVec3, Vec3};
use motes_math::srgb;
use motes_math::tone_curve::ToneCurve;
use motes_scene::{Gaussians, ImageF32, Surface};

fn run(state: &mut EditState) -> (Surface, ReshadeReport) {
    reshade(state, &ReshadeOptions::default()).expect("light follows")
}

#[test]
fn a_shadow_goes_with_its_box_and_the_ground_closes() {
    let mut state = state(&[[0.0, 0.0]]);
    let before = state.gaussians.clone();
    let (truth, _) = photographed(&[], true);
    let rows = rows_of_box(&state, [0.0, 0.0]);
    assert_eq!(rows.len(), 5 * BOX_CELLS * BOX_CELLS);
    state.remove(&rows, Fill::Plane);
    let (surface, report) = run(&mut state);
    let shadow = error(&before, &truth, |_| true);
    let left = error(&state.gaussians, &truth, |_| true);
    assert!(left < 0.2 * shadow, "{left} of {shadow}, {report:?}");
    let under = error(&state.gaussians, &truth, |p| p.iter().all(|v| v.abs() < BOX));
    assert!(under < 0.03, "under the box: {under}, {report:?}");
    assert!(report.filled > 20 && report.warnings.is_empty(), "{report:?}");
    assert!(surface.is_consistent() && surface.has_materials());
    let highest = surface.vertices.iter().map(|v| v[2]).fold(0.0, f32::max);
    assert!(highest < 0.02, "no triangle of the box is left: {highest}");
}

#[test]
fn light_is_computed_without_the_tone_curve_of_the_photos() {
    // Scaled and filled under the light that was found, or all shaded anew under twice that light.
    let edited = |curve: ToneCurve, brighter: bool| {
        let mut state = state(&[[0.0, 0.0]]);
        let parts = state.parts.as_mut().expect("a scene");
        parts.tone_curve = curve;
        if brighter {
            parts.environment = parts.environment.clone().scaled(2.0);
            parts.environment_changed = true;
        }
        let rows = rows_of_box(&state, [0.0, 0.0]);
        state.remove(&rows, Fill::Plane);
        let (surface, _) = run(&mut state);
        (state.gaussians, surface)
    };
    for brighter in [false, true] {
        let plain = edited(ToneCurve::default(), brighter);
        assert!(edited(ToneCurve::new(0.6), brighter) == plain, "brighter: {brighter}");
    }
}

#[test]
fn ground_that_nobody_saw_is_replaced_although_the_surface_goes_on() {
    // The sheet continues under the box; what the splat holds there, and below it, is red.
    let red = |p: &[f32; 3]| p[0].abs() < BOX && p[1].abs() < BOX && p[2] < 0.5 * BOX;
    let (mut gaussians, surface) = photographed(&[[0.0, 0.0]], true);
    let hidden: Vec<u32> = (0..gaussians.len() as u32)
        .filter(|&i| {
            let m = gaussians.means[i as usize];
            m[2].abs() < 1e-3 && red(&m)
        })
        .collect();
    let mut junk = gaussians.clone();
    junk.gather(&hidden);
    junk.means.iter_mut().enumerate().for_each(|(i, m)| m[2] = [-0.05, 0.1][i % 2]);
    for &i in &hidden {
        gaussians.sh[3 * i as usize..][..3].copy_from_slice(&[1.5, -1.5, -1.5]);
    }
    let n = gaussians.len();
    gaussians.means.extend(&junk.means);
    gaussians.rotations.extend(&junk.rotations);
    gaussians.log_scales.extend(&junk.log_scales);
    gaussians.opacity_logits.extend(&junk.opacity_logits);
    gaussians.sh.extend(vec![1.5; junk.sh.len()]);
    for (column, more) in gaussians.extra.iter_mut().zip(&mut junk.extra) {
        column.values.append(&mut more.values);
    }
    let mut state = state_of(gaussians, surface);
    let rows = rows_of_box(&state, [0.0, 0.0]);
    let rows: Vec<u32> = rows.into_iter().filter(|&i| (i as usize) < n).collect();
    state.remove(&rows, Fill::Plane);
    let (surface, report) = run(&mut state);
    assert!(report.leftovers >= 2 * hidden.len() * 3 / 4, "{report:?} of {}", hidden.len());
    let (truth, _) = photographed(&[], true);
    let under = error(&state.gaussians, &truth, |p| p.iter().all(|v| v.abs() < BOX));
    assert!(under < 0.03, "under the box: {under}, {report:?}");
    let inside = state.gaussians.means.iter().filter(|m| red(m) && m[2].abs() > 0.02).count();
    assert!(inside == 0, "{inside} are left in the air or below");
    assert!(surface.vertices.iter().all(|v| v[2].abs() < 0.02), "the box is gone");
}

#[test]
fn a_moved_box_takes_its_shadow_along_and_nothing_far_changes() {
    let mut state = state(&[[0.0, 0.0]]);
    let (truth, _) = photographed(&[[0.5, 0.25]], true);
    let before = state.gaussians.clone();
    let rows = rows_of_box(&state, [0.0, 0.0]);
    let shift = DVec3::new(0.5, 0.25, 0.0);
    for &i in &rows {
        let mean = &mut state.gaussians.means[i as usize];
        *mean = (Vec3::from(*mean) + shift.as_vec3()).to_array();
    }
    state.note_motion(&rows, &Similarity::translation(shift));
    let (_, report) = run(&mut state);
    let seen = |p: [f32; 2]| (p[0] - 0.5).abs() > 1.3 * BOX || (p[1] - 0.25).abs() > 1.3 * BOX;
    let wrong = error(&before, &truth, seen);
    let left = error(&state.gaussians, &truth, seen);
    assert!(left < 0.3 * wrong, "{left} of {wrong}, {report:?}");
    let far = [-1.9, -1.9];
    assert_eq!(ground(&before, far).to_bits(), ground(&state.gaussians, far).to_bits());
}

#[test]
fn the_surface_of_a_box_goes_with_it_when_it_was_decimated_and_when_light_stays() {
    let mut state = state(&[[0.0, 0.0]]);
    let rows = rows_of_box(&state, [0.0, 0.0]);
    decimate(&mut state, &rows, rows.len() / 4);
    let rows = rows_of_box(&state, [0.0, 0.0]);
    state.remove(&rows, Fill::None);
    let high = |surface: &Surface| surface.vertices.iter().filter(|v| v[2] > 0.1).count();
    let before = state.sources[0].surface.as_deref().map(high).expect("a surface");
    assert!(before > 400, "{before}");
    let surface = moved_surface(&state);
    assert!(surface.is_consistent() && surface.has_materials());
    assert_eq!(high(&surface), 0, "of {before}");
    assert_eq!(high(&run(&mut state).0), 0, "of {before}");
}

#[test]
fn a_piece_of_the_ground_can_fill_it_and_threads_do_not_matter() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let mut state = state(&[[0.0, 0.0]]);
            let rows = rows_of_box(&state, [0.0, 0.0]);
            state.remove(&rows, Fill::Patch);
            let (surface, report) = run(&mut state);
            (state.gaussians, surface, report)
        })
    };
    let (gaussians, surface, report) = run(1);
    let (truth, _) = photographed(&[], true);
    let under = error(&gaussians, &truth, |p| p.iter().all(|v| v.abs() < BOX));
    assert!(under < 0.05 && report.filled > 20, "{under}, {report:?}");
    assert!(report.warnings.is_empty(), "{report:?}");
    assert!(run(3) == (gaussians, surface, report), "one thread or three");
}

/// Planks with dark joints, every third row of the ground, and every fourth plank darker.
fn paint_planks(gaussians: &mut Gaussians) {
    let cell = 2.0 * GROUND / GROUND_CELLS as f32;
    for i in 0..gaussians.len() {
        let [x, _, z] = gaussians.means[i];
        let column = ((x + GROUND) / cell) as usize;
        let factor = if column.is_multiple_of(3) { 0.4 } else { 1.0 };
        if z.abs() < 1e-3 && factor < 1.0 {
            let linear = |sh: f32| srgb::decode(0.5 + 0.282_094_8 * sh);
            for sh in &mut gaussians.sh[3 * i..][..3] {
                *sh = (srgb::encode(factor * linear(*sh)) - 0.5) / 0.282_094_8;
            }
        }
    }
}

#[test]
fn texture_goes_on_under_a_box_and_smooth_ground_gets_none() {
    let (mut truth, _) = photographed(&[], true);
    paint_planks(&mut truth);
    let filled = |fill: Fill, painted: bool| {
        let (mut gaussians, surface) = photographed(&[[0.0, 0.0]], false);
        if painted {
            paint_planks(&mut gaussians);
        }
        let mut state = state_of(gaussians, surface);
        let rows = rows_of_box(&state, [0.0, 0.0]);
        state.remove(&rows, fill);
        let (_, report) = run(&mut state);
        // Not where planks meet: seen from above, Gaussians blend there.
        let inside = |p: [f32; 2]| {
            let across = ((p[0] + GROUND) / (2.0 * GROUND / GROUND_CELLS as f32)).fract();
            (0.25..0.75).contains(&across) && p.iter().all(|v| v.abs() < 0.9 * BOX)
        };
        (error(&state.gaussians, &truth, inside), report)
    };
    let (smooth, of_smooth) = filled(Fill::Plane, true);
    let (textured, of_textured) = filled(Fill::Texture, true);
    assert_eq!((of_smooth.textured, of_textured.textured), (0, 1));
    assert!(textured < 0.6 * smooth, "{textured}, smooth {smooth}");
    // The model has no texture where the ground has none.
    let (_, report) = filled(Fill::Texture, false);
    assert_eq!(report.textured, 0);
}

#[test]
fn nothing_changes_where_nothing_was_edited() {
    let mut state = state(&[[0.0, 0.0]]);
    let before = state.gaussians.clone();
    let (_, report) = run(&mut state);
    assert_eq!((report.scaled, report.shaded, report.filled), (0, 0, 0));
    assert_eq!(state.gaussians, before);
}

#[test]
fn another_environment_lights_all_and_a_splat_has_none() {
    let mut state = state(&[[0.0, 0.0]]);
    let parts = state.parts.as_mut().expect("parts");
    parts.environment = ImageF32::filled(4, 2, 3, 0.0);
    parts.environment_changed = true;
    let (_, report) = run(&mut state);
    assert_eq!(report.shaded, state.len());
    assert!(ground(&state.gaussians, [1.0, 1.0]) < 0.01, "no light");
    state.parts = None;
    let error = reshade(&mut state, &ReshadeOptions::default());
    assert_eq!(error.map(|_| ()), Err(ReshadeError::NoScene));
}
