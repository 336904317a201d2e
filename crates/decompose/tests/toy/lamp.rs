//! A lamp beside the ball, seen clipped: how bright it is, its shading on the floor tells.

use decompose::{Known, TracedSurface};
use glam::Vec3;
use motes_scene::{Surface, Switch};
use motes_shading::brdf::Material;

use crate::scene::{base_color, is_floor, light, photos, surface_with_lamp};
use crate::{Found, assert_sound, options, run_with};

const SKY: f32 = 0.25;
const LAMP: f32 = 12.0;

/// Standard deviation of the logarithm of found over true base color on the floor near the lamp.
fn spread(d: &Found) -> f64 {
    let near = |p: &Vec3| {
        is_floor(*p) && (p.truncate() - Vec3::new(0.9, 0.5, 0.0).truncate()).length() < 1.2
    };
    let edge = |p: Vec3| [p.x, p.y].map(|v| (v * 2.0 - (v * 2.0).round()).abs());
    let of = |(v, p): (usize, Vec3)| {
        let inner = near(&p) && edge(p).iter().all(|e| *e > 0.15);
        let found = d.surface.base_color_linear[v][1].max(1e-3);
        inner.then(|| f64::from((found / base_color(p)).ln()))
    };
    let points = d.surface.vertices.iter().map(|&p| Vec3::from(p)).enumerate();
    let all: Vec<f64> = points.filter_map(of).collect();
    assert!(all.len() > 100);
    let n = all.len() as f64;
    let mean = all.iter().sum::<f64>() / n;
    (all.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}

fn decomposed(radiance: f32, lamps: Switch, local_light: Switch) -> Found {
    let shining = surface_with_lamp(radiance);
    let scene = TracedSurface::new(shining.clone()).expect("a mesh");
    let photos =
        photos(&scene, &light(SKY, SKY), |p| Material::lambert(Vec3::splat(base_color(p))));
    let mut options = options();
    options.light.lamps = lamps;
    options.light.local_light = local_light;
    let dark = Surface { emission_linear: Vec::new(), ..shining };
    run_with(&options, dark, &photos, Known::default()).expect("a decomposition")
}

#[test]
fn a_lamp_that_the_photos_clip_is_found_by_what_it_lights() {
    let off = Switch::Off;
    let (with, without) = (decomposed(LAMP, Switch::Auto, off), decomposed(LAMP, off, off));
    assert_sound(&with);
    let term = with.term("lamps").expect("a lamp");
    let lamps = &with.lights[0].lamps;
    println!("{}; spread {:.3}, without {:.3}", term.evidence, spread(&with), spread(&without));
    assert!(term.kept && lamps.len() == 1, "{term:?}");
    // The scale of the light is free; the sky tells it.
    let mut sky: Vec<f32> = with.lights[0]
        .cells
        .iter()
        .zip(&with.lights[0].radiance)
        .filter(|(cell, _)| cell.v < 0.4)
        .map(|(_, e)| e.y)
        .collect();
    sky.sort_by(f32::total_cmp);
    let ratio = lamps[0].radiance.y / sky[sky.len() / 2] / (LAMP / SKY);
    println!("lamp over sky {ratio:.2} of the truth");
    assert!((0.6..1.7).contains(&ratio), "{ratio}");
    assert!(spread(&with) < 0.7 * spread(&without));
    assert!(without.term("lamps").is_none() && without.lights[0].lamps.is_empty());
    // What a lamp sends hides what color it has when it is off.
    let whites = |d: &Found| {
        let white = |c: &&[f32; 3]| **c == [0.8; 3];
        d.surface.base_color_linear.iter().filter(white).count()
    };
    assert!(whites(&with) > 0 && whites(&without) == 0, "{}", whites(&with));

    // What no lamp stands for is found as light of the place.
    let local = decomposed(LAMP, off, Switch::On);
    assert_sound(&local);
    println!("local light: spread {:.3}", spread(&local));
    let term = local.term("local light").unwrap();
    let [without_it, with_it] = ["cost_without", "cost"].map(|name| term.numbers[name].unwrap());
    assert!(term.kept && with_it < 0.9 * without_it, "{term:?}");
    assert!(without.term("local light").is_none());
    assert!(spread(&local) < 0.7 * spread(&without));
}

#[test]
fn a_white_thing_that_is_only_overexposed_is_no_lamp() {
    // It sends what clips, and lights hardly anything.
    let d = decomposed(1.02, Switch::Auto, Switch::Auto);
    assert_sound(&d);
    assert!(d.lights[0].lamps.is_empty(), "{:?}", d.term("lamps"));
}
