//! The rendering equation: closed forms, the two paths against each other, convergence.

mod shapes;

use glam::{DVec3, Vec3};
use motes_scene::ImageF32;
use motes_shading::brdf::{Brdf, Material};
use motes_shading::environment::{
    Environment, EnvironmentMap, MapOptions, SunDisc, direction_from_uv, irradiance,
};
use motes_shading::integrate::{
    Heuristic, IntegrationOptions, Shader, SurfacePoint, reference::outgoing_radiance,
};
use motes_shading::tracing::{
    BuildQuality, Empty, Hit, MeshTracer, Plane, Ray, Shapes, Sphere, Tracer,
};
use shapes::{floor, joined, sphere};
use std::f64::consts::PI;

fn point(material: Material) -> SurfacePoint {
    SurfacePoint {
        position: Vec3::new(0.2, 0.1, 0.0),
        geometric_normal: Vec3::Z,
        shading_normal: Vec3::Z,
        to_viewer: Vec3::new(0.4, -0.3, 0.8).normalize(),
        material,
    }
}

fn map_light(image: &ImageF32) -> Environment {
    let map = EnvironmentMap::new(image, &MapOptions::default()).expect("a valid map");
    Environment::new(Some(map), None)
}

fn uniform(radiance: f32) -> Environment {
    map_light(&ImageF32::filled(16, 8, 3, radiance))
}

/// A sky with structure: smooth colors and a bright patch.
fn patchy() -> Environment {
    let (w, h) = (64, 32);
    let mut image = ImageF32::filled(w, h, 3, 0.0);
    for y in 0..h {
        for x in 0..w {
            let d = direction_from_uv((x as f64 + 0.5) / w as f64, (y as f64 + 0.5) / h as f64);
            let patch = if (d - DVec3::new(0.5, 0.2, 0.84)).length() < 0.25 { 30.0 } else { 0.0 };
            let c = [0.5 + 0.3 * d.x + patch, 0.6 + 0.2 * d.y + patch, 0.7 - 0.4 * d.z + patch];
            image.pixel_mut(x, y).copy_from_slice(&c.map(|v| v as f32));
        }
    }
    map_light(&image)
}

fn options(light_samples: u32, brdf_samples: u32, seed: u64) -> IntegrationOptions {
    IntegrationOptions { light_samples, brdf_samples, seed, ..IntegrationOptions::default() }
}

/// Mean and its standard error over `runs` seeds of the fast path.
fn fast_mean<T: Tracer>(
    p: &SurfacePoint,
    light: &Environment,
    tracer: &T,
    o: IntegrationOptions,
    runs: u64,
) -> (DVec3, DVec3) {
    let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
    let shader = Shader::new(light, tracer, None, o);
    for item in 0..runs {
        let c = shader.shade_point(p, item).total().as_dvec3();
        sum += c;
        squares += c * c;
    }
    let n = runs as f64;
    let mean = sum / n;
    (mean, ((squares / n - mean * mean).max(DVec3::ZERO) / (n - 1.0)).map(f64::sqrt))
}

#[test]
fn lambert_under_uniform_light_is_its_base_color() {
    let p = point(Material::lambert(Vec3::new(0.9, 0.5, 0.1)));
    let light = uniform(2.0);
    let expected = DVec3::new(1.8, 1.0, 0.2);
    let e = outgoing_radiance(&p, &light, &Empty, None, &options(4096, 4096, 1), 0);
    let z = ((e.total() - expected) / e.variance.map(f64::sqrt)).abs().max_element();
    assert!(z < 4.0, "z {z}");
    assert_eq!(e.visibility, 1.0);
    let (mean, _) = fast_mean(&p, &light, &Empty, options(64, 64, 1), 200);
    assert!((mean - expected).abs().max_element() < 0.01 * 1.8, "{mean}");
}

#[test]
fn a_white_material_in_a_white_furnace_vanishes() {
    for (roughness, metallic) in [(0.0, 1.0), (0.3, 0.0), (0.7, 1.0), (1.0, 0.0)] {
        let p = point(Material::principled(Vec3::ONE, roughness, metallic));
        let (mean, error) = fast_mean(&p, &uniform(1.0), &Empty, options(64, 64, 2), 400);
        let off = (mean.x - 1.0).abs();
        // 0.0045: the furnace error of the albedo table.
        assert!(off < 0.0045 + 4.0 * error.x, "{roughness} {metallic}: {mean} +- {error}");
    }
}

#[test]
fn lambert_under_smooth_light_has_the_irradiance_of_its_harmonics() {
    // Light of degree 1 exactly: E = π (c0 + 2/3 c1 · n).
    let (w, h) = (512, 256);
    let mut image = ImageF32::filled(w, h, 3, 0.0);
    for y in 0..h {
        for x in 0..w {
            let d = direction_from_uv((x as f64 + 0.5) / w as f64, (y as f64 + 0.5) / h as f64);
            let c = [1.0 + 0.5 * d.x, 1.0 + 0.5 * d.y, 1.0 + 0.5 * d.z];
            image.pixel_mut(x, y).copy_from_slice(&c.map(|v| v as f32));
        }
    }
    let light = map_light(&image);
    let mut p = point(Material::lambert(Vec3::ONE));
    let n = DVec3::new(0.36, 0.48, 0.8);
    (p.shading_normal, p.geometric_normal) = (n.as_vec3(), n.as_vec3());
    let exact = DVec3::ONE + n / 3.0;
    let harmonic = irradiance(&light.harmonics(), n) / PI;
    assert!((harmonic - exact).length() < 1e-3, "{harmonic} {exact}");
    let e = outgoing_radiance(&p, &light, &Empty, None, &options(20_000, 20_000, 3), 0);
    let z = ((e.total() - exact) / e.variance.map(f64::sqrt)).abs().max_element();
    assert!(z < 4.0, "z {z}");
}

#[test]
fn a_mirror_shows_what_is_in_the_direction_of_reflection() {
    let light = map_light(&{
        let mut image = ImageF32::filled(64, 32, 3, 0.0);
        for (i, v) in image.data.iter_mut().enumerate() {
            *v = ((i / 3) % 64) as f32 * 0.1 + ((i / 3) / 64) as f32 * 0.03;
        }
        image
    });
    let p = point(Material::principled(Vec3::new(0.9, 0.6, 0.3), 0.0, 1.0));
    let brdf = Brdf::new(&p.material, p.shading_normal, p.to_viewer);
    let reflected = 2.0 * brdf.normal().dot(p.to_viewer) * brdf.normal() - p.to_viewer;
    let c = 1.0 - f64::from(p.to_viewer.z);
    let f0 = p.material.base_color_linear.as_dvec3();
    let expected = light.radiance_pdf(reflected).0.as_dvec3() * (f0 + (1.0 - f0) * c.powi(5));
    let (mean, _) = fast_mean(&p, &light, &Empty, options(16, 64, 4), 100);
    let error = ((mean - expected) / expected).abs().max_element();
    assert!(error < 0.01, "{mean} {expected}");
}

#[test]
fn a_small_sun_lights_by_its_cosine_and_casts_a_soft_shadow() {
    let to_sun = Vec3::new(0.3, 0.0, 0.95).normalize();
    let sun = SunDisc::new(to_sun, 0.02, Vec3::splat(1000.0));
    let light = Environment::new(None, Some(sun));
    let p = point(Material::lambert(Vec3::ONE));
    // E = L Ω cos: for a disc of radius r wholly above the horizon, L π sin²r cos exactly.
    let e = 1000.0 * PI * 0.02f64.sin().powi(2) * f64::from(to_sun.z);
    let (mean, _) = fast_mean(&p, &light, &Empty, options(64, 16, 5), 20);
    assert!((mean.x - e / PI).abs() < 2e-3 * e / PI, "{mean} {}", e / PI);

    // A half plane's edge through the disc's center hides half of it. A plane through the point's
    // ray to the sun, vertical across: shapes are two-sided and infinite, so a big sphere
    // tangent to that ray stands for the half plane.
    let side = to_sun.cross(Vec3::Y).normalize().as_dvec3();
    let radius = 2000.0;
    let center = p.position.as_dvec3() + to_sun.as_dvec3() * 3000.0 + side * radius;
    let shapes = Shapes { spheres: vec![Sphere { center, radius }], planes: vec![] };
    let (mean, error) = fast_mean(&p, &light, &shapes, options(64, 16, 6), 200);
    let half = 0.5 * e / PI;
    assert!((mean.x - half).abs() < 0.02 * half + 4.0 * error.x, "{mean} {half}");
    let v = outgoing_radiance(&p, &light, &shapes, None, &options(4000, 0, 1), 0).visibility;
    assert!((v - 0.5).abs() < 0.05, "{v}");
}

#[test]
fn blocked_light_is_gone_and_comes_back_as_what_was_hit() {
    // Under a plane: no direct light; the indirect is the base color times what the plane sends.
    let plane = Plane { point: DVec3::Z, normal: DVec3::NEG_Z };
    let shapes = Shapes { planes: vec![plane], ..Shapes::default() };
    let p = point(Material::lambert(Vec3::new(0.8, 0.4, 0.2)));
    let light = uniform(5.0);
    let l_hit = |ray: &Ray, hit: &Hit| {
        assert!((ray.at(hit.distance).z - 1.0).abs() < 1e-3);
        Vec3::splat(3.0)
    };
    let o = options(64, 64, 7);
    let s = Shader::new(&light, &shapes, Some(&l_hit), o).shade_point(&p, 0);
    assert_eq!((s.diffuse, s.specular, s.visibility), (Vec3::ZERO, Vec3::ZERO, 0.0));
    assert!((s.indirect - Vec3::new(2.4, 1.2, 0.6)).length() < 1e-3, "{}", s.indirect);
    let e = outgoing_radiance(&p, &light, &shapes, Some(&l_hit), &o, 0);
    assert!((e.indirect - DVec3::new(2.4, 1.2, 0.6)).length() < 1e-6);
    assert!(Shader::new(&light, &shapes, None, o).shade_point(&p, 0).total() == Vec3::ZERO);
}

/// A ball over a floor, seen from the floor beside it: light, shadow, all lobes.
fn scene() -> MeshTracer {
    let mesh = joined(sphere(Vec3::new(0.6, 0.2, 0.5), 0.4, 40), &floor(5.0, -1e-4));
    MeshTracer::new(&mesh, BuildQuality::Balanced).expect("a valid mesh")
}

#[test]
fn fast_and_reference_have_the_same_mean() {
    let tracer = scene();
    let light = patchy();
    for heuristic in [Heuristic::Balance, Heuristic::Power] {
        for (roughness, metallic) in [(0.1, 1.0), (0.4, 0.0), (0.9, 0.3)] {
            let p = point(Material::principled(Vec3::new(0.8, 0.5, 0.2), roughness, metallic));
            let o = IntegrationOptions { heuristic, ..options(64, 32, 8) };
            let (mean, error) = fast_mean(&p, &light, &tracer, o, 600);
            let many = IntegrationOptions { light_samples: 60_000, brdf_samples: 30_000, ..o };
            let e = outgoing_radiance(&p, &light, &tracer, None, &many, 0);
            let z = (mean - e.total()) / (error * error + e.variance).map(f64::sqrt);
            println!("{heuristic:?} {roughness} {metallic}: {mean} {} z {z}", e.total());
            assert!(z.abs().max_element() < 4.0, "z {z}");
        }
    }
}

#[test]
fn the_reference_knows_its_own_noise() {
    let (tracer, light) = (scene(), patchy());
    let p = point(Material::principled(Vec3::new(0.8, 0.5, 0.2), 0.3, 0.2));
    let runs = 400;
    let (mut sum, mut squares, mut claimed) = (0.0, 0.0, 0.0);
    for item in 0..runs {
        let e = outgoing_radiance(&p, &light, &tracer, None, &options(32, 16, 9), item);
        sum += e.total().y;
        squares += e.total().y.powi(2);
        claimed += e.variance.y;
    }
    let n = runs as f64;
    let actual = (squares - sum * sum / n) / (n - 1.0);
    // The variance of a variance from 400 runs: within a quarter.
    let ratio = claimed / n / actual;
    assert!((0.75..1.33).contains(&ratio), "claimed over actual {ratio}");
}

#[test]
fn the_fast_path_claims_no_less_noise_than_it_has() {
    let (tracer, light) = (scene(), patchy());
    for roughness in [0.15, 0.6] {
        let p = point(Material::principled(Vec3::splat(0.5), roughness, 0.2));
        let shader = Shader::new(&light, &tracer, None, options(64, 16, 15));
        let runs = 600;
        let (mut sum, mut squares, mut claimed) = (0.0, 0.0, 0.0);
        for item in 0..runs {
            let s = shader.shade_point(&p, item);
            let y = f64::from(s.total().element_sum()) / 3.0;
            sum += y;
            squares += y * y;
            claimed += f64::from(s.variance);
        }
        let n = runs as f64;
        let ratio = claimed / n / ((squares - sum * sum / n) / (n - 1.0));
        println!("roughness {roughness}: claimed over actual variance {ratio:.2}");
        assert!((0.9..20.0).contains(&ratio), "{ratio}");
    }
}

#[test]
fn the_error_falls_with_the_root_of_the_samples_and_faster_when_stratified() {
    let (tracer, light) = (scene(), patchy());
    let p = point(Material::principled(Vec3::new(0.8, 0.5, 0.2), 0.5, 0.0));
    let spread = |n: u32, fast: bool| {
        let runs = 300;
        let (mut sum, mut squares) = (0.0, 0.0);
        let shader = Shader::new(&light, &tracer, None, options(n, n, 10));
        for item in 0..runs {
            let y = if fast {
                f64::from(shader.shade_point(&p, item).total().y)
            } else {
                outgoing_radiance(&p, &light, &tracer, None, &options(n, n, 10), item).total().y
            };
            sum += y;
            squares += y * y;
        }
        let n = runs as f64;
        ((squares - sum * sum / n) / (n - 1.0)).sqrt()
    };
    let order = |fast| (spread(8, fast) / spread(256, fast)).log2() / 5.0;
    let (slow, fast) = (order(false), order(true));
    println!("order of convergence: reference {slow:.3}, fast {fast:.3}");
    assert!((0.42..0.58).contains(&slow), "reference {slow}");
    assert!(fast > 0.5, "fast {fast}");
}

#[test]
fn light_alone_and_brdf_alone_agree_with_both() {
    let light = patchy();
    let p = point(Material::principled(Vec3::new(0.8, 0.5, 0.2), 0.5, 0.0));
    let run = |l, b| outgoing_radiance(&p, &light, &Empty, None, &options(l, b, 11), 0);
    let both = run(40_000, 40_000);
    for e in [run(100_000, 0), run(0, 100_000)] {
        let z = (e.total() - both.total()) / (e.variance + both.variance).map(f64::sqrt);
        assert!(z.abs().max_element() < 4.0, "z {z}");
    }
}

#[test]
fn the_threads_do_not_matter() {
    let (tracer, light) = (scene(), patchy());
    let points: Vec<SurfacePoint> = (0..500)
        .map(|i| SurfacePoint {
            position: Vec3::new((i % 25) as f32 * 0.1 - 1.0, (i / 25) as f32 * 0.1 - 1.0, 0.0),
            ..point(Material::principled(Vec3::splat(0.5), 0.4, 0.0))
        })
        .collect();
    let shader = Shader::new(&light, &tracer, None, options(16, 8, 12));
    let threads = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| shader.shade(&points, 0))
    };
    let one = threads(1);
    assert_eq!(one, threads(3));
    assert_eq!(one[100..], shader.shade(&points[100..], 100));
    assert!(one.iter().any(|s| s.visibility < 0.9) && one.iter().any(|s| s.visibility > 0.99));
}

#[test]
fn incident_light_adds_up_to_the_shading() {
    let (tracer, light) = (scene(), patchy());
    let p = point(Material::principled(Vec3::new(0.8, 0.5, 0.2), 0.4, 0.1));
    let shader = Shader::new(&light, &tracer, None, options(64, 16, 13));
    let brdf = Brdf::new(&p.material, p.shading_normal, p.to_viewer);
    let sum: Vec3 = shader
        .incident_light(&p, 3)
        .iter()
        .map(|i| brdf.eval_pdf(i.to_light).0.total() * i.weighted_radiance)
        .sum();
    let shaded = shader.shade_point(&p, 3).total();
    assert!((sum - shaded).length() < 1e-5 * shaded.length(), "{sum} {shaded}");
}

#[test]
fn shadows_of_a_point_serve_every_material_and_side() {
    let (tracer, light) = (scene(), patchy());
    let bounce = |_: &Ray, _: &Hit| Vec3::splat(0.3);
    let shader = Shader::new(&light, &tracer, Some(&bounce), options(64, 16, 13));
    let seen = point(Material::principled(Vec3::splat(0.5), 0.6, 0.0));
    let shadows = shader.shadows(&seen, 5);
    for (roughness, metallic, x) in [(0.05, 0.0, 0.0), (0.4, 1.0, 0.7), (0.9, 0.2, -0.9)] {
        let p = SurfacePoint {
            material: Material::principled(Vec3::splat(0.8), roughness, metallic),
            to_viewer: Vec3::new(x, 0.1, 1.0).normalize(),
            ..seen
        };
        assert_eq!(shader.incident_light_with(&p, 5, &shadows), shader.incident_light(&p, 5));
    }
    assert_ne!(shadows, shader.shadows(&seen, 6), "another item has other directions");
}

#[test]
fn extremes_stay_finite() {
    let mut one_pixel = ImageF32::filled(64, 32, 3, 0.0);
    one_pixel.pixel_mut(11, 5).fill(1e6);
    let lights = [
        Environment::default(),
        map_light(&ImageF32::filled(2, 1, 3, 0.0)),
        map_light(&ImageF32::filled(1, 2, 3, 1.0)),
        map_light(&one_pixel),
        Environment::new(None, Some(SunDisc::new(Vec3::Z, 4.65e-3, Vec3::splat(1e9)))),
    ];
    let grazing = Vec3::new(1.0, 0.0, 1e-4).normalize();
    for light in &lights {
        for roughness in [0.0, 1.0] {
            for metallic in [0.0, 1.0] {
                for base in [0.0, 1.0] {
                    for to_viewer in [Vec3::Z, grazing, -Vec3::Z] {
                        let material = Material::principled(Vec3::splat(base), roughness, metallic);
                        let p = SurfacePoint { to_viewer, ..point(material) };
                        let o = options(32, 32, 14);
                        let s = Shader::new(light, &Empty, None, o).shade_point(&p, 0);
                        assert!(s.total().is_finite() && s.total().min_element() >= 0.0);
                        assert!(s.visibility.is_finite() && s.variance.is_finite());
                        let e = outgoing_radiance(&p, light, &Empty, None, &o, 0);
                        assert!(e.total().is_finite() && e.variance.is_finite());
                        if to_viewer.z < 0.0 || light.is_black() {
                            assert_eq!(s.total(), Vec3::ZERO);
                        }
                    }
                }
            }
        }
    }
}
