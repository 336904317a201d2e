//! A captured sky under its own light and another.

use motes_formats::ply::read_gaussians;
use motes_math::sh::SH_C0;
use motes_math::srgb;
use motes_scene::{Gaussians, attach_sky};
use motes_testkit::toy_scene::{ToyScene, toy_scene};
use motes_testkit::write_broken_gaussians;

use super::{VIEW, assert_code, picture, relight};

const SUN: [&str; 6] =
    ["--sun", "azimuth=20,elevation=50", "--env-exposure", "ground", "--background", "1,0,1"];

fn put_sky(toy: &ToyScene, sky: impl Fn(&Gaussians, usize) -> f32) {
    let path = toy.path("scene/gaussians.ply");
    let mut gaussians = read_gaussians(&path).unwrap();
    let values = (0..gaussians.len()).map(|i| sky(&gaussians, i)).collect();
    attach_sky(values, &mut gaussians);
    write_broken_gaussians(&path, &gaussians);
}

#[test]
fn the_background_shows_in_the_place_of_a_sky_under_another_light_only() {
    let toy = toy_scene();
    let own = picture(&toy, "own", &["--background", "1,0,1"]);
    let sun = picture(&toy, "sun", &SUN);
    put_sky(&toy, |_, _| 0.0);
    assert_eq!(picture(&toy, "sun0", &SUN).data, sun.data);
    put_sky(&toy, |_, _| 1.0);
    assert_eq!(picture(&toy, "own1", &["--background", "1,0,1"]).data, own.data);
    let gone = picture(&toy, "sun1", &SUN);
    assert!(gone.data.chunks_exact(3).all(|p| p == [255, 0, 255]), "nothing but background");
    let report = |more: &[&str]| {
        let done = relight(&toy, &[&VIEW[..], more, &["--json", "-w", "-o", "told"]].concat());
        let report: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
        report["sky_replaced"].as_bool().unwrap()
    };
    assert!(report(&SUN) && !report(&[]));
    assert!(!report(&[&SUN[..4], &["--background", "captured"]].concat()));
    // As captured, all is shown.
    let captured = ["--background", "captured"];
    let shown = picture(&toy, "captured", &[&SUN[..4], &captured].concat());
    assert!(shown.data.chunks_exact(3).any(|p| p != [255, 0, 255]));
    // A part of it, and what is no number.
    put_sky(&toy, |_, _| f32::NAN);
    assert_eq!(picture(&toy, "sun_nan", &SUN).data, sun.data);
    put_sky(&toy, |_, _| 0.5);
    let half = picture(&toy, "sun_half", &SUN);
    let red = |p: &[u8]| u32::from(p[0]);
    let sum = |image: &motes_scene::ImageU8| image.data.chunks_exact(3).map(red).sum::<u32>();
    assert!(sum(&half) > sum(&sun) && sum(&half) < sum(&gone));
}

#[test]
fn a_baked_sky_has_the_color_of_the_light() {
    let toy = toy_scene();
    // Bright above, unlike the scene's own, and even below, where one looks who sees the floor.
    toy.map("above.exr", 8, 4, |_, y| if y == 0 { [9.0; 3] } else { [0.5, 0.3, 0.2] });
    let path = toy.path("scene/gaussians.ply");
    let is_floor = |g: &Gaussians, i: usize| g.means[i][2].abs() < 1e-3;
    let gaussians = read_gaussians(&path).unwrap();
    let floor: Vec<usize> = (0..gaussians.len()).filter(|&i| is_floor(&gaussians, i)).collect();
    put_sky(&toy, |g, i| if is_floor(g, i) && i != floor[0] { 1.0 } else { 0.0 });
    let above = ["--environment", "above.exr", "--sh-degree", "0", "-o", "baked.ply"];
    assert_code(&relight(&toy, &above), 0);
    let baked = read_gaussians(&toy.path("baked.ply")).unwrap();
    let color = |i: usize| baked.sh[3 * i..3 * i + 3].iter().map(|v| 0.5 + SH_C0 as f32 * v);
    for (got, wanted) in color(floor[1]).zip([0.5, 0.3, 0.2]) {
        assert!((got - srgb::encode(wanted)).abs() < 0.02, "{got} {}", srgb::encode(wanted));
    }
    let off = color(floor[0]).zip(color(floor[1])).map(|(a, b)| (a - b).abs()).sum::<f32>();
    assert!(off > 0.1, "{off}");
}
