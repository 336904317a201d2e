//! A sun over a floor and a ball.

use motes_math::rng::keyed_rng;
use motes_scene::{Convention, Surface};
use motes_shading::environment::Orientation;
use rand::RngExt;

use super::super::pairs::{Likeness, PairOptions, choose_pairs};
use super::super::transport::{TracedCells, TransportOptions};
use super::*;
use crate::toy_ball::ball;

const BIAS: f32 = 1e-3;
const BALL: f32 = 0.4;

/// A floor at z = 0 and a ball that floats over it.
fn scene() -> TracedSurface {
    let mut s = Surface::default();
    let of_ball = ball(12, |_| BALL);
    s.vertices = of_ball.vertices.iter().map(|[x, y, z]| [*x, *y, z + 0.7]).collect();
    (s.normals, s.triangles) = (of_ball.normals, of_ball.triangles);
    let first = s.vertices.len() as u32;
    s.vertices.extend([[-3.0, -3.0, 0.0], [3.0, -3.0, 0.0], [3.0, 3.0, 0.0], [-3.0, 3.0, 0.0]]);
    s.normals.extend([[0.0, 0.0, 1.0]; 4]);
    s.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v| first + v)));
    TracedSurface::new(s).unwrap()
}

fn samples() -> Vec<Sample> {
    let at = |k: u64| {
        let mut rng = keyed_rng(3, 4, k);
        let mut place = || rng.random::<f32>() * 3.0 - 1.5;
        Sample { position: Vec3::new(place(), place(), 0.0), ..Sample::facing_z(Vec::new()) }
    };
    (0..1500).map(at).collect()
}

const OPTIONS: TransportOptions = TransportOptions {
    rays_per_side: 2,
    bounce_rays: 0,
    lamp_rays: 0,
    bias: BIAS,
    visibility: true,
    seed: 5,
};

fn even() -> CellLight {
    CellLight::uniform(32, 16, Vec3::ONE, Orientation::new(Convention::Blender))
}

/// Tiles of two colors under a sky of radiance 1 and a sun.
fn lit(scene: &TracedSurface, samples: &[Sample], sun: Vec3, strength: f32) -> LitPoints {
    lit_tiles(scene, samples, sun, strength, 4.0)
}

/// The same with this many tiles per unit.
fn lit_tiles(
    scene: &TracedSurface,
    samples: &[Sample],
    sun: Vec3,
    strength: f32,
    tiles: f32,
) -> LitPoints {
    let transport = TracedCells::default().transport(scene, samples, &even(), &OPTIONS);
    let mut lit = LitPoints { radiance: vec![Vec3::ONE; samples.len()], transport };
    let sky = lit.shading(&even().sources());
    let shade = |(s, sky): (&Sample, Vec3)| {
        let origin = offset_origin(s.position, s.geometric_normal, sun, BIAS);
        let open = f32::from(!scene.tracer.occluded(&Ray::new(origin, sun)));
        let tile = (s.position.x * tiles).floor() + (s.position.y * tiles).floor();
        let base = if tile.rem_euclid(2.0) == 0.0 { 0.5 } else { 0.2 };
        (sky + Vec3::new(1.2, 1.0, 0.8) * (strength * open * s.normal.dot(sun).max(0.0))) * base
    };
    lit.radiance = samples.iter().zip(sky).map(shade).collect();
    lit
}

fn found(scene: &TracedSurface, samples: &[Sample], lit: &LitPoints) -> Option<Sun> {
    let likeness = Likeness { radius: 0.3, chroma: f32::INFINITY };
    let features: Vec<[f32; 5]> =
        samples.iter().zip(&lit.radiance).map(|(s, l)| likeness.feature(s.position, *l)).collect();
    let pairs = choose_pairs(&features, &PairOptions { count: 8, among: 100, seed: 6 });
    let (points, even) = (samples.iter().collect(), &even());
    SunSearch { scene, points, even, lit, pairs: &pairs, sigma: 0.05, ray_bias: BIAS }.find()
}

#[test]
fn the_shadow_of_a_ball_tells_where_the_sun_is_and_how_strong() {
    let (scene, samples) = (scene(), samples());
    for sun in [Vec3::new(0.3, -0.5, 0.8), Vec3::new(-0.6, 0.1, 0.7)].map(Vec3::normalize) {
        let found = found(&scene, &samples, &lit(&scene, &samples, sun, 4.0)).unwrap();
        let off = found.direction.angle_between(sun).to_degrees();
        println!("{off} degrees off, strength {} for 4, saves {}", found.strength, found.saving);
        assert!(off < 3.0, "{off} degrees");
        assert_eq!(found.strength, 4.0);
    }
}

#[test]
fn a_sun_that_saves_little_over_texture_is_found_and_a_weak_one_is_not() {
    let (scene, samples) = (scene(), samples());
    let sun = Vec3::new(0.3, -0.5, 0.8).normalize();
    let of = |strength: f32, tiles: f32| {
        found(&scene, &samples, &lit_tiles(&scene, &samples, sun, strength, tiles))
    };
    let strong = of(2.0, 5.0).unwrap();
    println!("strength {}, saves {}", strong.strength, strong.saving);
    assert!(strong.saving < LEAST_SAVING && strong.strength >= STRONG, "{strong:?}");
    assert!(strong.direction.angle_between(sun).to_degrees() < 5.0, "{strong:?}");
    assert!(of(0.2, 5.0).is_none());
}

#[test]
fn no_sun_is_found_where_none_casts_a_shadow_and_extremes_stay_finite() {
    let (scene, samples) = (scene(), samples());
    let overcast = lit(&scene, &samples, Vec3::Z, 0.0);
    assert!(found(&scene, &samples, &overcast).is_none());
    for radiance in [0.0, f32::MAX] {
        let of = |_: &Sample| Vec3::splat(radiance);
        let transport = overcast.transport.clone();
        let lit = LitPoints { radiance: samples.iter().map(of).collect(), transport };
        let saving = found(&scene, &samples, &lit).map_or(0.0, |sun| sun.saving);
        assert!((0.0..=1.0).contains(&saving), "{radiance}: {saving}");
    }
    assert!(found(&scene, &[], &lit(&scene, &[], Vec3::Z, 1.0)).is_none());
}

#[test]
fn points_see_the_sun_or_lie_in_its_shadow() {
    let (scene, samples, sun) = (scene(), samples(), Vec3::new(0.3, -0.5, 0.8).normalize());
    let mut light = even();
    let mut traced = TracedCells::default();
    let open = |light: &CellLight, traced: &mut TracedCells| {
        let transport = traced.transport(&scene, &samples, light, &OPTIONS);
        let radiance = vec![Vec3::ONE; samples.len()];
        open_to_sun(light, &LitPoints { transport, radiance })
    };
    assert!(open(&light, &mut traced).is_none(), "an even light has no sun");
    for _ in 0..3 {
        let at = light.cell_toward(sun).unwrap();
        let near = light.cells.iter().map(|c| c.touches(&light.cells[at])).collect::<Vec<_>>();
        light.divide(&near);
    }
    assert!(open(&light, &mut traced).is_none(), "nor has one in fine cells");
    let at = light.cell_toward(sun).unwrap();
    light.radiance[at] = Vec3::splat(5e3);
    let open = open(&light, &mut traced).unwrap();
    let (mut wrong, mut shadowed) = (0, 0);
    for (s, open) in samples.iter().zip(open) {
        // Distance of the ray toward the sun from the center of the ball.
        let to_center = Vec3::new(0.0, 0.0, 0.7) - s.position;
        let past = (to_center - sun * to_center.dot(sun)).length() / BALL;
        shadowed += usize::from(past < 0.85);
        wrong += usize::from(if past < 0.85 { open > 0.0 } else { past > 1.15 && open < 1.0 });
    }
    assert!(shadowed > 50 && wrong == 0, "{wrong} wrong, {shadowed} in the shadow");
}

#[test]
fn cells_that_were_traced_are_not_traced_again() {
    let (scene, samples) = (scene(), samples());
    let (mut light, mut traced) = (even(), TracedCells::default());
    let before = traced.transport(&scene, &samples, &light, &OPTIONS);
    light.divide(&(0..512).map(|j| j == 40).collect::<Vec<_>>());
    // No ray of this kind meets anything.
    let blind = TransportOptions { visibility: false, ..OPTIONS };
    let after = traced.transport(&scene, &samples, &light, &blind);
    for p in 0..samples.len() {
        let (a, b) = (&before.cells[512 * p..][..512], &after.cells[515 * p..][..515]);
        assert_eq!((&a[..40], &a[41..]), (&b[..40], &b[44..]));
        let mean: f32 = b[40..44].iter().sum();
        assert!((mean - a[40]).abs() < 0.5 * mean + 1e-3 || a[40] == 0.0, "{mean} {}", a[40]);
    }
}
