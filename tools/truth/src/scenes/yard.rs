//! Before a house: a brick wall, paving in hard sun, spokes and slats, sky beside and above.

use glam::{DVec3, Vec3};

use super::{SceneRecipe, Thing, Views, Wall, at, block, overcast, paint, sky};
use crate::faults::Fault;
use crate::shapes::Shape;
use crate::texture::Pattern;

/// Where the wall is, in units of the scene.
const WALL: f32 = 0.75;

pub(super) fn recipe() -> SceneRecipe {
    let slabs = [0x8f8a82, 0x9d978d, 0x7f7a73, 0xa8a196];
    SceneRecipe {
        name: "yard",
        unit: 2.2,
        origin: Vec3::new(3.0, -1.0, 1.5),
        lambert: false,
        waves: 0.0,
        has_ground: true,
        ground: paint(Pattern::Patches, &slabs, 0.3, 0.9, 0.0),
        things: [bench(), bicycle(), plants()].concat(),
        walls: walls(),
        lamps: Vec::new(),
        meters_lamps: true,
        views: Views {
            distance: 1.9,
            elevation_deg: (6.0, 34.0),
            azimuth_deg: (-150.0, 120.0),
            target: DVec3::new(0.0, 0.1, 0.3),
            unsteady: 3.0,
        },
        focal: 0.85,
        is_masked: false,
        faults: Fault::PHONE.to_vec(),
        capture_light: ("morning", sky(-20.0, 34.0, 3.0, 2.2)),
        relights: vec![
            ("evening", sky(-150.0, 12.0, 2.5, 1.0)),
            ("noon", sky(-95.0, 62.0, 3.0, 2.8)),
            ("overcast", overcast()),
        ],
    }
}

fn walls() -> Vec<Wall> {
    let brick = [0x8c4a38, 0x9a5642, 0x7d4132, 0xa8654e];
    vec![Wall {
        corner: Vec3::new(-1.3, WALL, 0.0),
        along: Vec3::new(2.6, 0.0, 0.0),
        up: Vec3::new(0.0, 0.0, 1.15),
        paint: paint(Pattern::Patches, &brick, 0.1, 0.95, 0.0),
    }]
}

/// Slats on two feet.
fn bench() -> Vec<Thing> {
    let teak = paint(Pattern::Boards, &[0x9b7a55, 0xa88763, 0x8b6b49], 0.05, 0.7, 0.0);
    let iron = paint(Pattern::Plain, &[0x35383a], 1.0, 0.5, 0.0);
    let slat = || block(0.42, 0.026, 0.012, 0.12);
    let seat = [("slat_1", 0.3), ("slat_2", 0.37), ("slat_3", 0.44)];
    let mut all = Vec::from(seat.map(|(name, y)| at(name, slat(), &teak, (-0.4, y), 0.22)));
    let rest = || block(0.42, 0.012, 0.028, 0.12);
    all.push(at("rest_1", rest(), &teak, (-0.4, 0.49), 0.3));
    all.push(at("rest_2", rest(), &teak, (-0.4, 0.5), 0.39));
    for (name, x) in [("foot_left", -0.74), ("foot_right", -0.06)] {
        all.push(at(name, block(0.018, 0.1, 0.11, 0.1), &iron, (x, 0.38), 0.0));
    }
    all
}

/// Two wheels with a frame of tubes, against the wall.
fn bicycle() -> Vec<Thing> {
    let rubber = paint(Pattern::Plain, &[0x1d1d1f], 1.0, 0.8, 0.0);
    let enamel = paint(Pattern::Plain, &[0x2f6f63], 1.0, 0.2, 0.0);
    let upright = Vec3::new(std::f32::consts::FRAC_PI_2, 0.0, 0.0);
    let wheel = |name, x| Thing {
        turned: upright,
        ..at(name, Shape::Torus { ring: 0.14, tube: 0.014 }, &rubber, (x, 0.6), 0.0)
    };
    let tube = |name, x, lift, half_length, lean| Thing {
        turned: Vec3::new(0.0, lean, 0.0),
        ..at(name, Shape::Capsule { radius: 0.013, half_length }, &enamel, (x, 0.6), lift)
    };
    vec![
        wheel("wheel_back", 0.3),
        wheel("wheel_front", 0.78),
        tube("tube_top", 0.52, 0.3, 0.16, 1.5),
        tube("tube_down", 0.56, 0.13, 0.15, 0.8),
        tube("tube_seat", 0.4, 0.13, 0.13, -0.3),
        tube("fork", 0.74, 0.13, 0.14, -0.25),
        at("saddle", block(0.05, 0.025, 0.014, 0.6), &rubber, (0.36, 0.6), 0.4),
    ]
}

/// A tub with a shrub, a climber on the wall, a can, a ball; trees far behind the cameras and beside the house.
fn plants() -> Vec<Thing> {
    let zinc = paint(Pattern::Clouds, &[0x9aa0a3, 0x8a9093], 0.2, 0.35, 1.0);
    let glaze = paint(Pattern::Clouds, &[0x2e4f7a, 0x27456b], 0.2, 0.15, 0.0);
    let leaf = paint(Pattern::Clouds, &[0x3d6b2c, 0x55853a, 0x2f5523], 0.12, 0.55, 0.0);
    let tree = paint(Pattern::Clouds, &[0x2d4d22, 0x426532], 0.1, 0.6, 0.0);
    let red = paint(Pattern::Stripes, &[0xc23b32, 0xe9e2d3], 0.07, 0.35, 0.0);
    let leaves = |radius, leaf, count| Shape::Leaves { radius, leaf, count };
    let mut all = vec![
        at("tub", Shape::Vase { radius: 0.15, half_height: 0.16 }, &glaze, (0.2, 0.05), 0.0),
        at("shrub", leaves(0.22, 0.05, 480), &leaf, (0.2, 0.05), 0.24),
        at("climber", leaves(0.3, 0.07, 380), &leaf, (-1.05, 0.66), 0.2),
        at("can", Shape::Vase { radius: 0.08, half_height: 0.1 }, &zinc, (-0.35, -0.1), 0.0),
        at("ball", block(0.07, 0.07, 0.07, 1.0), &red, (-0.05, -0.35), 0.0),
    ];
    let trees = [
        ("tree_a", 2.6, 1.9),
        ("tree_b", -2.9, 1.5),
        ("tree_c", 2.4, -2.8),
        ("tree_d", -2.2, -3.0),
        ("tree_e", 0.3, -3.8),
    ];
    all.extend(trees.map(|(name, x, y)| Thing {
        size: 1.6,
        ..at(name, leaves(0.5, 0.06, 900), &tree, (x, y), 0.25)
    }));
    all
}
