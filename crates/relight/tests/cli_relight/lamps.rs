//! Lamps of a scene: when they shine, and what they light.

use glam::Vec3;
use motes_formats::ply::{read_surface, write_surface};
use motes_math::srgb::decode;
use motes_scene::ImageU8;
use motes_testkit::toy_scene::{FLOOR, ToyScene, toy_scene};

use super::caution::{SUN, put_confidence, tear};
use super::{assert_near, at, picture};

/// Makes the sides of the box that face away from the floor send `radiance`.
fn light_the_box(toy: &ToyScene, radiance: f32) {
    let path = toy.path("scene/surface.ply");
    let mut surface = read_surface(&path).unwrap();
    let of_box = |v: &[f32; 3]| if v[2] > 1e-3 { [radiance; 3] } else { [0.0; 3] };
    surface.emission_linear = surface.vertices.iter().map(of_box).collect();
    write_surface(&path, &surface).unwrap();
    assert_eq!(read_surface(&path).unwrap(), surface);
}

const MODEL: [&str; 4] = ["--caution", "0", "--residual", "off"];
/// On the floor, beside the box and far from it.
const NEAR: [f64; 3] = [-1.2, 0.7, 0.0];
const FAR: [f64; 3] = [-1.8, 1.7, 0.0];

#[test]
fn lamps_shine_under_the_light_of_the_photos_and_when_they_are_asked_to() {
    let toy = toy_scene();
    // From one side, where the light of the photos is even.
    toy.map("side.exr", 8, 4, |x, _| if x < 2 { [1e-3; 3] } else { [1e-6; 3] });
    let dim = [&["--environment", "side.exr", "--env-exposure", "1"], &MODEL[..]].concat();
    let before = picture(&toy, "before", &dim);
    let own_before = picture(&toy, "own-before", &MODEL);
    light_the_box(&toy, 1.0);
    let dark = picture(&toy, "dark", &dim);
    assert!(dark.data == before.data, "another light: lamps are dark");
    let lit = picture(&toy, "lit", &[&dim[..], &["--lamps", "on"]].concat());
    let (floor, away) = (at(&toy, &lit, NEAR), at(&toy, &lit, FAR));
    assert!(floor[1] > away[1] && away[1] > 0.0, "{floor:?} {away:?}");
    // The floor's own color, by light without color.
    let light = motes_math::srgb::decode(floor[1] / 255.0) / FLOOR[1];
    assert_near(floor, FLOOR.map(|c| c * light), 4.0);
    let own = picture(&toy, "own", &MODEL);
    assert!(at(&toy, &own, NEAR)[1] > at(&toy, &own_before, NEAR)[1], "its own light: they shine");
    let off = picture(&toy, "off", &[&MODEL[..], &["--lamps", "off"]].concat());
    assert!(off.data == own_before.data, "lamps are off");
}

#[test]
fn the_glow_of_a_lamp_goes_out_with_it_though_nothing_is_sure() {
    let toy = toy_scene();
    tear(&toy);
    put_confidence(&toy, 0.0);
    let captured = picture(&toy, "captured", &SUN);
    light_the_box(&toy, 1.0);
    let off = picture(&toy, "off", &SUN);
    let linear =
        |image: &ImageU8, point| Vec3::from(at(&toy, image, point).map(|v| decode(v / 255.0)));
    // White matter in the light of the sun takes the place of the captured blue.
    let side = [0.3, 0.0, 0.3];
    let hue = |color: Vec3| color.max_element() / color.min_element();
    let [blue, white] = [&captured, &off].map(|image| linear(image, side));
    assert!(hue(blue) > 4.0 && hue(white) < 2.0, "{blue} {white}");
    assert!((0.1..0.8).contains(&white.y), "{white}");
    let floor = linear(&off, FAR) / linear(&captured, FAR);
    assert!(
        floor.min_element() > 0.7 && floor.max_element() < 1.4,
        "the floor is no lamp: {floor}"
    );
}

#[test]
fn what_a_strong_lamp_gave_a_place_goes_with_it_though_nothing_is_sure() {
    let toy = toy_scene();
    put_confidence(&toy, 0.0);
    let before = picture(&toy, "before", &SUN);
    light_the_box(&toy, 1e3);
    let off = picture(&toy, "off", &SUN);
    let left = |point| {
        decode(at(&toy, &off, point)[1] / 255.0) / decode(at(&toy, &before, point)[1] / 255.0)
    };
    // Hardly anything but the lamp lit the floor, and what is beside it five times as much as what is away.
    let (beside, away) = (left([-0.5, 0.7, 0.0]), left([-1.8, 0.7, 0.0]));
    assert!(beside < 0.3 * away, "{beside} {away}");
}

#[test]
fn lamps_of_any_brightness_give_pictures() {
    let toy = toy_scene();
    for radiance in [1e-30, 1e8, 1e30] {
        light_the_box(&toy, radiance);
        let image = picture(&toy, &format!("at{radiance}"), &["--lamps", "on"]);
        assert!(image.data.iter().any(|v| *v > 0));
    }
}
