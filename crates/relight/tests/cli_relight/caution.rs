//! What is shown where a decomposition is not sure.

use glam::Vec3;
use motes_formats::images::read_image;
use motes_formats::ply::{read_gaussians, read_surface, write_surface};
use motes_math::srgb::decode;
use motes_scene::{ImageU8, Materials, attach_confidence};
use motes_testkit::toy_scene::{BOX, FLOOR, ToyScene, toy_scene};
use motes_testkit::write_broken_gaussians;

use super::{VIEW, assert_code, at, picture, pixel_of, run_program};

pub(super) const SUN: [&str; 4] = ["--sun", "azimuth=20,elevation=50", "--env-exposure", "ground"];

pub(super) fn put_confidence(toy: &ToyScene, confidence: f32) {
    let path = toy.path("scene/gaussians.ply");
    let mut gaussians = read_gaussians(&path).unwrap();
    let values = vec![confidence; gaussians.len()];
    attach_confidence(values, &mut gaussians);
    write_broken_gaussians(&path, &gaussians);
}

/// Turns the normals of the surface to and fro, as those of a torn mesh are.
pub(super) fn tear(toy: &ToyScene) {
    let path = toy.path("scene/surface.ply");
    let mut surface = read_surface(&path).unwrap();
    for (i, normal) in surface.normals.iter_mut().enumerate() {
        let phase = i as f32 * 2.4;
        let aside = Vec3::new(phase.cos(), phase.sin(), 0.3 * (2.0 * phase).sin());
        *normal = (Vec3::from(*normal) + 0.9 * aside).normalize().to_array();
    }
    write_surface(&path, &surface).unwrap();
}

fn difference(a: &ImageU8, b: &ImageU8) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let sum: f64 = a.data.iter().zip(&b.data).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
    sum / a.data.len() as f64
}

/// Mean difference of neighboring pixels on the floor behind the box, which is even.
fn tearing(toy: &ToyScene, image: &ImageU8) -> f64 {
    let (x0, y0) = pixel_of(toy, glam::DVec3::new(-1.4, 0.9, 0.0));
    let at = |x: usize, y: usize| f64::from(image.pixel(x, y)[1]);
    let pixels = (0..5).flat_map(|dy| (0..5).map(move |dx| (x0 + dx - 2, y0 + dy - 2)));
    pixels.map(|(x, y)| (at(x + 1, y) - at(x, y)).abs() + (at(x, y + 1) - at(x, y)).abs()).sum()
}

#[test]
fn the_scenes_own_light_shows_the_splat_itself_however_sure_the_model_is() {
    let toy = toy_scene();
    let shown = [&["--scene", "scene"], &VIEW[..], &["-o", "splat"]].concat();
    assert_code(&run_program(motes_testkit::program("render"), &toy, &shown), 0);
    let splat = read_image(&toy.path("splat/view_0.png")).unwrap();
    for confidence in [0.0, 1.0, f32::NAN] {
        put_confidence(&toy, confidence);
        tear(&toy);
        for caution in ["0.25", "1"] {
            let shown = ["--background", "captured", "--caution", caution];
            let own = picture(&toy, &format!("own{confidence}-{caution}"), &shown);
            let off = difference(&own, &splat);
            assert!(off < 1.0, "{confidence} {caution}: {off}");
        }
        // Twice the light is twice the splat.
        let brighter = picture(&toy, &format!("ev{confidence}"), &["--ev", "1"]);
        assert!(difference(&brighter, &splat) > 5.0, "{confidence}");
    }
    // The model alone is not the splat: its normals are torn.
    let model = picture(&toy, "model", &["--caution", "0", "--background", "captured"]);
    assert!(difference(&model, &splat) > 1.0, "{}", difference(&model, &splat));
}

#[test]
fn a_torn_surface_is_shown_torn_only_where_it_is_sure() {
    let toy = toy_scene();
    tear(&toy);
    let relit = |folder: &str, more: &[&str]| picture(&toy, folder, &[&SUN[..], more].concat());
    let before = relit("before", &[]);
    put_confidence(&toy, 1.0);
    let (sure, model) = (relit("sure", &[]), relit("model", &["--caution", "0"]));
    // An even light and a sun have nothing in common: what is sure is shown by its model.
    assert!(difference(&sure, &model) < 1.0, "{}", difference(&sure, &model));
    assert!(difference(&before, &model) == 0.0, "a scene without the column is its model");
    put_confidence(&toy, 0.0);
    let unsure = relit("unsure", &[]);
    let (torn, whole) = (tearing(&toy, &model), tearing(&toy, &unsure));
    assert!(torn > 100.0 && whole < 0.3 * torn, "{torn} {whole}");
    let all = relit("all", &["--caution", "1"]);
    assert!(difference(&all, &unsure) < 0.5, "{}", difference(&all, &unsure));
}

#[test]
fn without_caution_a_scene_is_shown_and_metered_as_if_it_had_no_confidence() {
    let toy = toy_scene();
    tear(&toy);
    let sun = &SUN[..2];
    let before = picture(&toy, "before", sun);
    put_confidence(&toy, 0.0);
    let model = picture(&toy, "model", &[sun, &["--caution", "0"]].concat());
    assert!(before == model, "{}", difference(&before, &model));
    // The meter reads what is shown.
    let shown = picture(&toy, "shown", &[sun, &["--caution", "1"]].concat());
    assert!(difference(&before, &shown) > 1.0, "{}", difference(&before, &shown));
}

#[test]
fn a_wall_that_faces_a_low_sun_is_far_brighter_than_the_ground_though_nothing_is_sure() {
    let toy = toy_scene();
    put_confidence(&toy, 0.0);
    let low = ["--sun", "azimuth=20,elevation=8", "--env-exposure", "ground"];
    let relit = picture(&toy, "low", &low);
    // Of green, linear: what the captured color is multiplied with.
    let times = |point: [f64; 3], captured: [f32; 3]| {
        decode(at(&toy, &relit, point)[1] / 255.0) / decode(captured[1])
    };
    let (wall, ground) = (times([0.3, 0.0, 0.3], BOX), times([-1.4, 0.9, 0.0], FLOOR));
    // A stop around the ground would let the wall be twice as bright.
    assert!(wall > 2.5 * ground && wall < 9.0 * ground, "{wall} {ground}");
}

/// The confidence of all that stands above the floor, and how many photos saw it.
fn judge_box(toy: &ToyScene, confidence: f32, photos: u16) {
    let path = toy.path("scene/gaussians.ply");
    let mut gaussians = read_gaussians(&path).unwrap();
    let mut materials = Materials::of(&gaussians).unwrap();
    let stands = |mean: &[f32; 3]| mean[2] > 0.01;
    let values = gaussians.means.iter().map(|m| if stands(m) { confidence } else { 1.0 }).collect();
    for (count, mean) in materials.observations.iter_mut().zip(&gaussians.means) {
        *count = if stands(mean) { photos } else { 9 };
    }
    materials.attach(&mut gaussians);
    attach_confidence(values, &mut gaussians);
    write_broken_gaussians(&path, &gaussians);
}

#[test]
fn a_shadow_that_photos_speak_against_fades_and_one_that_none_saw_the_cause_of_stays() {
    let toy = toy_scene();
    // Behind the box, whose shadow falls towards the camera.
    let sun = ["--sun", "azimuth=200,elevation=50", "--env-exposure", "ground"];
    let relit = |folder: &str| picture(&toy, folder, &sun);
    judge_box(&toy, 1.0, 9);
    let sure = relit("sure");
    judge_box(&toy, 0.0, 9);
    let denied = relit("denied");
    judge_box(&toy, 0.0, 0);
    let unseen = relit("unseen");
    let place = [0.6, 0.1, 0.0];
    let lit = at(&toy, &sure, [-1.4, 0.9, 0.0])[1];
    let [sure, denied, unseen] = [sure, denied, unseen].map(|p| at(&toy, &p, place)[1]);
    assert!(sure < 0.1 * lit && unseen < 0.1 * lit, "{sure} {unseen} {lit}");
    assert!(denied > 0.3 * lit && denied < lit, "{denied} {lit}");
}

#[test]
fn a_caution_out_of_range_is_refused() {
    let toy = toy_scene();
    for bad in ["-0.1", "1.1", "NaN", "much"] {
        let arguments = [&["--scene", "scene"], &VIEW[..], &["-o", "x", "--caution", bad]].concat();
        assert_code(&run_program(env!("CARGO_BIN_EXE_relight"), &toy, &arguments), 2);
    }
}
