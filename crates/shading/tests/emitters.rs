//! Light from surfaces that shine: the sampler, closed forms, the two paths against each other.

mod shapes;

use glam::{DVec3, Vec3};
use motes_math::rng::keyed_rng;
use motes_shading::brdf::Material;
use motes_shading::emitters::Emitters;
use motes_shading::environment::Environment;
use motes_shading::integrate::{
    IntegrationOptions, Shader, SurfacePoint, reference::emitted_radiance,
};
use motes_shading::tracing::{BuildQuality, MeshTracer, Ray, Tracer, TriangleMesh};
use rand::RngExt;
use shapes::{floor, joined, sphere};
use std::f64::consts::PI;

/// The square of [`floor`] turned to face down.
fn ceiling(half: f32, z: f32) -> TriangleMesh {
    let mut mesh = floor(half, z);
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

fn shining(mesh: &TriangleMesh, radiance: Vec3) -> (Emitters, MeshTracer) {
    let emission = vec![radiance; mesh.vertices.len()];
    let emitters = Emitters::new(mesh, &emission).expect("an emitter");
    (emitters, MeshTracer::new(mesh, BuildQuality::Fast).expect("a valid mesh"))
}

fn point(position: Vec3, material: Material) -> SurfacePoint {
    SurfacePoint {
        position,
        geometric_normal: Vec3::Z,
        shading_normal: Vec3::Z,
        to_viewer: Vec3::new(0.4, -0.3, 0.8).normalize(),
        material,
    }
}

/// Irradiance from a polygon of radiance 1 on a plane through `position` with normal +z: Lambert's formula, 1760.
fn irradiance(position: DVec3, corners: &[DVec3]) -> f64 {
    let toward: Vec<DVec3> = corners.iter().map(|c| (*c - position).normalize()).collect();
    let edges = (0..toward.len()).map(|i| (toward[i], toward[(i + 1) % toward.len()]));
    let sum: f64 = edges.map(|(a, b)| a.dot(b).acos() * a.cross(b).normalize_or_zero().z).sum();
    0.5 * sum.abs()
}

fn options(emitter_samples: u32, brdf_samples: u32) -> IntegrationOptions {
    IntegrationOptions {
        light_samples: 0,
        brdf_samples,
        emitter_samples,
        ..IntegrationOptions::default()
    }
}

/// Mean and standard error of the fast path over `runs` items.
fn fast<T: Tracer>(
    p: &SurfacePoint,
    emitters: &Emitters,
    tracer: &T,
    o: IntegrationOptions,
    runs: u64,
) -> (DVec3, DVec3) {
    let darkness = Environment::default();
    let shader = Shader::new(&darkness, tracer, None, o).with_emitters(Some(emitters));
    let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
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
fn points_are_spread_in_proportion_to_power() {
    // Two squares of area 4 and 1, of radiance 1 and 6: two fifths and three fifths of the points.
    let mesh = joined(ceiling(1.0, 2.0), &ceiling(0.5, 1.0));
    let emission: Vec<Vec3> = (0..8).map(|v| Vec3::splat(if v < 4 { 1.0 } else { 6.0 })).collect();
    let emitters = Emitters::new(&mesh, &emission).expect("emitters");
    let (n, side) = (40_000u32, 4usize);
    let mut counts = vec![0u32; 2 * side * side];
    let mut rng = keyed_rng(5, 0, 0);
    for _ in 0..n {
        let sample = emitters.sample(Vec3::ZERO, rng.random()).expect("in front");
        let at = sample.to_light * sample.distance;
        let (which, half) = if at.z > 1.5 { (0, 1.0) } else { (1, 0.5) };
        let bin = |v: f32| (((v / half + 1.0) * 0.5 * side as f32) as usize).min(side - 1);
        counts[(which * side + bin(at.y)) * side + bin(at.x)] += 1;
    }
    let share = |bin: usize| if bin < side * side { 0.4 } else { 0.6 } / (side * side) as f64;
    let chi_square: f64 = counts
        .iter()
        .enumerate()
        .map(|(bin, count)| {
            let expected = share(bin) * f64::from(n);
            (f64::from(*count) - expected).powi(2) / expected
        })
        .sum();
    // 31 degrees of freedom: 61.1 is passed by chance once in a thousand times.
    assert!(chi_square < 61.1, "chi-square {chi_square}: {counts:?}");
}

#[test]
fn a_lamp_over_a_floor_gives_the_irradiance_of_lambert() {
    let mesh = ceiling(0.7, 0.9);
    let (emitters, tracer) = shining(&mesh, Vec3::new(1.0, 2.0, 5.0));
    let corners: Vec<DVec3> = mesh.vertices.iter().map(|v| v.as_dvec3()).collect();
    for position in [Vec3::ZERO, Vec3::new(0.6, -0.2, 0.0), Vec3::new(2.0, 1.0, 0.3)] {
        let expected = irradiance(position.as_dvec3(), &corners) / PI * DVec3::new(1.0, 2.0, 5.0);
        let p = point(position, Material::lambert(Vec3::ONE));
        for o in [options(64, 0), options(0, 64), options(16, 16)] {
            let (mean, error) = fast(&p, &emitters, &tracer, o, 400);
            let off = (mean - expected).abs();
            assert!(
                off.cmple(5.0 * error + 1e-3 * expected).all(),
                "{position} {o:?}: {mean} +- {error} for {expected}"
            );
            let many = IntegrationOptions {
                emitter_samples: 200 * o.emitter_samples,
                brdf_samples: 200 * o.brdf_samples,
                ..o
            };
            let e = emitted_radiance(&p, &emitters, &tracer, &many, 3);
            let off = (e.total() - expected).abs();
            let allowed = 5.0 * e.variance.map(f64::sqrt) + 1e-3 * expected;
            assert!(off.cmple(allowed).all(), "reference {position}: {} {expected}", e.total());
        }
    }
}

#[test]
fn both_paths_agree_on_glossy_points_beside_a_ball_that_shines() {
    let ball = sphere(Vec3::new(0.3, 0.2, 0.8), 0.25, 12);
    let (emitters, tracer) = shining(&ball, Vec3::new(8.0, 5.0, 2.0));
    for (roughness, metallic) in [(0.15, 1.0), (0.4, 0.0), (1.0, 0.0)] {
        let material = Material::principled(Vec3::new(0.8, 0.5, 0.3), roughness, metallic);
        let p = point(Vec3::new(-0.2, 0.1, 0.0), material);
        let (mean, error) = fast(&p, &emitters, &tracer, options(32, 32), 500);
        let e = emitted_radiance(&p, &emitters, &tracer, &options(60_000, 60_000), 1);
        let allowed = 5.0 * (error + e.variance.map(f64::sqrt)) + 2e-3 * e.total();
        assert!(
            (mean - e.total()).abs().cmple(allowed).all(),
            "{roughness} {metallic}: {mean} {} allowed {allowed}",
            e.total()
        );
    }
}

#[test]
fn what_is_in_the_way_throws_a_shadow_and_both_sides_shine() {
    let lamp = ceiling(0.5, 2.0);
    let screen = ceiling(3.0, 1.0);
    let mesh = joined(lamp, &screen);
    let emission: Vec<Vec3> = (0..8).map(|v| if v < 4 { Vec3::ONE } else { Vec3::ZERO }).collect();
    let emitters = Emitters::new(&mesh, &emission).expect("an emitter");
    let tracer = MeshTracer::new(&mesh, BuildQuality::Fast).expect("a valid mesh");
    let white = Material::lambert(Vec3::ONE);
    assert_eq!(emitters.len(), 2);
    assert!(emitters.shines(0) && !emitters.shines(2) && !emitters.shines(99));
    for (position, is_lit) in
        [(Vec3::ZERO, false), (Vec3::new(0.0, 0.0, 1.5), true), (Vec3::new(0.0, 0.0, 2.5), false)]
    {
        // The last looks away from the lamp.
        let (mean, _) = fast(&point(position, white), &emitters, &tracer, options(32, 32), 20);
        assert_eq!(mean.x > 0.0, is_lit, "{position}: {mean}");
    }
    let (down, up) =
        (emitters.radiance_pdf(0, -Vec3::Z, 1.0), emitters.radiance_pdf(0, Vec3::Z, 1.0));
    assert_eq!((down, down.is_some()), (up, true));
    assert!(emitters.radiance_pdf(0, Vec3::X, 1.0).is_none(), "edge-on");
}

#[test]
fn nothing_that_is_black_broken_or_without_area_is_an_emitter() {
    let mesh = floor(1.0, 0.0);
    assert!(Emitters::new(&mesh, &[Vec3::ZERO; 4]).is_none());
    assert!(Emitters::new(&mesh, &[]).is_none());
    assert!(Emitters::new(&mesh, &[Vec3::NAN; 4]).is_none());
    let flat = TriangleMesh { vertices: vec![Vec3::ONE; 3], triangles: vec![[0, 1, 2]] };
    assert!(Emitters::new(&flat, &[Vec3::ONE; 3]).is_none());
    let tiny = floor(1e-18, 1e-18);
    if let Some(emitters) = Emitters::new(&tiny, &[Vec3::splat(1e30); 4]) {
        let sample = emitters.sample(Vec3::new(0.0, 0.0, 1.0), [7, 1 << 31, 1 << 30]);
        assert!(sample.is_none_or(|s| s.pdf.is_finite() && s.to_light.is_finite()));
    }
}

#[test]
fn light_of_emitters_and_reflected_light_add_up() {
    // Inside a closed white ball that shines with 1 and reflects what `indirect` says: 0.5.
    let mut room = sphere(Vec3::ZERO, 1.0, 16);
    room.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let (emitters, tracer) = shining(&room, Vec3::ONE);
    let darkness = Environment::default();
    let half = |_: &Ray, _: &motes_shading::tracing::Hit| Vec3::splat(0.5);
    let shader = Shader::new(&darkness, &tracer, Some(&half), options(64, 64))
        .with_emitters(Some(&emitters));
    let p = point(Vec3::new(0.1, 0.0, -0.2), Material::lambert(Vec3::ONE));
    let shaded: Vec<_> = (0..300).map(|item| shader.shade_point(&p, item)).collect();
    let mean = |of: &dyn Fn(usize) -> f32| (0..300).map(of).sum::<f32>() / 300.0;
    let (direct, indirect) = (mean(&|i| shaded[i].diffuse.x), mean(&|i| shaded[i].indirect.x));
    assert!((direct - 1.0).abs() < 0.01, "{direct}");
    assert!((indirect - 0.5).abs() < 0.01, "{indirect}");
}
