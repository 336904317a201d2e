//! What the pieces of image formation cost on one core, in nanoseconds of CPU time.
//!
//! `cargo run --release -p motes-shading --example costs`

#![allow(clippy::print_stdout, reason = "a table is what it is for")]

use std::hint::black_box;

use glam::Vec3;
use motes_shading::brdf::{Brdf, Material};
use motes_shading::environment::{Environment, MapOptions, SunSky};
use motes_shading::sampling::PointSet;
use motes_shading::tracing::{BuildQuality, MeshTracer, Ray, Tracer, TriangleMesh};
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
    const N: u32 = 200_000;
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
    let derivatives = nanoseconds(N, |i| brdf.eval_with_derivatives(d(i)));
    println!("BRDF with derivatives{derivatives:7.1}");
    let u: Vec<[f32; 3]> =
        (0..1024u32).map(|i| points.point(i).map(motes_shading::sampling::unit_f32)).collect();
    let draw = nanoseconds(N, |i| brdf.sample(u[(i & 1023) as usize]));
    println!("BRDF sample          {draw:7.1}");

    let (map, sun) = SunSky::default().build(128, &MapOptions::default()).expect("a valid sky");
    let light = Environment::new(Some(map), Some(sun));
    println!("light look-up and pdf{:7.1}", nanoseconds(N, |i| light.radiance_pdf(d(i))));
    let bits: Vec<[u32; 3]> = (0..1024).map(|i| points.point(i)).collect();
    let draw = nanoseconds(N, |i| light.sample(bits[(i & 1023) as usize]));
    println!("light sample         {draw:7.1}");

    for (n, quality) in [
        (50, BuildQuality::Balanced),
        (200, BuildQuality::Balanced),
        (350, BuildQuality::Fast),
        (350, BuildQuality::Balanced),
        (350, BuildQuality::High),
    ] {
        let mesh = scene(n);
        let start = cpu_seconds();
        let tracer = MeshTracer::new(&mesh, quality).expect("indices are valid");
        let build = cpu_seconds() - start;
        // Half of the points on the floor round the sphere, half on the sphere.
        let origin = |i: u32| {
            let w = d(i.wrapping_mul(977));
            let p = mesh.vertices
                [(i.wrapping_mul(2_654_435_761) % (mesh.vertices.len() as u32 - 4)) as usize];
            if i & 64 == 0 { Vec3::new(w.x, w.y, 1e-4) } else { p + (p - Vec3::Z * 0.3) * 1e-3 }
        };
        // Blocks of 64 rays from one point, as shading sends them.
        let ray = |i: u32| Ray::new(origin(i / 64 * 7 + (i & 64)), d(i));
        let base = nanoseconds(N, ray);
        let any = nanoseconds(N, |i| tracer.occluded(&ray(i))) - base;
        let near = nanoseconds(N, |i| tracer.closest_hit(&ray(i))) - base;
        let blocked = (0..N).filter(|&i| tracer.occluded(&ray(i))).count() as f64 / f64::from(N);
        println!(
            "{:7} triangles, {quality:?}: built in {build:.2} s; shadow ray {any:.1}, closest hit {near:.1}, {:.0} % blocked",
            mesh.triangles.len(),
            100.0 * blocked
        );
    }
}
