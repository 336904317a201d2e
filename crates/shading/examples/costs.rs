//! What the pieces of image formation cost on one core, in nanoseconds of CPU time.
//!
//! `cargo run --release -p motes-shading --example costs`

#![allow(clippy::print_stdout, reason = "a table is what it is for")]

use std::hint::black_box;

use glam::Vec3;
use motes_shading::brdf::{Brdf, Material};
use motes_shading::environment::{Convention, Environment, MapOptions, Orientation, SunSky};
use motes_shading::integrate::{IntegrationOptions, Shader, SurfacePoint};
use motes_shading::sampling::PointSet;
use motes_shading::tracing::{BuildQuality, MeshTracer, Ray, Tracer, TriangleMesh, offset_origin};
use nix::sys::resource::{UsageWho, getrusage};

/// CPU seconds of this thread so far.
fn cpu_seconds() -> f64 {
    let usage = getrusage(UsageWho::RUSAGE_THREAD).expect("the kernel counts");
    let seconds = |t: nix::sys::time::TimeVal| t.tv_sec() as f64 + 1e-6 * t.tv_usec() as f64;
    seconds(usage.user_time()) + seconds(usage.system_time())
}

/// The fastest of five repetitions, per item: other programs only ever add time.
fn nanoseconds<T>(items: u32, mut work: impl FnMut(u32) -> T) -> f64 {
    let mut once = || {
        let start = cpu_seconds();
        for i in 0..items {
            black_box(work(i));
        }
        (cpu_seconds() - start) * 1e9 / f64::from(items)
    };
    (0..5).map(|_| once()).fold(f64::INFINITY, f64::min)
}

/// A bumpy sphere on a floor, `4 n²` triangles and two: nothing is hidden from all sides.
fn scene(n: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for i in 0..=n {
        for j in 0..2 * n {
            let theta = std::f32::consts::PI * i as f32 / n as f32;
            let phi = std::f32::consts::PI * j as f32 / n as f32;
            let bump = 1.0 + 0.1 * (9.0 * theta).sin() * (7.0 * phi).sin();
            let d = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            mesh.vertices.push(d * (0.3 * bump) + Vec3::Z * 0.3);
        }
    }
    for i in 0..n {
        for j in 0..2 * n {
            let k = (j + 1) % (2 * n);
            let (a, b) = (i * 2 * n + j, i * 2 * n + k);
            mesh.triangles.push([a, a + 2 * n, b]);
            mesh.triangles.push([b, a + 2 * n, b + 2 * n]);
        }
    }
    let first = mesh.vertices.len() as u32;
    mesh.vertices
        .extend([(-5., -5.), (5., -5.), (5., 5.), (-5., 5.)].map(|(x, y)| Vec3::new(x, y, 0.0)));
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    mesh
}

fn main() {
    const N: u32 = 1_000_000;
    let points = PointSet::new(1, 2, 3, 64);
    println!("sample point         {:7.1}", nanoseconds(N, |i| points.point(i & 63)));

    let material = Material::principled(Vec3::new(0.8, 0.5, 0.2), 0.4, 0.2);
    let to_viewer = Vec3::new(0.3, 0.2, 0.9).normalize();
    let directions: Vec<Vec3> = (0..1024u32)
        .map(|i| {
            let (z, phi) = ((i as f32 + 0.5) / 1024.0, 2.4 * i as f32);
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * phi.cos(), r * phi.sin(), z)
        })
        .collect();
    let d = |i: u32| directions[(i.wrapping_mul(613) & 1023) as usize];
    black_box(Brdf::new(&material, Vec3::Z, to_viewer));
    let prepare = nanoseconds(N, |i| Brdf::new(&material, Vec3::Z, d(i)));
    println!("BRDF preparation     {prepare:7.1}");
    let brdf = Brdf::new(&material, Vec3::Z, to_viewer);
    println!("BRDF eval and pdf    {:7.1}", nanoseconds(N, |i| brdf.eval_pdf(d(i))));
    let u: Vec<[f32; 3]> =
        (0..1024u32).map(|i| points.point(i).map(motes_shading::sampling::unit_f32)).collect();
    let draw = nanoseconds(N, |i| brdf.sample(u[(i & 1023) as usize]));
    println!("BRDF sample          {draw:7.1}");

    let (map, sun) = SunSky::default()
        .build(
            128,
            &MapOptions { orientation: Orientation::new(Convention::Blender), exposure: 0.1 },
        )
        .expect("a valid sky");
    let light = Environment::new(Some(map), Some(sun));
    println!("light look-up and pdf{:7.1}", nanoseconds(N, |i| light.radiance_pdf(d(i))));
    let bits: Vec<[u32; 3]> = (0..1024).map(|i| points.point(i)).collect();
    let draw = nanoseconds(N, |i| light.sample(bits[(i & 1023) as usize]));
    println!("light sample         {draw:7.1}");

    for (n, quality) in [
        (50, BuildQuality::Balanced),
        (200, BuildQuality::Fast),
        (200, BuildQuality::Balanced),
        (200, BuildQuality::High),
        (350, BuildQuality::Balanced),
    ] {
        let mesh = scene(n);
        let start = cpu_seconds();
        let tracer = MeshTracer::new(&mesh, quality).expect("indices are valid");
        let build = cpu_seconds() - start;
        let points = picture(&tracer, &material);
        // 64 directions from every 16th pixel, in the order of the picture.
        let spread: Vec<Vec3> = (0..64).map(|i| d(16 * i)).collect();
        let ray = |i: u32| {
            let p = &points[(i / 64 * 16) as usize % points.len()];
            let w = spread[(i & 63) as usize];
            let n = p.geometric_normal;
            let w = if w.dot(n) < 0.0 { -w } else { w };
            Ray::new(offset_origin(p.position, n, w, 1e-4), w)
        };
        let rays = points.len() as u32 / 16 * 64;
        let base = nanoseconds(rays, ray);
        let any = nanoseconds(rays, |i| tracer.occluded(&ray(i))) - base;
        let near = nanoseconds(rays, |i| tracer.closest_hit(&ray(i))) - base;
        let blocked = (0..rays).filter(|&i| tracer.occluded(&ray(i))).count();
        println!(
            "{:7} triangles, {quality:?}: built in {build:.2} s; shadow ray {any:.0}, closest hit {near:.0}, {:.0} % blocked",
            mesh.triangles.len(),
            100.0 * blocked as f64 / f64::from(rays)
        );
        if n == 200 && quality == BuildQuality::Balanced {
            whole_view(&points, &light, &tracer);
        }
    }
}

/// What a camera of 480 x 360 sees of the scene.
fn picture(tracer: &MeshTracer, material: &Material) -> Vec<SurfacePoint> {
    let eye = Vec3::new(0.0, -1.5, 1.2);
    let forward = (Vec3::new(0.0, 0.0, 0.2) - eye).normalize();
    let right = forward.cross(Vec3::Z).normalize();
    let down = forward.cross(right);
    let pixels = (0..360).flat_map(|y| (0..480).map(move |x| (x as f32, y as f32)));
    pixels
        .filter_map(|(x, y)| {
            let d = (forward + right * ((x - 240.0) / 515.0) + down * ((y - 180.0) / 515.0))
                .normalize();
            let ray = Ray::new(eye, d);
            let hit = tracer.closest_hit(&ray)?;
            Some(SurfacePoint {
                position: ray.at(hit.distance),
                geometric_normal: hit.geometric_normal,
                shading_normal: hit.geometric_normal,
                to_viewer: -d,
                material: *material,
            })
        })
        .collect()
}

/// CPU seconds per picture on one thread.
fn whole_view(points: &[SurfacePoint], light: &Environment, tracer: &MeshTracer) {
    for (light_samples, brdf_samples) in [(16, 4), (64, 16), (64, 32), (256, 64)] {
        let options = IntegrationOptions {
            light_samples,
            brdf_samples,
            ray_bias: 1e-4,
            ..IntegrationOptions::default()
        };
        let shader = Shader::new(light, tracer, None, options);
        let start = cpu_seconds();
        let noise: f64 = points
            .iter()
            .enumerate()
            .map(|(i, p)| f64::from(shader.shade_point(p, i as u64).variance))
            .sum::<f64>()
            / points.len() as f64;
        let seconds = cpu_seconds() - start;
        println!(
            "        view of {} pixels, {light_samples} + {brdf_samples} samples: {seconds:.2} CPU s, {:.0} ns per sample, noise {:.3}",
            points.len(),
            seconds * 1e9 / points.len() as f64 / f64::from(light_samples + brdf_samples),
            noise.sqrt()
        );
    }
}
