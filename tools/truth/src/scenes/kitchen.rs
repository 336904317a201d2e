//! A kitchen along a wall: cabinets with doors and handles, a counter, a few things on it.

use std::f32::consts::FRAC_PI_2;

use glam::{DVec3, Vec3};

use super::{SceneRecipe, Thing, Views, Wall, block, overcast, paint, raised, sky, thing};
use crate::shapes::Shape;
use crate::texture::{Paint, Pattern};

/// Where the top of the counter is, meters as everything here.
const COUNTER: f32 = 0.9;
/// Front of the lower doors, and of the upper ones.
const FRONTS: [f32; 2] = [-0.14, 0.105];
const HANDLE: f32 = 0.02;

pub(super) fn recipe() -> SceneRecipe {
    SceneRecipe {
        name: "kitchen",
        unit: 1.6,
        origin: Vec3::new(0.7, 0.4, -0.3),
        lambert: false,
        waves: 0.0,
        has_ground: true,
        ground: paint(Pattern::Boards, &[0x9a7650, 0x84623f, 0xb08a62], 0.14, 0.6, 0.0),
        things: things(),
        walls: vec![Wall {
            corner: Vec3::new(-3.0, 0.45, 0.0),
            along: Vec3::new(6.0, 0.0, 0.0),
            up: Vec3::new(0.0, 0.0, 2.8),
            paint: paint(Pattern::Patches, &[0xd9d4c8, 0xcfcabd, 0xe2ddd2], 0.16, 0.7, 0.0),
        }],
        lamps: Vec::new(),
        meters_lamps: true,
        views: Views {
            distance: 2.3,
            elevation_deg: (6.0, 30.0),
            azimuth_deg: (-140.0, 100.0),
            target: DVec3::new(0.0, 0.1, 0.85),
            unsteady: 1.0,
        },
        is_masked: false,
        faults: Vec::new(),
        focal: 1.0,
        // The kitchen is open where the cameras are.
        capture_light: ("overcast", overcast()),
        relights: vec![
            ("sunrise", sky(-50.0, 8.0, 3.0, 0.9)),
            ("midday", sky(-90.0, 60.0, 3.0, 2.6)),
            ("evening", sky(-140.0, 12.0, 3.5, 1.1)),
        ],
    }
}

/// Painted wood.
fn lacquer() -> Paint {
    paint(Pattern::Clouds, &[0x8fa387, 0x96a98e, 0x889c80], 0.35, 0.5, 0.0)
}

/// A door with its handle; `lift` is the lower end of the door, `grip` that of the handle.
fn door(
    names: [&'static str; 2],
    front: f32,
    x: f32,
    (half_width, half_height): (f32, f32),
    [lift, grip]: [f32; 2],
) -> [Thing; 2] {
    let steel = paint(Pattern::Clouds, &[0xb9bcc0, 0xc6c8ca], 0.4, 0.35, 1.0);
    let bar = Shape::Capsule { radius: HANDLE, half_length: 0.12 };
    let along_x = (0.0, FRAC_PI_2, 0.0);
    let board = block(half_width, 0.015, half_height, 0.08);
    let none = (0.0, 0.0, 0.0);
    [
        raised(thing(names[0], board, lacquer(), 1.0, (x, front), none), lift),
        raised(thing(names[1], bar, steel, 1.0, (x, front - 0.013 - HANDLE), along_x), grip),
    ]
}

fn things() -> Vec<Thing> {
    let none = (0.0, 0.0, 0.0);
    let stone = paint(Pattern::Speckles, &[0x6f6a63, 0x3f3c38, 0xa9a297], 0.07, 0.45, 0.0);
    let carcass = |name, shape, place| thing(name, shape, lacquer(), 1.0, place, none);
    let mut all = vec![
        raised(carcass("cabinet_carcass", block(0.9, 0.27, 0.4, 0.06), (0.0, 0.15)), 0.06),
        raised(
            thing("counter", block(0.95, 0.31, 0.02, 0.06), stone, 1.0, (0.0, 0.14), none),
            0.86,
        ),
        raised(carcass("cabinet_upper", block(0.6, 0.16, 0.3, 0.06), (0.25, 0.28)), 1.4),
    ];
    let [low, high] = FRONTS;
    for (names, x) in [
        (["cabinet_door_1", "handle_1"], -0.6),
        (["cabinet_door_2", "handle_2"], 0.0),
        (["cabinet_door_3", "handle_3"], 0.6),
    ] {
        all.extend(door(names, low, x, (0.285, 0.375), [0.09, 0.74]));
    }
    for (names, x) in
        [(["cabinet_door_4", "handle_4"], -0.05), (["cabinet_door_5", "handle_5"], 0.55)]
    {
        all.extend(door(names, high, x, (0.285, 0.28), [1.42, 1.47]));
    }
    let jug = paint(Pattern::Patches, &[0x1f4e79, 0xe8e4d8, 0xc27c2c], 0.2, 0.35, 0.0);
    let copper = paint(Pattern::Clouds, &[0xc58b4b, 0xb77a3c], 0.4, 0.38, 1.0);
    let peel = paint(Pattern::Clouds, &[0xe3c02f, 0xd9b122], 0.2, 0.5, 0.0);
    let jug =
        thing("jug", Shape::Vase { radius: 0.36, half_height: 0.5 }, jug, 0.3, (-0.62, 0.1), none);
    let bowl = thing("bowl", block(0.15, 0.15, 0.07, 0.85), copper, 1.0, (-0.18, 0.08), none);
    let lemon = Shape::Capsule { radius: 0.045, half_length: 0.03 };
    let lemon = thing("lemon", lemon, peel, 1.0, (0.2, 0.0), (1.571, 0.0, 0.6));
    all.extend([jug, bowl, lemon].map(|thing| raised(thing, COUNTER)));
    all
}
