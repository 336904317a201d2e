//! Pictures that another renderer made, shaded again from its buffers: light, axes, exposure,
//! BRDF, visibility and one bounce together.
//!
//! `MOTES_RELIGHT_TRUTH` names a folder with `scene.json` (`exposure`), `env/<light>.exr` in
//! Blender's axes, `transforms_test.json`, `aov/<view>_{albedo,normal,depth,roughness,metallic}.exr`
//! and `test/relight_<light>/<view>.exr`. Without it the test says that it skips.

use std::path::Path;

use exr::prelude::read_first_flat_layer_from_file;
use glam::{Mat4, Vec3};
use motes_math::srgb::encode_clipped;
use motes_scene::ImageF32;
use motes_shading::brdf::{Lobes, Material};
use motes_shading::environment::{
    Convention, Environment, EnvironmentMap, MapOptions, Orientation,
};
use motes_shading::integrate::{IntegrationOptions, Shader, SurfacePoint};
use motes_shading::tracing::{BuildQuality, Hit, MeshTracer, Ray, TriangleMesh};

fn read(path: &Path) -> ImageF32 {
    let image = read_first_flat_layer_from_file(path).expect("an EXR");
    let layer = image.layer_data;
    let (w, h) = (layer.size.0, layer.size.1);
    let mut channels: Vec<_> = layer.channel_data.list.iter().collect();
    // Alphabetical in the file: B, G, R.
    channels.reverse();
    let planes: Vec<Vec<f32>> =
        channels.iter().map(|c| c.sample_data.values_as_f32().collect()).collect();
    let data = (0..w * h).flat_map(|i| planes.iter().map(move |p| p[i])).collect();
    ImageF32::from_data(w, h, planes.len(), data)
}

struct View {
    name: String,
    world_from_camera: Mat4,
    depth: ImageF32,
    albedo: ImageF32,
    normal: ImageF32,
    roughness: ImageF32,
    metallic: ImageF32,
}

struct Pinhole {
    focal: f32,
    center: (f32, f32),
}

impl View {
    fn position(&self, camera: &Pinhole, x: usize, y: usize) -> Vec3 {
        let z = self.depth.pixel(x, y)[0];
        let (u, v) = (x as f32 + 0.5 - camera.center.0, y as f32 + 0.5 - camera.center.1);
        let p = Vec3::new(u / camera.focal * z, -v / camera.focal * z, -z);
        self.world_from_camera.transform_point3(p)
    }

    fn normal(&self, x: usize, y: usize) -> Vec3 {
        Vec3::from_slice(self.normal.pixel(x, y)).normalize_or(Vec3::Z)
    }

    /// The renderers whose buffers these are have Burley's diffuse lobe.
    fn material(&self, x: usize, y: usize) -> Material {
        let m = Material::principled(
            Vec3::from_slice(self.albedo.pixel(x, y)),
            self.roughness.pixel(x, y)[0],
            self.metallic.pixel(x, y)[0],
        );
        Material { lobes: Lobes::Burley, ..m }
    }
}

fn views(root: &Path) -> (Pinhole, Vec<View>) {
    let text = std::fs::read_to_string(root.join("transforms_test.json")).expect("transforms");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let number = |key: &str| json[key].as_f64().expect("a number") as f32;
    let camera = Pinhole { focal: number("fl_x"), center: (number("cx"), number("cy")) };
    let frames = json["frames"].as_array().expect("frames");
    let view = |frame: &serde_json::Value| {
        let path = Path::new(frame["file_path"].as_str().expect("a path"));
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let rows: Vec<Vec<f32>> =
            serde_json::from_value(frame["transform_matrix"].clone()).expect("a matrix");
        let flat: Vec<f32> = rows.into_iter().flatten().collect();
        let aov = |what: &str| read(&root.join(format!("aov/{name}_{what}.exr")));
        View {
            world_from_camera: Mat4::from_cols_slice(&flat).transpose(),
            depth: aov("depth"),
            albedo: aov("albedo"),
            normal: aov("normal"),
            roughness: aov("roughness"),
            metallic: aov("metallic"),
            name: name.clone(),
        }
    };
    (camera, frames.iter().map(view).collect())
}

/// All depth maps as one mesh over a floor at z = 0; also the material of every triangle.
fn mesh(camera: &Pinhole, views: &[View]) -> (TriangleMesh, Vec<Material>) {
    let half = 5.0;
    let mut mesh = TriangleMesh {
        vertices: [(-half, -half), (half, -half), (half, half), (-half, half)]
            .map(|(x, y)| Vec3::new(x, y, 0.0))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let mut materials = vec![Material::lambert(Vec3::new(0.35, 0.31, 0.26)); 2];
    let step = 2;
    for view in views {
        let (columns, rows) = (view.depth.width / step, view.depth.height / step);
        let first = mesh.vertices.len() as u32;
        for y in 0..rows {
            for x in 0..columns {
                mesh.vertices.push(view.position(camera, x * step, y * step));
            }
        }
        let eye = view.world_from_camera.transform_point3(Vec3::ZERO);
        for y in 0..rows - 1 {
            for x in 0..columns - 1 {
                let a = first + (y * columns + x) as u32;
                let c = a + columns as u32;
                for corners in [[a, c, a + 1], [a + 1, c, c + 1]] {
                    let [p, q, r] = corners.map(|i| mesh.vertices[i as usize]);
                    let n = (q - p).cross(r - p).normalize_or_zero();
                    // A triangle seen edge-on bridges a step in depth. The floor is there already.
                    let edge_on = n.dot((eye - p).normalize()).abs() < 0.15;
                    if !edge_on && p.z.max(q.z).max(r.z) > 2e-3 {
                        mesh.triangles.push(corners);
                        materials.push(view.material(x * step, y * step));
                    }
                }
            }
        }
    }
    (mesh, materials)
}

#[test]
fn pictures_of_another_renderer_are_met_from_their_buffers() {
    let Some(root) = std::env::var_os("MOTES_RELIGHT_TRUTH") else {
        println!("skipped: MOTES_RELIGHT_TRUTH names no folder");
        return;
    };
    let root = Path::new(&root);
    let text = std::fs::read_to_string(root.join("scene.json")).expect("scene.json");
    let scene: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let exposure = scene["exposure"].as_f64().expect("an exposure") as f32;
    let (camera, views) = views(root);
    let (mesh, materials) = mesh(&camera, &views);
    let tracer = MeshTracer::new(&mesh, BuildQuality::Balanced).expect("a mesh");
    let options = MapOptions { exposure, orientation: Orientation::new(Convention::Blender) };
    for light_name in ["capture", "sunrise", "studio", "overcast"] {
        let (map, folder) = match light_name {
            "capture" => ("midday", "capture".to_owned()),
            other => (other, format!("relight_{other}")),
        };
        let image = read(&root.join(format!("env/{map}.exr")));
        let map = EnvironmentMap::new(&image, &options).expect("a map");
        let light = Environment::new(Some(map), None);
        let bounce = IntegrationOptions {
            light_samples: 4,
            brdf_samples: 0,
            ray_bias: 5e-3,
            seed: 1,
            ..IntegrationOptions::default()
        };
        let second = Shader::new(&light, &tracer, None, bounce);
        let l_hit = |ray: &Ray, hit: &Hit| {
            let material = materials[hit.primitive as usize];
            let n = hit.geometric_normal;
            let n = if n.dot(ray.direction) > 0.0 { -n } else { n };
            let point = SurfacePoint {
                position: ray.at(hit.distance),
                geometric_normal: n,
                shading_normal: n,
                to_viewer: n,
                material: Material::lambert(material.base_color_linear),
            };
            second.shade_point(&point, u64::from(hit.primitive)).total()
        };
        let first = IntegrationOptions { ray_bias: 5e-3, ..IntegrationOptions::default() };
        let shader = Shader::new(&light, &tracer, Some(&l_hit), first);
        let (mut psnr, mut ratio) = (0.0, [0.0f64; 2]);
        for view in &views {
            let truth = read(&root.join(format!("test/{folder}/{}.exr", view.name)));
            let eye = view.world_from_camera.transform_point3(Vec3::ZERO);
            let mut pixels = Vec::new();
            let mut points = Vec::new();
            for y in (1..truth.height).step_by(5) {
                for x in (1..truth.width).step_by(5) {
                    let position = view.position(&camera, x, y);
                    let n = view.normal(x, y);
                    pixels.push((x, y));
                    points.push(SurfacePoint {
                        position,
                        geometric_normal: n,
                        shading_normal: n,
                        to_viewer: (eye - position).normalize(),
                        material: view.material(x, y),
                    });
                }
            }
            let shaded = shader.shade(&points, 0);
            let mut error = 0.0;
            for (s, (x, y)) in shaded.iter().zip(pixels) {
                for k in 0..3 {
                    let (a, b) = (s.total()[k], truth.pixel(x, y)[k] * exposure);
                    error += f64::from(encode_clipped(a) - encode_clipped(b)).powi(2);
                    ratio[0] += f64::from(a.min(1.0));
                    ratio[1] += f64::from(b.min(1.0));
                }
            }
            psnr -= 10.0 * (error / (3 * points.len()) as f64).log10() / views.len() as f64;
        }
        let ratio = ratio[0] / ratio[1];
        println!("{light_name}: PSNR {psnr:.2} dB, mean of ours over theirs {ratio:.3}");
        // Short of the truth: bounces after the second surface, holes of the depth mesh, noise.
        assert!(psnr > 27.0, "{light_name}: {psnr}");
        assert!((0.93..1.03).contains(&ratio), "{light_name}: {ratio}");
    }
}
