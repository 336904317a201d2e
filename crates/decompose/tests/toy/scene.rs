//! The scene and its photos.

use decompose::{Photo, TracedSurface, ViewRays};
use glam::{DVec3, Vec3};
use motes_scene::{Gaussians, ImageF32, Pinhole, Pose, Surface};
use motes_shading::brdf::Material;
use motes_shading::emitters::Emitters;
use motes_shading::environment::{
    Convention, Environment, EnvironmentMap, MapOptions, Orientation,
};
use motes_shading::integrate::{IntegrationOptions, Shader, SurfacePoint};
use motes_shading::tracing::TriangleMesh;

pub(crate) const SIZE: (usize, usize) = (96, 72);
pub(crate) const RADIUS: f32 = 0.5;

/// Floor at z = 0 as a grid of its own and a ball on it.
pub(crate) fn surface() -> Surface {
    let mut s = Surface::default();
    let n = 40u32;
    for y in 0..=n {
        for x in 0..=n {
            s.vertices.push([
                x as f32 / n as f32 * 4.0 - 2.0,
                y as f32 / n as f32 * 4.0 - 2.0,
                0.0,
            ]);
            s.normals.push([0.0, 0.0, 1.0]);
        }
    }
    for y in 0..n {
        for x in 0..n {
            let a = y * (n + 1) + x;
            add_quad(&mut s, [a, a + 1, a + n + 2, a + n + 1]);
        }
    }
    add_ball(&mut s, Vec3::Z * (RADIUS + 0.01), RADIUS, 24);
    s
}

fn add_quad(s: &mut Surface, [a, b, c, d]: [u32; 4]) {
    s.triangles.extend([[a, b, c], [a, c, d]]);
}

/// A ball of `rows` rows and twice as many columns.
fn add_ball(s: &mut Surface, center: Vec3, radius: f32, rows: u32) {
    let (first, columns) = (s.vertices.len() as u32, 2 * rows);
    for y in 0..=rows {
        for x in 0..columns {
            let (theta, phi) = (
                y as f32 / rows as f32 * std::f32::consts::PI,
                x as f32 / columns as f32 * std::f32::consts::TAU,
            );
            let d = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            s.normals.push(d.to_array());
            s.vertices.push((d * radius + center).to_array());
        }
    }
    for y in 0..rows {
        for x in 0..columns {
            let at = |x: u32, y: u32| first + y * columns + x % columns;
            add_quad(s, [at(x, y), at(x, y + 1), at(x + 1, y + 1), at(x + 1, y)]);
        }
    }
}

/// The same with a ball over the floor that sends `radiance`.
pub(crate) fn surface_with_lamp(radiance: f32) -> Surface {
    let mut s = surface();
    let first = s.vertices.len();
    add_ball(&mut s, Vec3::new(0.9, 0.5, 0.7), 0.16, 10);
    s.emission_linear = vec![[0.0; 3]; first];
    s.emission_linear.resize(s.vertices.len(), [radiance; 3]);
    s
}

pub(crate) fn is_floor(p: Vec3) -> bool {
    p.z < 1e-3
}

pub(crate) fn base_color(p: Vec3) -> f32 {
    match (is_floor(p), (p.x * 2.0).floor() as i32 + (p.y * 2.0).floor() as i32) {
        (true, k) if k.rem_euclid(2) == 0 => 0.5,
        (true, _) => 0.25,
        _ => 0.45,
    }
}

pub(crate) fn light(sky: f32, sun: f32) -> Environment {
    let mut image = ImageF32::filled(64, 32, 3, 0.0);
    for y in 0..16 {
        for x in 0..64 {
            image.pixel_mut(x, y).fill(sky);
        }
    }
    for (x, y) in [(20, 8), (21, 8), (20, 9), (21, 9)] {
        image.pixel_mut(x, y).fill(sun);
    }
    let options = MapOptions { exposure: 1.0, orientation: Orientation::new(Convention::Blender) };
    Environment::new(EnvironmentMap::new(&image, &options).ok(), None)
}

/// Two soft boxes in a dark room.
pub(crate) fn boxes() -> Environment {
    let mut image = ImageF32::filled(64, 32, 3, 0.05);
    for (columns, rows, radiance) in [(10..22, 4..12, 6.0), (40..48, 7..14, 3.0)] {
        for (x, y) in columns.flat_map(|x| rows.clone().map(move |y| (x, y))) {
            image.pixel_mut(x, y).fill(radiance);
        }
    }
    let options = MapOptions { exposure: 1.0, orientation: Orientation::new(Convention::Blender) };
    Environment::new(EnvironmentMap::new(&image, &options).ok(), None)
}

pub(crate) fn photos(
    scene: &TracedSurface,
    light: &Environment,
    material: impl Fn(Vec3) -> Material,
) -> Vec<Photo> {
    photos_from(|k| 1.6 + 0.8 * f64::from(k % 3), scene, light, material)
}

/// Photos from twelve places round the ball at these heights.
pub(crate) fn photos_from(
    height: impl Fn(u32) -> f64,
    scene: &TracedSurface,
    light: &Environment,
    material: impl Fn(Vec3) -> Material,
) -> Vec<Photo> {
    let camera = Pinhole { fx: 90.0, fy: 90.0, cx: 48.0, cy: 36.0, width: SIZE.0, height: SIZE.1 };
    let options = IntegrationOptions {
        light_samples: 64,
        brdf_samples: 32,
        ray_bias: 1e-4,
        ..IntegrationOptions::default()
    };
    let emission: Vec<Vec3> = scene.surface.emission_linear.iter().map(|&e| e.into()).collect();
    let mesh = TriangleMesh {
        vertices: scene.surface.vertices.iter().map(|&v| v.into()).collect(),
        triangles: scene.surface.triangles.clone(),
    };
    let lamps = Emitters::new(&mesh, &emission);
    let shader = Shader::new(light, &scene.tracer, None, options).with_emitters(lamps.as_ref());
    (0..12u32)
        .map(|k| {
            let phi = f64::from(k) * std::f64::consts::TAU / 12.0;
            let eye = DVec3::new(3.0 * phi.cos(), 3.0 * phi.sin(), height(k));
            let mut photo = Photo {
                gain: [1.0; 3],
                name: format!("view_{k:02}.png"),
                camera,
                camera_from_world: Pose::look_at(eye, DVec3::Z * 0.3, DVec3::Z).expect("a pose"),
                radiance_linear: ImageF32::filled(SIZE.0, SIZE.1, 3, 0.0).into(),
                light: 0,
                // Nothing is drawn behind the surface: what misses it is masked.
                usable: vec![false; SIZE.0 * SIZE.1],
                clipped: Vec::new(),
            };
            let rays = ViewRays::new(&photo);
            let hits = rays.hits(scene);
            let mut places = Vec::new();
            let mut points = Vec::new();
            for (i, hit) in hits.iter().enumerate().filter(|(_, h)| h.is_hit()) {
                let (x, y) = ((i % SIZE.0) as f32 + 0.5, (i / SIZE.0) as f32 + 0.5);
                let to_viewer = -rays.direction(x, y);
                let (position, shading_normal, geometric_normal) = scene.frame(hit, to_viewer);
                photo.usable[i] = true;
                places.push(i);
                let material = material(position);
                points.push(SurfacePoint {
                    position,
                    geometric_normal,
                    shading_normal,
                    to_viewer,
                    material,
                });
            }
            photo.clipped = vec![false; SIZE.0 * SIZE.1];
            for (&i, shaded) in places.iter().zip(shader.shade(&points, u64::from(k) << 32)) {
                let own = lamps.as_ref().map_or(Vec3::ZERO, |l| l.radiance(hits[i].triangle));
                let mut sent = shaded.total() + own;
                if lamps.is_some() && sent.max_element() >= 1.0 {
                    (photo.clipped[i], photo.usable[i]) = (true, false);
                    sent = sent.min(Vec3::ONE);
                }
                photo.radiance_linear.floats_mut()[i] = sent.to_array();
            }
            photo
        })
        .collect()
}

pub(crate) fn gaussians(surface: &Surface) -> Gaussians {
    let n = surface.vertices.len() + 1;
    // The last one is where no camera looks.
    let means = surface.vertices.iter().copied().chain([[0.0, 0.0, -50.0]]).collect();
    Gaussians {
        means,
        rotations: vec![[1.0, 0.0, 0.0, 0.0]; n],
        log_scales: vec![[0.05f32.ln(); 3]; n],
        opacity_logits: vec![3.0; n],
        sh_degree: 0,
        sh: vec![0.0; 3 * n],
        extra: Vec::new(),
    }
}
