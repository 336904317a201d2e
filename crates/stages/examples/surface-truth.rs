//! Extracts a surface from a capture and its Gaussians and compares it, at the held-out views,
//! with depth and normals of a ground-truth folder (`aov/<view>_{depth,normal}.exr`, `<view>_id.png`).
//!
//! `cargo run --release -p motes-stages --example surface-truth -- --capture capture.json --gaussians g.ply --truth DIR`

#![allow(clippy::print_stdout, reason = "its output is what it is for")]

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use clap::Parser;
use glam::Vec3;
use motes_formats::capture::{read_capture, resolve};
use motes_formats::exr_aov::open_exr;
use motes_formats::images::{read_image, write_png};
use motes_formats::ply::read_gaussians;
use motes_inverse::Photo;
use motes_inverse::geometry::{GeometryOptions, extract};
use motes_math::srgb;
use motes_scene::{Capture, ImageF32, ImageU8, Split, Surface};
use motes_shading::tracing::{BuildQuality, MeshTracer, Ray, Tracer, TriangleMesh};

#[derive(Parser)]
struct Args {
    #[arg(long)]
    capture: PathBuf,
    #[arg(long)]
    gaussians: PathBuf,
    /// Folder of the truth; without it only the pictures are written
    #[arg(long)]
    truth: Option<PathBuf>,
    /// Folder for the mesh and pictures of its normals (truth, surface, error up to 30 degrees)
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Use only every n-th photo
    #[arg(long, default_value_t = 1)]
    every: usize,
    #[command(flatten)]
    geometry: GeometryOptions,
}

fn photo(capture: &Capture, document: &Path, view: usize) -> anyhow::Result<Photo> {
    let v = &capture.views[view];
    let image = read_image(&resolve(document, &v.image))?;
    let gain = capture.exposure_gain(view);
    let camera = capture.cameras[v.camera].as_pinhole().expect("a pinhole camera");
    let data = image
        .data
        .chunks_exact(image.channels)
        .flat_map(|p| {
            [0, 1, 2].map(|c: usize| {
                srgb::decode(f32::from(p[c.min(image.channels - 1)]) / 255.0 / gain)
            })
        })
        .collect();
    let weight = image
        .data
        .chunks_exact(image.channels)
        .map(|p| f32::from(u8::from(p.iter().all(|&v| v < 255))))
        .collect();
    let (w, h) = (image.width, image.height);
    Ok(Photo {
        light: 0,
        name: v.name.clone(),
        camera: camera.resized(w, h),
        camera_from_world: v.camera_from_world,
        radiance_linear: ImageF32::from_data(w, h, 3, data),
        weight: ImageF32::from_data(w, h, 1, weight),
    })
}

#[derive(Default, Clone)]
struct Score {
    pixels: usize,
    missed: usize,
    off: usize,
    near: usize,
    far: usize,
    degrees: Vec<f32>,
    depth: Vec<f32>,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let capture = read_capture(&args.capture)?;
    let gaussians = read_gaussians(&args.gaussians)?;
    let photos: Vec<Photo> = capture
        .views_of(Split::Train)
        .into_iter()
        .step_by(args.every.max(1))
        .map(|view| photo(&capture, &args.capture, view))
        .collect::<anyhow::Result<_>>()?;
    let mut observer = |_: &'static str, _: f32| ControlFlow::Continue(());
    let (surface, report) = extract(&gaussians, &photos, &args.geometry, &mut observer)?;
    println!("{}", serde_json::to_string_pretty(&report)?);
    let mesh = TriangleMesh {
        vertices: surface.vertices.iter().map(|&v| Vec3::from(v)).collect(),
        triangles: surface.triangles.clone(),
    };
    let tracer = MeshTracer::new(&mesh, BuildQuality::Balanced)?;
    if let Some(folder) = &args.output {
        std::fs::create_dir_all(folder)?;
        write_ply(&folder.join("surface.ply"), &surface)?;
    }
    let mut scores: BTreeMap<u8, Score> = BTreeMap::new();
    for view in capture.views_of(Split::Test) {
        let v = &capture.views[view];
        let camera = capture.cameras[v.camera].as_pinhole().expect("a pinhole camera");
        let stem = Path::new(&v.name).file_stem().expect("a name").to_string_lossy().into_owned();
        let truth = args.truth.as_ref().map(|t| truth(t, &stem)).transpose()?;
        let (w, h) = (camera.width, camera.height);
        let mut picture = ImageU8::filled(3 * w, h, 3, 0);
        let rotation = v.camera_from_world.rotation_matrix();
        let center = v.camera_from_world.center_in_world();
        for y in 0..h {
            for x in 0..w {
                let d = glam::DVec3::new(
                    (x as f64 + 0.5 - camera.cx) / camera.fx,
                    (y as f64 + 0.5 - camera.cy) / camera.fy,
                    1.0,
                );
                let direction = (rotation.transpose() * d).normalize().as_vec3();
                let hit = tracer.closest_hit(&Ray::new(center.as_vec3(), direction));
                let found = hit.map(|hit| {
                    let [a, b, c] = surface.triangles[hit.primitive as usize]
                        .map(|i| Vec3::from(surface.normals[i as usize]));
                    let [u, v] = hit.barycentrics;
                    let n = (a * (1.0 - u - v) + b * u + c * v).normalize_or_zero();
                    (hit.distance / d.length() as f32, n)
                });
                let paint = |n: Vec3| n.to_array().map(|c| ((c * 0.5 + 0.5) * 255.0) as u8);
                if let Some((_, n)) = found {
                    picture.pixel_mut(w + x, y).copy_from_slice(&paint(n));
                }
                let Some((depth, normal, id)) = &truth else { continue };
                let z = depth.pixel(x, y)[0];
                let n = Vec3::from_slice(normal.pixel(x, y)).normalize_or_zero();
                picture.pixel_mut(x, y).copy_from_slice(&paint(n));
                let score = scores.entry(id.pixel(x, y)[0]).or_default();
                score.pixels += 1;
                let Some((depth, ours)) = found else {
                    score.missed += 1;
                    picture.pixel_mut(2 * w + x, y).copy_from_slice(&[255, 0, 255]);
                    continue;
                };
                let degrees = ours.angle_between(n).to_degrees();
                score.degrees.push(degrees);
                score.depth.push((depth / z - 1.0).abs());
                score.off += usize::from((depth / z - 1.0).abs() > 0.02);
                score.near += usize::from(depth / z - 1.0 < -0.02);
                score.far += usize::from(depth / z - 1.0 > 0.02);
                let e = (degrees / 30.0 * 255.0).min(255.0) as u8;
                let off = if (depth / z - 1.0).abs() > 0.02 { 255 } else { 0 };
                picture.pixel_mut(2 * w + x, y).copy_from_slice(&[e, e, off]);
            }
        }
        if let Some(folder) = &args.output {
            write_png(&folder.join(format!("{stem}.png")), &picture)?;
        }
    }
    let mut objects = Score::default();
    for (&id, score) in &scores {
        line(&format!("id {id}"), score);
        if id >= 2 {
            objects.pixels += score.pixels;
            objects.missed += score.missed;
            objects.off += score.off;
            objects.near += score.near;
            objects.far += score.far;
            objects.degrees.extend(&score.degrees);
            objects.depth.extend(&score.depth);
        }
    }
    if objects.pixels > 0 {
        line("objects", &objects);
    }
    Ok(())
}

fn line(name: &str, score: &Score) {
    let mean = |v: &[f32]| v.iter().map(|&d| f64::from(d)).sum::<f64>() / v.len().max(1) as f64;
    let median = |v: &[f32]| {
        let mut v = v.to_vec();
        v.sort_by(f32::total_cmp);
        v.get(v.len() / 2).copied().unwrap_or(f32::NAN)
    };
    let share = |n: usize| 100.0 * n as f64 / score.pixels.max(1) as f64;
    println!(
        "{name:8} normals mean {:5.2} median {:5.2} deg, missed {:.2} %, depth off by over 2 %: {:.2} % (near {:.2}, far {:.2}), median depth error {:.3} %",
        mean(&score.degrees),
        median(&score.degrees),
        share(score.missed),
        share(score.off),
        share(score.near),
        share(score.far),
        100.0 * median(&score.depth)
    );
}

fn truth(folder: &Path, stem: &str) -> anyhow::Result<(ImageF32, ImageF32, ImageU8)> {
    let read = |what: &str, channels: &[&str]| -> anyhow::Result<ImageF32> {
        let image = open_exr(&folder.join(format!("aov/{stem}_{what}.exr")))?;
        let planes: Vec<Vec<f32>> = channels
            .iter()
            .map(|c| image.channel(c).map(|c| c.to_f32()).unwrap_or_default())
            .collect();
        let count = image.width * image.height;
        let data = (0..count).flat_map(|i| planes.iter().map(move |p| p[i])).collect();
        Ok(ImageF32::from_data(image.width, image.height, channels.len(), data))
    };
    let id = read_image(&folder.join(format!("aov/{stem}_id.png")))?;
    Ok((read("depth", &["Z"])?, read("normal", &["R", "G", "B"])?, id))
}

fn write_ply(path: &Path, surface: &Surface) -> anyhow::Result<()> {
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        surface.vertices.len(),
        surface.triangles.len()
    )
    .into_bytes();
    for (p, n) in surface.vertices.iter().zip(&surface.normals) {
        p.iter().chain(n).for_each(|v| out.extend(v.to_le_bytes()));
    }
    for t in &surface.triangles {
        out.push(3);
        t.iter().for_each(|v| out.extend(v.to_le_bytes()));
    }
    Ok(std::fs::write(path, out)?)
}
