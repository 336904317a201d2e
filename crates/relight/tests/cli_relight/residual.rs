//! What the model left unexplained.

use motes_formats::images::read_image;
use motes_formats::ply::read_gaussians;
use motes_scene::{ColumnValues, ImageU8, Residual};

use super::caution::{SUN, put_confidence};
use super::{VIEW, assert_code, assert_near, at, decode, picture, relight, run_program, text};
use motes_testkit::toy_scene::{BOX, ToyScene, toy_scene};
use motes_testkit::write_broken_gaussians;

/// Puts the same log ratio on all Gaussians of the scene, for every direction of view.
fn put_residual(toy: &ToyScene, log_ratio: f32) {
    let path = toy.path("scene/gaussians.ply");
    let mut gaussians = read_gaussians(&path).unwrap();
    let log_ratio_sh = vec![log_ratio / 0.282_094_8; 3 * gaussians.len()];
    Residual { degree: 0, log_ratio_sh }.attach(&mut gaussians);
    write_broken_gaussians(&path, &gaussians);
}

#[test]
fn what_the_model_left_unexplained_counts_as_far_as_the_light_is_alike() {
    let toy = toy_scene();
    let top = |image: &ImageU8| at(&toy, image, [0.0, 0.0, 0.6]);
    let sun = ["--sun", "azimuth=20,elevation=60", "--env-exposure", "ground"];
    let without = top(&picture(&toy, "without", &sun)).map(decode);
    put_residual(&toy, 0.6f32.ln());
    let times = |c: [f32; 3], f: f32| c.map(|c| c * f);
    assert_near(top(&picture(&toy, "own", &[])), times(BOX, 0.3), 2.5);
    assert_near(top(&picture(&toy, "preview", &["--quality", "preview"])), times(BOX, 0.3), 2.5);
    assert_near(top(&picture(&toy, "off", &["--residual", "off"])), times(BOX, 0.5), 2.5);
    // Nothing of the even light is in a sun.
    let half = times(without, 0.6f32.sqrt());
    assert_near(top(&picture(&toy, "sun", &sun)), half, 3.0);
    let all = top(&picture(&toy, "all", &[&sun[..], &["--residual", "1"]].concat()));
    assert_near(all, times(without, 0.6), 3.0);
    // What is baked is about the new light, and so is what is left of the residual.
    let scene = relight(&toy, &[&sun[..], &["--as", "scene", "-o", "sunny"]].concat());
    assert_code(&scene, 0);
    let sunny = read_gaussians(&toy.path("sunny/gaussians.ply")).unwrap();
    let left = Residual::of(&sunny).unwrap().unwrap().log_ratio_sh[0] * 0.282_094_8;
    assert!((left / 0.6f32.ln() - 0.5).abs() < 0.03, "{left}");
    let again = [&["--scene", "sunny"], &VIEW[..], &["-o", "again"]].concat();
    assert_code(&run_program(env!("CARGO_BIN_EXE_relight"), &toy, &again), 0);
    assert_near(top(&read_image(&toy.path("again/view_0.png")).unwrap()), half, 5.0);
    let shown = [&["--scene", "sunny"], &VIEW[..], &["-o", "shown"]].concat();
    assert_code(&run_program(motes_testkit::program("render"), &toy, &shown), 0);
    assert_near(top(&read_image(&toy.path("shown/view_0.png")).unwrap()), half, 5.0);
}

#[test]
fn what_is_unexplained_over_a_neighborhood_goes_with_its_light_where_nothing_is_sure() {
    let toy = toy_scene();
    put_confidence(&toy, 0.0);
    let floor = |folder| at(&toy, &picture(&toy, folder, &SUN), [-1.4, 0.9, 0.0]);
    let before = floor("before").map(decode);
    put_residual(&toy, 1.6f32.ln());
    assert_near(floor("after"), before.map(|c| c / 1.6), 3.0);
}

#[test]
fn columns_of_the_residual_that_are_broken_are_told_or_do_nothing() {
    let toy = toy_scene();
    put_residual(&toy, f32::NAN);
    assert_near(at(&toy, &picture(&toy, "nan", &[]), [0.0, 0.0, 0.6]), BOX.map(|c| 0.5 * c), 2.5);
    put_residual(&toy, 1e30);
    // A factor of 4 at most.
    let [r, g, b] = BOX.map(|c| (0.5 * 4.0 * c).min(1.0));
    assert_near(at(&toy, &picture(&toy, "huge", &[]), [0.0, 0.0, 0.6]), [r, g, b], 2.5);
    let path = toy.path("scene/gaussians.ply");
    let mut gaussians = read_gaussians(&path).unwrap();
    let column = gaussians.extra.iter_mut().find(|c| c.name == "residual_1").unwrap();
    column.values = ColumnValues::U8(vec![1; column.values.len()]);
    write_broken_gaussians(&path, &gaussians);
    let done = relight(&toy, &[&VIEW[..], &["-o", "broken"]].concat());
    assert_code(&done, 3);
    assert!(text(&done).contains("residual_1") && text(&done).contains("gaussians.ply"));
    assert_code(&relight(&toy, &[&VIEW[..], &["-o", "x", "--residual", "2"]].concat()), 2);
}
