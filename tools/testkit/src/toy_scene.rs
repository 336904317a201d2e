//! A decomposed scene small enough for a test: a gray floor with a box on it, and a capture of it.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3, Quat, Vec3};
use motes_formats::capture::write_capture;
use motes_formats::decomposition::{
    DecompositionCounts, DecompositionDocument, ScaleAnchorDocument, write_decomposition,
};
use motes_formats::documents::Document as _;
use motes_formats::environment::write_environment;
use motes_formats::ply::{PlyWriteOptions, write_gaussians, write_surface};
use motes_scene::{
    Camera, Capture, Convention, Gaussians, ImageF32, Lobes, Materials, Pinhole, Pose, ScaleAnchor,
    SparsePoints, Split, Surface, View,
};
use tempfile::TempDir;

/// Base color of the floor.
pub const FLOOR: [f32; 3] = [0.5, 0.4, 0.3];
/// Base color of the box.
pub const BOX: [f32; 3] = [0.2, 0.3, 0.6];

/// A decomposed scene and a capture of it in a folder of its own.
pub struct ToyScene {
    /// Holds `scene/` and the capture; gone when dropped.
    pub folder: TempDir,
    /// Cameras and views.
    pub capture: Capture,
}

impl ToyScene {
    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes an environment map whose pixel (x, y) is `at(x, y)`.
    pub fn map(
        &self,
        name: &str,
        width: usize,
        height: usize,
        at: impl Fn(usize, usize) -> [f32; 3] + Sync,
    ) {
        // Not by our writer: it refuses values that are not finite, and readers must not.
        exr::prelude::write_rgb_file(self.path(name), width, height, |x, y| at(x, y).into())
            .unwrap();
    }
}

#[derive(Default)]
struct Parts {
    surface: Surface,
    gaussians: Gaussians,
    materials: Materials,
}

impl Parts {
    /// A square of `n` x `n` cells from `corner` along `u` and `v`: two triangles and a flat
    /// Gaussian per cell.
    fn square(&mut self, corner: Vec3, u: Vec3, v: Vec3, n: u32, color: [f32; 3]) {
        let normal = u.cross(v).normalize();
        let first = self.surface.vertices.len() as u32;
        let at = |i: f32, k: f32| corner + u * (i / n as f32) + v * (k / n as f32);
        for k in 0..=n {
            for i in 0..=n {
                self.surface.vertices.push(at(i as f32, k as f32).to_array());
                self.surface.normals.push(normal.to_array());
                self.surface.base_color_linear.push(color);
                self.surface.roughness.push(0.9);
                self.surface.metallic.push(0.0);
            }
        }
        let rotation = Quat::from_rotation_arc(Vec3::Z, normal);
        let side = u.length() / n as f32;
        for k in 0..n {
            for i in 0..n {
                let a = first + k * (n + 1) + i;
                let c = a + n + 1;
                self.surface.triangles.extend([[a, a + 1, c], [a + 1, c + 1, c]]);
                self.gaussians.means.push(at(i as f32 + 0.5, k as f32 + 0.5).to_array());
                let q = rotation;
                self.gaussians.rotations.push([q.w, q.x, q.y, q.z]);
                let flat = (side * 0.6).ln();
                self.gaussians.log_scales.push([flat, flat, flat - 5.0]);
                self.gaussians.opacity_logits.push(6.0);
                self.gaussians.sh.extend(color.map(|c| (c - 0.5) / 0.282_094_8));
                self.materials.normals.push(normal.to_array());
                self.materials.base_color_linear.push(color);
                self.materials.roughness.push(0.9);
                self.materials.metallic.push(0.0);
                self.materials.visibility.push(1.0);
                self.materials.observations.push(3);
            }
        }
    }
}

impl Parts {
    fn turn(&mut self, turn: Quat) {
        let all = [
            &mut self.surface.vertices,
            &mut self.surface.normals,
            &mut self.gaussians.means,
            &mut self.materials.normals,
        ];
        for v in all.into_iter().flatten() {
            *v = (turn * Vec3::from(*v)).to_array();
        }
        for [w, x, y, z] in &mut self.gaussians.rotations {
            let q = turn * Quat::from_xyzw(*x, *y, *z, *w);
            [*w, *x, *y, *z] = [q.w, q.x, q.y, q.z];
        }
    }
}

/// Writes `scene/`, `capture.json` and photos that are renders of the Gaussians.
pub fn toy_scene() -> ToyScene {
    turned_toy_scene(DQuat::IDENTITY)
}

/// The same scene in a world whose up is `world_from_toy` times z.
pub fn turned_toy_scene(world_from_toy: DQuat) -> ToyScene {
    let folder = tempfile::tempdir().unwrap();
    let mut parts = Parts::default();
    parts.square(Vec3::new(-2.0, -2.0, 0.0), Vec3::X * 4.0, Vec3::Y * 4.0, 48, FLOOR);
    let (low, side) = (Vec3::new(-0.3, -0.3, 0.0), 0.6);
    let (x, y, z) = (Vec3::X * side, Vec3::Y * side, Vec3::Z * side);
    for (corner, u, v) in
        [(low + z, x, y), (low, x, z), (low + y, z, x), (low, z, y), (low + x, y, z)]
    {
        parts.square(corner, u, v, 10, BOX);
    }
    if world_from_toy != DQuat::IDENTITY {
        parts.turn(world_from_toy.as_quat());
    }
    let Parts { surface, mut gaussians, materials } = parts;
    materials.attach(&mut gaussians);
    let scene = folder.path().join("scene");
    write_gaussians(&scene.join("gaussians.ply"), &gaussians, &PlyWriteOptions::default()).unwrap();
    write_surface(&scene.join("surface.ply"), &surface).unwrap();
    let light = ImageF32::filled(8, 4, 3, 0.5);
    write_environment(&scene.join("environment.exr"), &light, &[]).unwrap();
    write_document(&scene, gaussians.len(), &surface, world_from_toy * DVec3::Z);
    let mut capture = capture(6, 0.5);
    for view in &mut capture.views {
        view.camera_from_world = turned_pose(&view.camera_from_world, world_from_toy);
    }
    write_capture(&folder.path().join("capture.json"), &capture).unwrap();
    ToyScene { folder, capture }
}

/// The pose of a camera that sees the turned world as it saw the toy.
pub fn turned_pose(camera_from_toy: &Pose, world_from_toy: DQuat) -> Pose {
    let rotation = camera_from_toy.rotation * world_from_toy.inverse();
    Pose::new(rotation, camera_from_toy.translation).unwrap()
}

fn write_document(scene: &Path, gaussians: usize, surface: &Surface, up_in_world: DVec3) {
    let document = DecompositionDocument {
        format: DecompositionDocument::FORMAT.into(),
        version: DecompositionDocument::version(),
        made_by: "a test".into(),
        gaussians: "gaussians.ply".into(),
        surface: "surface.ply".into(),
        environment: "environment.exr".into(),
        environment_convention: Convention::Blender,
        environment_up_in_world: None,
        up_in_world: up_in_world.to_array(),
        lobes: Lobes::Lambert,
        indirect: false,
        tone_curve_contrast: None,
        fills_photos: None,
        scale_anchor: ScaleAnchorDocument {
            kind: ScaleAnchor::Environment,
            explanation: "made".into(),
            factor_rgb: [1.0; 3],
        },
        terms: Vec::new(),
        views: Vec::new(),
        counts: DecompositionCounts {
            gaussians: gaussians as u64,
            unobserved_gaussians: 0,
            vertices: surface.vertices.len() as u64,
            triangles: surface.triangles.len() as u64,
        },
        source_gaussians: None,
        seconds: None,
        step_times: Vec::new(),
    };
    write_decomposition(scene, &document).unwrap();
}

/// Cameras round the box, every third held out. The first looks at it from +x with +y to the right.
pub fn capture(views: usize, step: f64) -> Capture {
    let camera = Pinhole { fx: 90.0, fy: 90.0, cx: 40.0, cy: 30.0, width: 80, height: 60 };
    let view = |i: usize| {
        let angle = i as f64 * step;
        let eye = DVec3::new(2.6 * angle.cos(), 2.6 * angle.sin(), 2.4);
        View {
            name: format!("view_{i}.png"),
            camera: 0,
            camera_from_world: Pose::look_at(eye, DVec3::ZERO, DVec3::Z).unwrap(),
            image: format!("images/view_{i}.png").into(),
            mask: None,
            split: if i % 3 == 2 { Split::Test } else { Split::Train },
            exposure_stops: None,
        }
    };
    Capture {
        cameras: vec![Camera::from_pinhole(camera)],
        views: (0..views).map(view).collect(),
        points: SparsePoints::default(),
        world_origin: DVec3::ZERO,
        exposure_response: None,
    }
}

/// The sRGB curve: linear to display, both 0 to 1.
pub fn encode(linear: f32) -> f32 {
    let v = linear.clamp(0.0, 1.0);
    let encoded = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    255.0 * encoded
}
