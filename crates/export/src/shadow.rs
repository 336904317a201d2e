//! What a scene's objects take from the ground's light: a plane to lay under them elsewhere.
//!
//! `ratio(x) = E(x with the objects) / E(x without them)` per color, with `E` the irradiance of the plane from
//! the scene's light. Compositors multiply their ground with it; renderers blend a black plane of
//! opacity `1 - luminance(ratio)` over it. Both samples of a point share their random numbers, so that the noise of the
//! light cancels where nothing is in the way.
//!
//! The ground is where most of the upward facing area lies; what rises from it casts the shadow.
//! Light that the objects reflect onto the ground is left out.

pub use crate::options::ShadowOptions;
use motes_math::luminance::luminance;
use std::io::{self, Write};

use glam::Vec3;
use motes_scene::{ImageF32, ImageU8, Surface};
use motes_shading::brdf::{Lobes, Material};
use motes_shading::environment::Environment;
use motes_shading::integrate::{IntegrationOptions, Shader, SurfacePoint};
use motes_shading::tracing::{BuildQuality, Empty, MeshTracer, TriangleMesh};
use serde::Serialize;
use serde_json::json;
use thiserror::Error;

use crate::mesh::glb::GlbBuilder;
use crate::mesh::target::GltfFrame;

/// A triangle with this cosine to up, or more, may be ground.
const GROUND_COSINE: f32 = 0.95;
/// Layers that heights are counted in.
const LAYERS: usize = 512;
/// What rises by less than this share of the objects' height is ground.
const GROUND_TOLERANCE: f32 = 0.02;

/// Why there is no shadow.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ShadowError {
    /// Nothing faces up.
    #[error("the surface has no ground: no triangle of it faces up")]
    NoGround,
    /// Nothing rises from the ground.
    #[error("nothing stands on the ground")]
    NoObjects,
    /// The arrays of the surface do not belong together.
    #[error("the arrays of the surface do not belong together")]
    Inconsistent,
}

/// A rectangle on the ground with its light.
#[derive(Clone, Debug)]
pub struct ShadowPlane {
    /// Corners in world, counter-clockwise seen from above, from the one that row 0 ends at on the left: the
    /// picture's top left, bottom left, bottom right, top right.
    pub corners: [[f32; 3]; 4],
    /// Unit, away from the ground.
    pub normal: [f32; 3],
    /// `[h, w, 3]`, linear, 0 to 1.
    pub ratio: ImageF32,
    /// What was found.
    pub summary: ShadowSummary,
}

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ShadowSummary {
    /// Height of the ground along the up axis, world units.
    pub ground_height: f32,
    /// Triangles that cast the shadow.
    pub occluders: usize,
    /// Least luminance of the ratio.
    pub darkest: f32,
    /// Sides of the plane, world units.
    pub size: [f32; 2],
}

/// The shadow of what stands on the ground of `surface` under `light`. The same at any number of threads.
///
/// # Errors
/// When there is no ground, or nothing on it.
pub fn shadow_plane(
    surface: &Surface,
    light: &Environment,
    up_in_world: Vec3,
    options: &ShadowOptions,
    seed: u64,
) -> Result<ShadowPlane, ShadowError> {
    if !surface.is_consistent() {
        return Err(ShadowError::Inconsistent);
    }
    let up = up_in_world.normalize_or(Vec3::Z);
    let ground = Ground::find(surface, up)?;
    let (low, high, height) = ground.extent(surface, options.shadow_margin);
    let mesh = TriangleMesh {
        vertices: surface.vertices.iter().map(|v| Vec3::from(*v)).collect(),
        triangles: ground.occluders.clone(),
    };
    let tracer =
        MeshTracer::new(&mesh, BuildQuality::Balanced).map_err(|_| ShadowError::Inconsistent)?;
    let side = high - low;
    let pixel = side.x.max(side.y) / options.shadow_size as f32;
    let count =
        |length: f32| ((length / pixel).round() as usize).clamp(1, options.shadow_size as usize);
    let (width, rows) = (count(side.x), count(side.y));
    // Row 0 is the far side: the picture is the ground seen from above with y upwards.
    let at = |x: f32, y: f32| {
        let (s, t) = (low.x + side.x * x / width as f32, high.y - side.y * y / rows as f32);
        ground.right * s + ground.ahead * t + up * ground.height
    };
    let lambert = Material { lobes: Lobes::Lambert, ..Material::principled(Vec3::ONE, 1.0, 0.0) };
    let points: Vec<SurfacePoint> = (0..width * rows)
        .map(|i| SurfacePoint {
            position: at((i % width) as f32 + 0.5, (i / width) as f32 + 0.5),
            geometric_normal: up,
            shading_normal: up,
            to_viewer: up,
            material: lambert,
        })
        .collect();
    let integration = IntegrationOptions {
        light_samples: options.shadow_samples,
        brdf_samples: (options.shadow_samples / 4).max(4),
        ray_bias: 1e-4 * height,
        seed,
        ..IntegrationOptions::default()
    };
    let shaded = Shader::new(light, &tracer, None, integration).shade(&points, 0);
    let open = Shader::new(light, &Empty, None, integration).shade(&points, 0);
    let ratio = |(with, without): (Vec3, Vec3)| {
        let share = |a: f32, b: f32| if b > 0.0 { (a / b).min(1.0) } else { 1.0 };
        [share(with.x, without.x), share(with.y, without.y), share(with.z, without.z)]
    };
    let pairs = shaded.iter().zip(&open).map(|(a, b)| (a.diffuse, b.diffuse));
    let ratio = ImageF32::from_data(width, rows, 3, pairs.flat_map(ratio).collect());
    let darkest =
        ratio.data.chunks_exact(3).map(|p| luminance([p[0], p[1], p[2]])).fold(1.0, f32::min);
    let (w, h) = (width as f32, rows as f32);
    Ok(ShadowPlane {
        corners: [at(0.0, 0.0), at(0.0, h), at(w, h), at(w, 0.0)].map(|p| p.to_array()),
        normal: up.to_array(),
        ratio,
        summary: ShadowSummary {
            ground_height: ground.height,
            occluders: ground.occluders.len(),
            darkest,
            size: side.to_array(),
        },
    })
}

/// Where things stand.
struct Ground {
    up: Vec3,
    right: Vec3,
    ahead: Vec3,
    height: f32,
    occluders: Vec<[u32; 3]>,
}

impl Ground {
    fn find(surface: &Surface, up: Vec3) -> Result<Self, ShadowError> {
        let corner = |v: u32| Vec3::from(surface.vertices[v as usize]);
        let faces: Vec<([u32; 3], Vec3, [f32; 3])> = surface
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(corner);
                (*t, (b - a).cross(c - a) * 0.5, [a, b, c].map(|p| p.dot(up)))
            })
            .filter(|(_, area, heights)| {
                area.is_finite() && area.length() > 0.0 && heights.iter().all(|h| h.is_finite())
            })
            .collect();
        let heights = || faces.iter().flat_map(|(_, _, h)| *h);
        let (low, high) = heights().fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(v), h.max(v)));
        // A flat ground alone has one layer.
        let layer = ((high - low) / LAYERS as f32).max(f32::MIN_POSITIVE);
        let mean = |h: &[f32; 3]| (h[0] + h[1] + h[2]) / 3.0;
        let facing_up = |(_, area, _): &&([u32; 3], Vec3, [f32; 3])| {
            area.dot(up) >= GROUND_COSINE * area.length()
        };
        let mut areas = vec![0.0f64; LAYERS + 1];
        for (_, area, h) in faces.iter().filter(facing_up) {
            areas[(((mean(h) - low) / layer) as usize).min(LAYERS)] += f64::from(area.length());
        }
        let most = (0..areas.len()).fold(0, |a, b| if areas[b] > areas[a] { b } else { a });
        if !(areas[most] > 0.0) {
            return Err(ShadowError::NoGround);
        }
        // The mean of the layer and its neighbors, by area.
        let (mut sum, mut weight) = (0.0, 0.0);
        for (_, area, h) in faces.iter().filter(facing_up) {
            let own = (((mean(h) - low) / layer) as usize).min(LAYERS);
            if own.abs_diff(most) <= 1 {
                sum += f64::from(area.length() * mean(h));
                weight += f64::from(area.length());
            }
        }
        let height = (sum / weight) as f32;
        let threshold = height + (GROUND_TOLERANCE * (high - height)).max(2.0 * layer);
        let occluders: Vec<[u32; 3]> =
            faces.iter().filter(|(_, _, h)| mean(h) > threshold).map(|(t, _, _)| *t).collect();
        if occluders.is_empty() {
            return Err(ShadowError::NoObjects);
        }
        // x of the world runs to the right, unless it is up.
        let side = if up.x.abs() < 0.9 { Vec3::X } else { Vec3::Y };
        let right = (side - up * side.dot(up)).normalize();
        Ok(Self { up, right, ahead: up.cross(right), height, occluders })
    }

    /// Corners of the plane along `right` and `ahead`, and the height of the objects.
    fn extent(&self, surface: &Surface, margin: f32) -> (glam::Vec2, glam::Vec2, f32) {
        let (mut low, mut high) = (glam::Vec2::MAX, glam::Vec2::MIN);
        let mut top = 0.0f32;
        for v in self.occluders.iter().flatten() {
            let p = Vec3::from(surface.vertices[*v as usize]);
            let flat = glam::Vec2::new(p.dot(self.right), p.dot(self.ahead));
            (low, high) = (low.min(flat), high.max(flat));
            top = top.max(p.dot(self.up) - self.height);
        }
        (low - margin * top, high + margin * top, top)
    }
}

impl ShadowPlane {
    /// The ratio as 8-bit linear values.
    pub fn picture(&self) -> ImageU8 {
        self.ratio.to_u8()
    }

    /// Writes the plane as binary glTF: unlit, black, opaque where no light comes.
    ///
    /// # Errors
    /// What the writer refuses.
    pub fn write_glb(&self, frame: &GltfFrame, writer: &mut dyn Write) -> io::Result<()> {
        let mut builder = GlbBuilder::default();
        let data = self
            .ratio
            .data
            .chunks_exact(3)
            .flat_map(|rgb| {
                [0, 0, 0, (255.0 * (1.0 - luminance([rgb[0], rgb[1], rgb[2]]))).round() as u8]
            })
            .collect();
        let picture = ImageU8::from_data(self.ratio.width, self.ratio.height, 4, data);
        let corners = self.corners.map(|c| frame.point(c));
        let normal = Vec3::from(frame.direction(self.normal)).normalize_or(Vec3::Y).to_array();
        let attributes = json!({
            "POSITION": builder.floats(&corners, true),
            "NORMAL": builder.floats(&[normal; 4], false),
            "TEXCOORD_0": builder.floats(&[[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]], false),
        });
        let indices = builder.triangles(&[[0, 1, 2], [0, 2, 3]]);
        let document = json!({
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [{
                "mesh": 0, "name": "shadow",
                "extras": {
                    "gltf_from_world": frame.matrix_rows(), "metres_per_world_unit": frame.scale,
                },
            }],
            "meshes": [{ "name": "shadow", "primitives": [
                { "attributes": attributes, "indices": indices, "material": 0, "mode": 4 },
            ] }],
            "materials": [{
                "name": "shadow", "alphaMode": "BLEND",
                "pbrMetallicRoughness": {
                    "baseColorTexture": { "index": 0 }, "metallicFactor": 0.0,
                },
                "extensions": { "KHR_materials_unlit": {} },
            }],
            "extensionsUsed": ["KHR_materials_unlit"],
            "images": [builder.image("one_minus_ratio", &picture)],
            "samplers": [{ "magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071 }],
            "textures": [{ "sampler": 0, "source": 0 }],
        });
        builder.finish(document, writer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motes_shading::environment::{EnvironmentMap, MapOptions};

    /// A floor of 8 x 8 at height 1 and a wall on it along y at x = 0, 1 high.
    fn floor_and_wall(up: Vec3) -> Surface {
        let turn = glam::Quat::from_rotation_arc(Vec3::Z, up);
        let mut surface = Surface::default();
        let mut quad = |corners: [Vec3; 4], normal: Vec3| {
            let first = surface.vertices.len() as u32;
            for c in corners {
                surface.vertices.push((turn * c).to_array());
                surface.normals.push((turn * normal).to_array());
            }
            surface
                .triangles
                .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        };
        let v = Vec3::new;
        quad([v(-4., -4., 1.), v(4., -4., 1.), v(4., 4., 1.), v(-4., 4., 1.)], Vec3::Z);
        quad([v(0., -3., 1.), v(0., 3., 1.), v(0., 3., 2.), v(0., -3., 2.)], Vec3::X);
        surface
    }

    fn light(of: impl Fn(usize, usize) -> f32) -> Environment {
        let data = (0..64 * 32).flat_map(|i| [of(i % 64, i / 64); 3]).collect();
        let image = ImageF32::from_data(64, 32, 3, data);
        let orientation = motes_shading::environment::Orientation::new(
            motes_shading::environment::Convention::Blender,
        );
        let options = MapOptions { orientation, ..MapOptions::default() };
        Environment::new(Some(EnvironmentMap::new(&image, &options).unwrap()), None)
    }

    const OPTIONS: ShadowOptions =
        ShadowOptions { shadow_size: 48, shadow_samples: 1024, shadow_margin: 2.0 };

    #[test]
    fn half_the_sky_is_half_the_light_beside_a_long_wall() {
        let plane =
            shadow_plane(&floor_and_wall(Vec3::Z), &light(|_, _| 1.0), Vec3::Z, &OPTIONS, 0)
                .unwrap();
        assert!((plane.summary.ground_height - 1.0).abs() < 1e-4);
        assert_eq!(plane.summary.occluders, 2);
        // At distance d of an endless wall of height h the open share is (1 + d / sqrt(d² + h²)) / 2.
        let (width, rows) = (plane.ratio.width, plane.ratio.height);
        for x in [width / 2 - 3, width / 2 + 2, width / 2 + 6] {
            let d = (x as f32 + 0.5 - width as f32 / 2.0) * plane.summary.size[0] / width as f32;
            let expected = 0.5 * (1.0 + d.abs() / (d * d + 1.0).sqrt());
            let got = plane.ratio.pixel(x, rows / 2)[0];
            assert!((got - expected).abs() < 0.04, "{d}: {got} {expected}");
        }
    }

    #[test]
    fn a_sun_casts_its_shadow_on_the_far_side_whatever_is_up() {
        for up in [Vec3::Z, Vec3::Y] {
            // Low over +x of a world with z up; turned along with the scene.
            let sun = light(
                |x, y| if (30..34).contains(&x) && (8..10).contains(&y) { 50.0 } else { 0.0 },
            );
            let turned = up == Vec3::Y;
            let surface = floor_and_wall(up);
            let plane = shadow_plane(&surface, &sun, up, &OPTIONS, 0).unwrap();
            assert_eq!(plane.corners.len(), 4);
            if !turned {
                let (width, rows) = (plane.ratio.width, plane.ratio.height);
                assert!(plane.ratio.pixel(width / 2 - 3, rows / 2)[0] < 0.02);
                assert!(plane.ratio.pixel(width / 2 + 4, rows / 2)[0] > 0.98);
            }
            let [a, b, c, _] = plane.corners.map(Vec3::from);
            assert!((b - a).cross(c - b).normalize().dot(up) > 0.999, "seen from above");
        }
    }

    #[test]
    fn no_ground_and_nothing_on_it_are_said() {
        let all = floor_and_wall(Vec3::Z);
        let of = |triangles: &[[u32; 3]]| Surface { triangles: triangles.to_vec(), ..all.clone() };
        let shadow =
            |s: &Surface| shadow_plane(s, &light(|_, _| 1.0), Vec3::Z, &OPTIONS, 0).map(|_| ());
        assert_eq!(shadow(&of(&all.triangles[..2])), Err(ShadowError::NoObjects));
        assert_eq!(shadow(&of(&all.triangles[2..])), Err(ShadowError::NoGround));
        assert_eq!(shadow(&Surface::default()), Err(ShadowError::NoGround));
    }
}
