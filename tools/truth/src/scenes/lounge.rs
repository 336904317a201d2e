//! A living room between three walls: furniture of cloth and lacquer, many small things, a lamp and a window.

use glam::{DVec3, Vec3};

use super::{SceneRecipe, Thing, Views, Wall, at, block, overcast, paint, sky};
use crate::faults::Fault;
use crate::lamps::{Lamp, LampShape};
use crate::lights::Light;
use crate::shapes::Shape;
use crate::texture::Pattern;

/// Where the back wall is, and the seat of the sofa before it; meters as everything here.
const BACK: f32 = 1.35;
const SEAT: f32 = 0.38;

pub(super) fn recipe() -> SceneRecipe {
    let parquet = paint(Pattern::Boards, &[0x9a6f45, 0xa87c51, 0x8b623b], 0.11, 0.32, 0.0);
    SceneRecipe {
        name: "lounge",
        unit: 1.7,
        origin: Vec3::new(0.8, 2.6, -0.4),
        lambert: false,
        waves: 0.0,
        has_ground: true,
        ground: parquet,
        things: [seats(), shelf(), small_things()].concat(),
        walls: walls(),
        lamps: lamps(),
        meters_lamps: false,
        views: Views {
            distance: 2.7,
            elevation_deg: (8.0, 36.0),
            azimuth_deg: (-135.0, 96.0),
            target: DVec3::new(0.0, 0.5, 0.55),
            unsteady: 3.0,
        },
        focal: 0.8,
        is_masked: false,
        faults: Fault::PHONE.to_vec(),
        // What comes in at the open side.
        capture_light: ("dim", Light::Boxes { room: Vec3::splat(0.2), boxes: Vec::new() }),
        relights: vec![
            ("morning", sky(-35.0, 24.0, 3.0, 1.5)),
            ("noon", sky(-110.0, 58.0, 3.0, 2.6)),
            ("overcast", overcast()),
        ],
    }
}

fn walls() -> Vec<Wall> {
    let up = Vec3::new(0.0, 0.0, 2.4);
    let wall = |corner: [f32; 3], along: [f32; 3], color: u32| Wall {
        corner: corner.into(),
        along: along.into(),
        up,
        paint: paint(Pattern::Clouds, &[color, color + 0x01_01_01], 1.4, 0.9, 0.0),
    };
    vec![
        wall([-2.1, BACK, 0.0], [4.2, 0.0, 0.0], 0xd9d4c8),
        wall([-2.1, -1.6, 0.0], [0.0, 2.95, 0.0], 0xd3cec4),
        wall([2.1, BACK, 0.0], [0.0, -2.2, 0.0], 0x5f7f8c),
    ]
}

fn lamps() -> Vec<Lamp> {
    vec![
        Lamp {
            name: "floor_lamp",
            shape: LampShape::Ball { center: Vec3::new(1.45, 0.95, 1.32), radius: 0.14 },
            radiance: Vec3::new(1.0, 0.76, 0.5) * 14.0,
        },
        Lamp {
            name: "window",
            shape: LampShape::Pane {
                corner: Vec3::new(-2.09, -0.7, 0.8),
                along: Vec3::new(0.0, 1.1, 0.0),
                up: Vec3::new(0.0, 0.0, 1.1),
            },
            radiance: Vec3::new(0.84, 0.94, 1.1) * 4.5,
        },
    ]
}

fn turned(thing: Thing, radians: f32) -> Thing {
    Thing { turned: Vec3::new(0.0, 0.0, radians), ..thing }
}

/// A sofa with cushions and a throw, and a pouf.
fn seats() -> Vec<Thing> {
    let wool = paint(Pattern::Clouds, &[0x6f7a86, 0x7b8692, 0x65707b], 0.08, 1.0, 0.0);
    let mustard = paint(Pattern::Clouds, &[0xc99a3a, 0xb98a30], 0.1, 1.0, 0.0);
    let ticking = paint(Pattern::Stripes, &[0xe6e0d4, 0x8a2f2a, 0xe6e0d4], 0.06, 0.95, 0.0);
    let knit = paint(Pattern::Speckles, &[0xe2dccf, 0xcfc7b6, 0xb8ae9b], 0.04, 1.0, 0.0);
    let cloth = |x, y, z| Shape::Cloth { axes: Vec3::new(x, y, z), wrinkles: 0.02 };
    vec![
        at("sofa_seat", block(0.82, 0.4, 0.16, 0.15), &wool, (-0.2, 0.86), SEAT - 0.32),
        at("sofa_back", block(0.82, 0.12, 0.24, 0.2), &wool, (-0.2, 1.18), SEAT),
        at("sofa_arm_left", block(0.1, 0.42, 0.26, 0.25), &wool, (-1.1, 0.86), 0.06),
        at("sofa_arm_right", block(0.1, 0.42, 0.26, 0.25), &wool, (0.7, 0.86), 0.06),
        turned(at("cushion_left", cloth(0.22, 0.09, 0.2), &mustard, (-0.72, 0.98), SEAT), 0.35),
        turned(at("cushion_right", cloth(0.22, 0.09, 0.2), &ticking, (0.34, 0.98), SEAT), -0.3),
        at("throw", cloth(0.26, 0.3, 0.05), &knit, (-0.18, 0.8), SEAT - 0.01),
        at("pouf", cloth(0.24, 0.24, 0.18), &mustard, (0.82, -0.2), 0.0),
    ]
}

/// An open shelf against the right wall, with books and a ball.
fn shelf() -> Vec<Thing> {
    let lacquer = paint(Pattern::Plain, &[0xe9e7e2], 1.0, 0.3, 0.0);
    let slab = || block(0.14, 0.5, 0.012, 0.08);
    let side = || block(0.14, 0.012, 0.45, 0.08);
    let mut all = vec![
        at("shelf_low", slab(), &lacquer, (1.94, 0.3), 0.1),
        at("shelf_middle", slab(), &lacquer, (1.94, 0.3), 0.48),
        at("shelf_top", slab(), &lacquer, (1.94, 0.3), 0.88),
        at("shelf_left", side(), &lacquer, (1.94, -0.2), 0.0),
        at("shelf_right", side(), &lacquer, (1.94, 0.8), 0.0),
    ];
    let books = [
        ("book_1", 0xa33b2e, 0.11),
        ("book_2", 0x2e4f73, 0.13),
        ("book_3", 0xd8c9a0, 0.1),
        ("book_4", 0x3f6b4a, 0.12),
        ("book_5", 0x1f1f24, 0.13),
        ("book_6", 0xc77b2d, 0.1),
    ];
    all.extend(books.into_iter().zip(0u8..).map(|((name, color, half), k)| {
        let cover = paint(Pattern::Clouds, &[color, color + 0x03_03_03], 0.05, 0.6, 0.0);
        at(name, block(0.09, 0.022, half, 0.08), &cover, (1.93, -0.1 + 0.06 * f32::from(k)), 0.504)
    }));
    let globe = paint(Pattern::Patches, &[0x2f5f8a, 0x7da05a, 0xc9b479], 0.1, 0.25, 0.0);
    all.push(at("globe", block(0.12, 0.12, 0.12, 1.0), &globe, (1.94, 0.45), 0.904));
    all
}

/// A low table with cups, a rug under it, a plant, a picture and the pole of the lamp.
fn small_things() -> Vec<Thing> {
    let walnut = paint(Pattern::Boards, &[0x4a3222, 0x573c2a, 0x3f2a1c], 0.08, 0.16, 0.0);
    let kelim = paint(Pattern::Patches, &[0x8f3b33, 0xc9b08a, 0x2f4858, 0xa8663f], 0.16, 1.0, 0.0);
    let iron = paint(Pattern::Plain, &[0x2b2b2d], 1.0, 0.4, 0.0);
    let brass = paint(Pattern::Plain, &[0xc8a04a], 1.0, 0.25, 1.0);
    let china = paint(Pattern::Plain, &[0xf0ede6], 1.0, 0.12, 0.0);
    let clay = paint(Pattern::Clouds, &[0xb4694a, 0xa45c3f], 0.1, 0.8, 0.0);
    let leaf = paint(Pattern::Clouds, &[0x2f6a3a, 0x4c8a4c, 0x27572f], 0.12, 0.5, 0.0);
    let canvas = paint(Pattern::Patches, &[0xd9d2c0, 0xb5483a, 0x35516b, 0xd6a23f], 0.22, 0.9, 0.0);
    let leg = || Shape::Capsule { radius: 0.02, half_length: 0.15 };
    let cup = || Shape::Vase { radius: 0.05, half_height: 0.05 };
    let fronds = Shape::Leaves { radius: 0.34, leaf: 0.14, count: 220 };
    let mut all = vec![
        at("rug", block(1.0, 0.62, 0.008, 0.1), &kelim, (-0.15, -0.05), 0.0),
        at("table", block(0.48, 0.27, 0.02, 0.12), &walnut, (-0.15, 0.05), 0.34),
        at("cup", cup(), &china, (-0.35, 0.02), 0.38),
        at("bowl", Shape::Torus { ring: 0.07, tube: 0.025 }, &brass, (0.02, 0.1), 0.38),
        turned(at("magazine", block(0.11, 0.15, 0.008, 0.08), &canvas, (-0.14, -0.03), 0.38), 0.5),
        at("pole", Shape::Capsule { radius: 0.015, half_length: 0.58 }, &iron, (1.45, 0.95), 0.0),
        at("foot", block(0.14, 0.14, 0.015, 0.9), &iron, (1.45, 0.95), 0.0),
        at("pot", Shape::Vase { radius: 0.16, half_height: 0.2 }, &clay, (-1.62, 0.8), 0.0),
        at("plant", fronds, &leaf, (-1.62, 0.8), 0.4),
        at("picture", block(0.42, 0.012, 0.28, 0.05), &canvas, (-0.2, BACK - 0.02), 1.15),
    ];
    let corners = [("leg_1", -0.55, -0.15), ("leg_2", 0.25, -0.15), ("leg_3", -0.55, 0.25)];
    all.extend(corners.map(|(name, x, y)| at(name, leg(), &iron, (x, y), 0.01)));
    all.push(at("leg_4", leg(), &iron, (0.25, 0.25), 0.01));
    all
}
