//! Photos that show the sky: it is part of the light, and tells the scale.

use decompose::{Known, Photo, TracedSurface, ViewRays};
use glam::Vec3;
use motes_math::median::median;
use motes_scene::Switch;
use motes_shading::brdf::Material;
use motes_shading::environment::{Convention, Environment, MapOptions, Orientation, SunSky};

use super::scene::{base_color, photos_from, surface};
use super::{assert_sound, options, run_with};

/// Share of the usual base colors of this scene: dark ground, as lawn and asphalt are.
const DARK: f32 = 0.3;

/// A clear sky with its sun, for surfaces of these base colors.
fn clear_sky() -> Environment {
    let sky = SunSky { azimuth_deg: 70.0, elevation_deg: 40.0, ..SunSky::default() };
    let orientation = Orientation::new(Convention::Blender);
    let (map, sun) = sky.build(64, &MapOptions { exposure: 0.1, orientation }).expect("a sky");
    Environment::new(Some(map), Some(sun))
}

/// Shows the sky in what misses the surface above the horizon, clipped from `white` on.
fn with_sky(mut photo: Photo, light: &Environment, scene: &TracedSurface, white: f32) -> Photo {
    let rays = ViewRays::new(&photo);
    photo.clipped = vec![false; photo.usable.len()];
    let width = photo.camera.width;
    for (i, hit) in rays.hits(scene).iter().enumerate() {
        let d = rays.direction((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        if !hit.is_hit() && d.z > 0.0 {
            let radiance = light.radiance_pdf(d).0;
            photo.clipped[i] = radiance.max_element() >= white;
            photo.usable[i] = !photo.clipped[i];
            photo.radiance_linear.floats_mut()[i] = radiance.min(Vec3::splat(white)).to_array();
        }
    }
    photo
}

/// Median error of base colors, stops, where photos show the sky clipped from `white` on.
fn off(switch: Switch, white: f32) -> f64 {
    let scene = TracedSurface::new(surface()).expect("a mesh");
    let light = clear_sky();
    let of = |p: Vec3| Material::lambert(Vec3::splat(DARK * base_color(p)));
    let photos = photos_from(|k| 0.4 + 0.2 * f64::from(k % 3), &scene, &light, of);
    let photos: Vec<Photo> =
        photos.into_iter().map(|p| with_sky(p, &light, &scene, white)).collect();
    let mut options = options();
    options.model.sky = switch;
    options.refinement.photo_steps = 0;
    let d = run_with(&options, surface(), &photos, Known::default()).expect("a decomposition");
    assert_sound(&d);
    let found = d.surface.vertices.iter().zip(&d.surface.base_color_linear);
    let off = found.map(|(x, b)| f64::from((b[1] / (DARK * base_color(Vec3::from(*x)))).log2()));
    median(off).expect("vertices")
}

#[test]
fn a_sky_that_photos_show_tells_how_dark_the_ground_is() {
    let seen = off(Switch::Auto, f32::INFINITY);
    let unseen = off(Switch::Off, f32::INFINITY);
    println!("base colors off by {seen:.2} stops, with the sky unused by {unseen:.2}");
    assert!(seen.abs() < 0.35 && unseen > 0.8, "{seen} {unseen}");
    // Clipped in blue and green, and in all channels: the light is at least as bright as that.
    let [by_red, least] = [1.4, 0.8].map(|white| off(Switch::Auto, white));
    println!("clipped in part {by_red:.2}, all over {least:.2}");
    assert!(by_red.abs() < 0.35 && (-0.1..unseen - 0.2).contains(&least), "{by_red} {least}");
}
