#![allow(
    clippy::print_stdout,
    reason = "numbers for docs/benchmarks/edit.md, shown with --nocapture"
)]

use glam::DVec3;
use motes_math::sh::SH_C0;

use super::*;
use crate::files::editor::Editor;

/// A lumpy sheet with smooth colors, and cameras above it.
fn scene() -> (Gaussians, Vec<StyleView>) {
    let n = 40;
    let mut gaussians = motes_testkit::random_gaussians(3, n * n, 0);
    for i in 0..n * n {
        let (x, y) = ((i % n) as f32 / n as f32 - 0.5, (i / n) as f32 / n as f32 - 0.5);
        gaussians.means[i] = [2.0 * x, 2.0 * y, 0.1 * (7.0 * x).sin() * (5.0 * y).cos()];
        gaussians.rotations[i] = [1.0, 0.0, 0.0, 0.0];
        gaussians.log_scales[i] = [-3.2, -3.2, -5.0];
        gaussians.opacity_logits[i] = 4.0;
        let color = [0.3 + 0.3 * (4.0 * x).sin(), 0.4, 0.5 + 0.2 * (6.0 * y).cos()];
        let sh = color.map(|v| (v - 0.5) / SH_C0 as f32);
        gaussians.sh[3 * i..3 * i + 3].copy_from_slice(&sh);
    }
    let camera = Pinhole { fx: 60.0, fy: 60.0, cx: 32.0, cy: 24.0, width: 64, height: 48 };
    let view = |i: usize| {
        let angle = i as f64;
        let eye = DVec3::new(0.8 * angle.cos(), 0.8 * angle.sin(), 1.4);
        let camera_from_world = Pose::look_at(eye, DVec3::ZERO, DVec3::Y).unwrap();
        StyleView { name: format!("view_{i}"), camera, camera_from_world }
    };
    (gaussians, (0..6).map(view).collect())
}

fn script(name: &str) -> Editor {
    let path =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/editors").join(name);
    Editor::new(&format!("python3 '{}' {{input}} {{output}} {{view}}", path.display())).unwrap()
}

const OPTIONS: StyleOptions =
    StyleOptions { key_views: 0, rounds: 1, steps: 120, weigh: false, seed: 1 };

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn run(editor: &Editor, options: &StyleOptions) -> (Gaussians, StyleReport) {
    let (mut gaussians, views) = scene();
    let chosen = vec![true; gaussians.len()];
    let report =
        stylize(&mut gaussians, &chosen, Antialias::Classic, &views, editor, "", options, &|| {
            false
        })
        .unwrap();
    (gaussians, report)
}

#[test]
fn a_consistent_editor_is_followed() {
    let (after, report) = run(&script("swap_red_blue.py"), &OPTIONS);
    let (before, views) = scene();
    assert!(mean(&report.edited) < 0.02, "{:?}", report.edited);
    assert!(mean(&report.residual) < 0.02, "{:?}", report.residual);
    let shown = picture(&after, Antialias::Classic, &views[1]);
    let wanted = picture(&before, Antialias::Classic, &views[1]);
    let at = 24 * 64 + 32;
    let (is, was) = (pixel(&shown, at), pixel(&wanted, at));
    assert!((is - Vec3::new(was.z, was.y, was.x)).length() < 0.05, "{is} {was}");
}

#[test]
fn an_inconsistent_editor_is_shown_and_the_remedies_help() {
    let editor = script("tint_by_view.py");
    let (_, bare) = run(&editor, &OPTIONS);
    let (_, keys) = run(&editor, &StyleOptions { key_views: 3, weigh: true, ..OPTIONS });
    let (_, consistent) = run(&script("swap_red_blue.py"), &StyleOptions { steps: 1, ..OPTIONS });
    let (shown, usual) = (mean(&bare.edited), mean(&consistent.edited));
    assert!(shown > 4.0 * usual, "the report shows it: {shown} against {usual}");
    assert_eq!(bare.edited, keys.edited, "the editor is the same");
    let (without, with) = (mean(&bare.fitted_to), mean(&keys.fitted_to));
    assert!(with < 0.25 * without, "disagreement {without} without, {with} with remedies");
    println!(
        "disagreement {shown:.4} of the editor, {without:.4} without and {with:.4} with remedies"
    );
    let (without, with) = (mean(&bare.residual), mean(&keys.residual));
    println!("residual {without:.4} without and {with:.4} with remedies");
    assert!(with < 0.5 * without, "residual {without} without, {with} with remedies");
}

#[test]
fn only_the_chosen_change() {
    let (mut gaussians, views) = scene();
    let before = gaussians.clone();
    let chosen: Vec<bool> = before.means.iter().map(|m| m[0] > 0.0).collect();
    let editor = script("swap_red_blue.py");
    stylize(&mut gaussians, &chosen, Antialias::Classic, &views, &editor, "", &OPTIONS, &|| false)
        .unwrap();
    for (i, on) in chosen.iter().enumerate() {
        assert!(*on || gaussians.sh_of(i) == before.sh_of(i), "{i}");
    }
    assert!(gaussians.sh != before.sh);
    assert_eq!((&gaussians.means, &gaussians.log_scales), (&before.means, &before.log_scales));
}

/// Notes what it is asked and changes nothing.
#[derive(Default)]
struct Noting {
    asked: std::cell::RefCell<Vec<(usize, f64)>>,
}

impl PictureEditor for Noting {
    fn edit(
        &self,
        prompt: &str,
        pictures: &[Picture<'_>],
        round: Round,
        _stopped: &dyn Fn() -> bool,
    ) -> Result<Vec<ImageF32>, EditorError> {
        assert_eq!(prompt, "snow");
        self.asked.borrow_mut().push((pictures.len(), round.noise));
        Ok(pictures.iter().map(|picture| picture.original.clone()).collect())
    }
}

#[test]
fn key_views_are_edited_together_and_the_noise_falls() {
    let (mut gaussians, views) = scene();
    let (chosen, editor) = (vec![true; gaussians.len()], Noting::default());
    let options = StyleOptions { key_views: 2, rounds: 3, steps: 1, ..OPTIONS };
    let classic = Antialias::Classic;
    stylize(&mut gaussians, &chosen, classic, &views, &editor, "snow", &options, &|| false)
        .unwrap();
    let asked = editor.asked.borrow();
    assert_eq!(asked.iter().map(|a| a.0).collect::<Vec<_>>(), [2, 1, 1, 1, 1].repeat(3));
    let noise: Vec<f64> = asked.iter().step_by(5).map(|a| a.1).collect();
    assert!((noise[0] - 0.98).abs() < 1e-12 && (noise[1] - 0.5).abs() < 1e-12);
    assert!((noise[2] - 0.02).abs() < 1e-12);
    assert_eq!(noise_of(0, 1), 0.98);
}
