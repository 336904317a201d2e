//! The stage `relight` on a scene whose material and surface are the truth: what is left is the error of
//! relighting itself, the ceiling of any decomposition.
//!
//! `MOTES_RELIGHT_TRUTH` names a folder with `scene.json` (`exposure`), `env/<light>.exr` in
//! Blender's axes, `aov/<view>_{albedo,normal,depth,roughness,metallic}.exr`,
//! `test/relight_<light>/<view>.png` and a floor at z = 0; `MOTES_RELIGHT_CAPTURE` its capture. Without them the test says that it skips.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]
#![allow(clippy::print_stdout, reason = "shown with --nocapture")]

use std::path::{Path, PathBuf};
use std::process::Command;

use glam::{DVec2, DVec3, Quat, Vec3};
use motes_formats::capture::read_capture;
use motes_formats::decomposition::{
    DecompositionCounts, DecompositionDocument, ScaleAnchorDocument, write_decomposition,
};
use motes_formats::documents::Document as _;
use motes_formats::environment::read_environment;
use motes_formats::exr_aov::read_exr;
use motes_formats::images::read_image;
use motes_formats::ply::{PlyWriteOptions, write_gaussians, write_surface};
use motes_scene::{
    Capture, Convention, Gaussians, ImageF32, ImageU8, Lobes, Materials, Pinhole, Pose,
    ScaleAnchor, Split, Surface,
};

/// Buffers of a view.
struct View {
    name: String,
    camera: Pinhole,
    camera_from_world: Pose,
    depth: ImageF32,
    albedo: ImageF32,
    normal: ImageF32,
    roughness: ImageF32,
    metallic: ImageF32,
}

fn buffer(path: &Path) -> ImageF32 {
    if let Ok(rgb) = read_environment(path) {
        return rgb;
    }
    let (width, height, channels) = read_exr(path).unwrap();
    ImageF32::from_data(width, height, 1, channels[0].to_f32())
}

fn views(root: &Path, capture: &Capture) -> Vec<View> {
    let of = |i: usize| {
        let view = &capture.views[i];
        let name = view.name.trim_end_matches(".png").to_owned();
        let aov = |what: &str| buffer(&root.join(format!("aov/{name}_{what}.exr")));
        View {
            camera: capture.cameras[view.camera].as_pinhole().unwrap(),
            camera_from_world: view.camera_from_world,
            depth: aov("depth"),
            albedo: aov("albedo"),
            normal: aov("normal"),
            roughness: aov("roughness"),
            metallic: aov("metallic"),
            name,
        }
    };
    capture.views_of(Split::Test).into_iter().map(of).collect()
}

impl View {
    fn position(&self, x: usize, y: usize) -> Vec3 {
        let z = f64::from(self.depth.pixel(x, y)[0]);
        let c = &self.camera;
        let at = DVec2::new(x as f64 + 0.5 - c.cx, y as f64 + 0.5 - c.cy);
        let local = DVec3::new(at.x / c.fx * z, at.y / c.fy * z, z);
        self.camera_from_world.inverse().transform_point(local).as_vec3()
    }
}

/// Vertices with normal and material, as they are collected.
#[derive(Default)]
struct Mesh(Surface);

impl Mesh {
    fn vertex(&mut self, p: Vec3, n: Vec3, base: &[f32], roughness: f32, metallic: f32) {
        self.0.vertices.push(p.to_array());
        self.0.normals.push(n.normalize_or(Vec3::Z).to_array());
        self.0.base_color_linear.push([base[0], base[1], base[2]]);
        self.0.roughness.push(roughness);
        self.0.metallic.push(metallic);
    }

    fn grid(
        &mut self,
        first: u32,
        columns: u32,
        rows: u32,
        keep: impl Fn(&Self, [u32; 3]) -> bool,
    ) {
        for y in 0..rows - 1 {
            for x in 0..columns - 1 {
                let a = first + y * columns + x;
                let c = a + columns;
                for corners in [[a, c, a + 1], [a + 1, c, c + 1]] {
                    if keep(self, corners) {
                        self.0.triangles.push(corners);
                    }
                }
            }
        }
    }
}

/// All depth maps over a floor.
fn surface(views: &[View]) -> Surface {
    let mut mesh = Mesh::default();
    let inner = (-50..=50).map(|i| 0.03 * i as f32);
    let lines: Vec<f32> =
        [-5.0, -3.0, -2.0].into_iter().chain(inner).chain([2.0, 3.0, 5.0]).collect();
    for y in lines.iter().rev() {
        for x in &lines {
            mesh.vertex(Vec3::new(*x, *y, 0.0), Vec3::Z, &[0.349, 0.31, 0.263], 0.6, 0.0);
        }
    }
    let n = lines.len() as u32;
    mesh.grid(0, n, n, |_, _| true);
    let step = 2;
    for view in views {
        let (columns, rows) = (view.depth.width / step, view.depth.height / step);
        let first = mesh.0.vertices.len() as u32;
        for y in (0..rows).map(|y| y * step) {
            for x in (0..columns).map(|x| x * step) {
                let normal = Vec3::from_slice(view.normal.pixel(x, y));
                let (r, m) = (view.roughness.pixel(x, y)[0], view.metallic.pixel(x, y)[0]);
                mesh.vertex(view.position(x, y), normal, view.albedo.pixel(x, y), r, m);
            }
        }
        let eye = view.camera_from_world.center_in_world().as_vec3();
        mesh.grid(first, columns as u32, rows as u32, |mesh, corners| {
            let [p, q, r] = corners.map(|i| Vec3::from(mesh.0.vertices[i as usize]));
            let n = (q - p).cross(r - p).normalize_or_zero();
            // A triangle seen edge-on bridges a step in depth. The floor is there already.
            n.dot((eye - p).normalize()).abs() >= 0.15 && p.z.max(q.z).max(r.z) > 2e-3
        });
    }
    mesh.0
}

/// A flat Gaussian per pixel of every view, with the buffers' material.
fn gaussians(views: &[View]) -> Gaussians {
    let (mut out, mut materials) = (Gaussians::empty(0), Materials::default());
    for view in views {
        for y in 0..view.depth.height {
            for x in 0..view.depth.width {
                let normal = Vec3::from_slice(view.normal.pixel(x, y)).normalize_or(Vec3::Z);
                let q = Quat::from_rotation_arc(Vec3::Z, normal);
                let width = 0.4 * view.depth.pixel(x, y)[0] / view.camera.fx as f32;
                let albedo = view.albedo.pixel(x, y);
                out.means.push(view.position(x, y).to_array());
                out.rotations.push([q.w, q.x, q.y, q.z]);
                out.log_scales.push([width.ln(), width.ln(), width.ln() - 5.0]);
                out.opacity_logits.push(4.0);
                out.sh.extend(albedo.iter().map(|c| (c - 0.5) / 0.282_094_8));
                materials.normals.push(normal.to_array());
                materials.base_color_linear.push([albedo[0], albedo[1], albedo[2]]);
                materials.roughness.push(view.roughness.pixel(x, y)[0]);
                materials.metallic.push(view.metallic.pixel(x, y)[0]);
                materials.visibility.push(1.0);
                materials.observations.push(1);
            }
        }
    }
    materials.attach(&mut out);
    out
}

fn write_scene(folder: &Path, root: &Path, views: &[View]) {
    let gaussians = gaussians(views);
    let surface = surface(views);
    std::fs::create_dir_all(folder).unwrap();
    write_gaussians(&folder.join("gaussians.ply"), &gaussians, &PlyWriteOptions::default())
        .unwrap();
    write_surface(&folder.join("surface.ply"), &surface).unwrap();
    std::fs::copy(root.join("env/midday.exr"), folder.join("environment.exr")).unwrap();
    let document = DecompositionDocument {
        format: DecompositionDocument::FORMAT.into(),
        version: DecompositionDocument::version(),
        made_by: "a test".into(),
        gaussians: "gaussians.ply".into(),
        surface: "surface.ply".into(),
        environment: "environment.exr".into(),
        environment_convention: Convention::Blender,
        environment_up_in_world: None,
        up_in_world: [0.0, 0.0, 1.0],
        lobes: Lobes::Burley,
        indirect: true,
        tone_curve_contrast: None,
        fills_photos: None,
        scale_anchor: ScaleAnchorDocument {
            kind: ScaleAnchor::Environment,
            explanation: "ground truth".into(),
            factor_rgb: [1.0; 3],
        },
        terms: Vec::new(),
        views: Vec::new(),
        counts: DecompositionCounts {
            gaussians: gaussians.len() as u64,
            unobserved_gaussians: 0,
            vertices: surface.vertices.len() as u64,
            triangles: surface.triangles.len() as u64,
        },
        source_gaussians: None,
        seconds: None,
        step_times: Vec::new(),
    };
    write_decomposition(folder, &document).unwrap();
}

/// PSNR of means over `block` x `block` pixels.
fn psnr(a: &Path, b: &Path, block: usize) -> f64 {
    let (a, b) = (read_image(a).unwrap(), read_image(b).unwrap());
    assert_eq!((a.width, a.height, a.channels), (b.width, b.height, b.channels));
    let mean = |image: &ImageU8, x: usize, y: usize, c: usize| {
        let pixels = (0..block * block).map(|i| (x * block + i % block, y * block + i / block));
        let sum: f64 = pixels.map(|(x, y)| f64::from(image.pixel(x, y)[c])).sum();
        sum / (block * block) as f64
    };
    let (columns, rows) = (a.width / block, a.height / block);
    let mut error = 0.0;
    for i in 0..columns * rows * 3 {
        let (x, y, c) = (i / 3 % columns, i / 3 / columns, i % 3);
        error += (mean(&a, x, y, c) - mean(&b, x, y, c)).powi(2);
    }
    20.0 * 255f64.log10() - 10.0 * (error / (columns * rows * 3) as f64).log10()
}

#[test]
fn relighting_a_true_scene_meets_another_renderer() {
    let names = ["MOTES_RELIGHT_TRUTH", "MOTES_RELIGHT_CAPTURE"];
    let [Some(root), Some(capture)] = names.map(|name| std::env::var_os(name).map(PathBuf::from))
    else {
        println!("skipped: {} name no files", names.join(", "));
        return;
    };
    let text = std::fs::read_to_string(root.join("scene.json")).unwrap();
    let truth: serde_json::Value = serde_json::from_str(&text).unwrap();
    let exposure = truth["exposure"].to_string();
    let views = views(&root, &read_capture(&capture).unwrap());
    let scratch = tempfile::tempdir().unwrap();
    let keep = std::env::var_os("MOTES_RELIGHT_KEEP").map(PathBuf::from);
    let folder = keep.unwrap_or_else(|| scratch.path().to_owned());
    let scene = folder.join("scene");
    write_scene(&scene, &root, &views);
    for (light, map) in [
        ("capture", "midday"),
        ("relight_sunrise", "sunrise"),
        ("relight_studio", "studio"),
        ("relight_overcast", "overcast"),
    ] {
        let out = folder.join(light);
        let done = Command::new(env!("CARGO_BIN_EXE_relight"))
            .args([
                "--scene".as_ref(),
                scene.as_os_str(),
                "--capture".as_ref(),
                capture.as_os_str(),
            ])
            .arg("--environment")
            .arg(root.join(format!("env/{map}.exr")))
            .args(["--env-convention", "blender", "--env-exposure", &exposure, "--split", "test"])
            .args(["--no-provenance", "--overwrite", "-o"])
            .arg(&out)
            .output()
            .unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let file = |folder: &Path, view: &View| folder.join(format!("{}.png", view.name));
        let of =
            |v: &View, block| psnr(&file(&out, v), &file(&root.join("test").join(light), v), block);
        let mean = |block| views.iter().map(|v| of(v, block)).sum::<f64>() / views.len() as f64;
        let (pixels, blocks) = (mean(1), mean(4));
        println!("{light}: {pixels:.2} dB, {blocks:.2} dB in blocks of 4 x 4 pixels");
        // Blocks leave out how sharp the texture of this test's Gaussians is; holes of the depth mesh
        // and light after the third surface remain.
        assert!(blocks > 26.0, "{light}: {blocks}");
    }
}
