//! Tearing is calibrated on made scenes: relit by their true geometry they set the floor, and the worse the normals, the higher it is.
//!
//! Edges of true shadows are part of the floor: under shrubs they are most of it.

#![allow(clippy::unwrap_used, reason = "tests")]

use glam::{IVec3, Vec3};
use motes_math::srgb;
use motes_scene::ImageU8;
use motes_shading::brdf::Lobes;
use motes_shading::sampling::{PointSet, unit_f32};
use motes_shading::tracing::{Ray, offset_origin};
use motes_truth::cameras::ring;
use motes_truth::render::{Buffers, buffers};
use motes_truth::scenes::SceneName;
use motes_truth::score::tearing::tearing;
use motes_truth::world::World;

const SIZE: (usize, usize) = (240, 180);
/// Side of the pieces that a normal is wrong over, units of the scene.
const PIECE: f32 = 0.04;
/// Even light from everywhere, and light of the sun on what faces it.
const LIGHT: (f32, f32) = (0.25, 0.7);

struct View {
    world: World,
    buffers: Buffers,
    /// World units of a piece.
    piece: f32,
}

impl View {
    fn of(name: SceneName) -> Self {
        let recipe = name.recipe();
        let world = World::new(&recipe, Lobes::Lambert).unwrap();
        let buffers = buffers(&world, &ring(&recipe, SIZE, 0, 1)[0]);
        Self { world, buffers, piece: PIECE * recipe.unit }
    }

    /// Matte, under a sun of `elevation` degrees, the normals of all pieces turned by up to an angle whose tangent is that of `wrong` degrees.
    fn lit(&self, elevation: f32, wrong: f32, with_shadows: bool) -> ImageU8 {
        let (sin, cos) = elevation.to_radians().sin_cos();
        let to_sun = Vec3::new(0.6 * cos, 0.8 * cos, sin);
        let b = &self.buffers;
        let at = |data: &[f32], i: usize| Vec3::from_slice(&data[3 * i..3 * i + 3]);
        let pixel = |i: usize| {
            if b.ids[i] == 0 {
                return [0; 3];
            }
            let (p, n) = (at(&b.position.data, i), at(&b.normal.data, i));
            let origin = offset_origin(p, n, to_sun, 1e-3 * self.piece);
            let open = !with_shadows || !self.world.occluded(&Ray::new(origin, to_sun));
            let facing = turned(n, (p / self.piece).floor().as_ivec3(), wrong).dot(to_sun).max(0.0);
            let light = LIGHT.0 + if open { LIGHT.1 * facing } else { 0.0 };
            let color = (at(&b.albedo.data, i) * light).to_array();
            color.map(|v| (255.0 * srgb::encode_clipped(v)).round() as u8)
        };
        let data = (0..SIZE.0 * SIZE.1).flat_map(pixel).collect();
        ImageU8::from_data(SIZE.0, SIZE.1, 3, data)
    }

    fn tearing(&self, elevation: f32, wrong: f32, with_shadows: bool) -> f64 {
        let captured = self.lit(75.0, 0.0, with_shadows);
        let relit = self.lit(elevation, wrong, with_shadows);
        let (torn, smooth) = tearing(&captured, &relit, &self.buffers.depth.data).unwrap();
        assert!(smooth > 0.2, "{smooth}");
        torn
    }
}

/// A unit normal aside by up to `degrees`, one direction per cell.
fn turned(normal: Vec3, cell: IVec3, degrees: f32) -> Vec3 {
    let key = cell.to_array().iter().fold(7u64, |k, v| k.wrapping_mul(1_000_003) ^ *v as u64);
    let [_, a, b] = PointSet::new(1, key, 1, 1).point(0)[..3] else { return normal };
    let (phase, far) = (std::f32::consts::TAU * unit_f32(a), unit_f32(b).sqrt());
    let (s, t) = normal.any_orthonormal_pair();
    (normal + degrees.to_radians().tan() * far * (phase.cos() * s + phase.sin() * t)).normalize()
}

#[test]
fn wrong_normals_tear_and_true_geometry_does_not() {
    for name in [SceneName::Hillside, SceneName::Garden, SceneName::Bedroom] {
        let view = View::of(name);
        for elevation in [20.0, 45.0] {
            for shadows in [false, true] {
                let of = [0.0, 5.0, 10.0, 20.0, 40.0].map(|w| view.tearing(elevation, w, shadows));
                println!("{name:?}, sun at {elevation}, shadows {shadows}: {of:.4?}");
                assert!(shadows || of[0] < 0.03, "{name:?} {elevation}: {of:?}");
                assert!(of.is_sorted_by(|a, b| a < b), "{name:?} {elevation} {shadows}: {of:?}");
                assert!(of[3] > of[0] + 0.01, "{name:?} {elevation} {shadows}: {of:?}");
            }
        }
    }
}
