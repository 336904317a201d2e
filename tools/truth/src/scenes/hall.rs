//! An entrance hall: what reflects and what is looked through.

use glam::{DVec3, Vec3};

use super::{SceneRecipe, Thing, Views, Wall, block, overcast, paint, raised, sky, thing};
use crate::faults::Fault;
use crate::lamps::{Lamp, LampShape};
use crate::lights::Light;
use crate::shapes::Shape;
use crate::texture::{Paint, Pattern};

/// Where the back wall is, and the top of the table before it; meters as everything here.
const WALL: f32 = 0.9;
const TABLE: f32 = 0.72;

pub(super) fn recipe() -> SceneRecipe {
    SceneRecipe {
        name: "hall",
        unit: 1.3,
        origin: Vec3::new(-2.2, 1.4, 0.2),
        lambert: false,
        waves: 0.0,
        has_ground: true,
        ground: paint(Pattern::Patches, &[0x8a7f72, 0xb8ab99, 0x6d6459, 0xa0917d], 0.22, 0.14, 0.0),
        things: things(),
        walls: walls(),
        lamps: lamps(),
        meters_lamps: true,
        views: Views {
            distance: 2.2,
            elevation_deg: (6.0, 34.0),
            azimuth_deg: (-132.0, 104.0),
            target: DVec3::new(0.0, 0.5, 0.72),
            unsteady: 3.0,
        },
        focal: 0.95,
        is_masked: false,
        faults: Fault::ALL.to_vec(),
        // What comes in at the open sides.
        capture_light: ("dim", Light::Boxes { room: Vec3::splat(0.3), boxes: Vec::new() }),
        relights: vec![
            ("morning", sky(-60.0, 20.0, 3.0, 1.4)),
            ("afternoon", sky(-120.0, 42.0, 3.0, 2.4)),
            ("overcast", overcast()),
        ],
    }
}

fn walls() -> Vec<Wall> {
    let plaster = |color: u32| paint(Pattern::Clouds, &[color, color + 0x02_02_02], 1.2, 0.9, 0.0);
    let up = Vec3::new(0.0, 0.0, 2.6);
    vec![
        Wall {
            corner: Vec3::new(-1.9, WALL, 0.0),
            along: Vec3::new(5.0, 0.0, 0.0),
            up,
            paint: plaster(0xc9bfae),
        },
        Wall {
            corner: Vec3::new(-1.9, -1.6, 0.0),
            along: Vec3::new(0.0, 2.5, 0.0),
            up,
            paint: plaster(0x9fb0a6),
        },
    ]
}

fn lamps() -> Vec<Lamp> {
    vec![
        Lamp {
            name: "pendant",
            shape: LampShape::Ball { center: Vec3::new(0.75, 0.45, 1.75), radius: 0.11 },
            radiance: Vec3::new(1.0, 0.8, 0.56) * 16.0,
        },
        Lamp {
            name: "skylight",
            shape: LampShape::Pane {
                corner: Vec3::new(-1.895, -0.9, 1.1),
                along: Vec3::new(0.0, 0.7, 0.0),
                up: Vec3::new(0.0, 0.0, 0.9),
            },
            radiance: Vec3::new(0.85, 0.94, 1.08) * 5.0,
        },
    ]
}

fn glass(thing: Thing, lift: f32) -> Thing {
    Thing { is_glass: true, lift, ..thing }
}

fn silver() -> Paint {
    paint(Pattern::Plain, &[0xf4f4f2], 1.0, 0.03, 1.0)
}

/// A table with a glass vase and a bowl under a mirror, a glazed picture, a coat stand with a coat, a basket.
fn things() -> Vec<Thing> {
    let none = (0.0, 0.0, 0.0);
    let oak = paint(Pattern::Boards, &[0x7a5230, 0x8d6440, 0x694526], 0.1, 0.35, 0.0);
    let frame = paint(Pattern::Boards, &[0x3a2c22, 0x463629], 0.08, 0.4, 0.0);
    let clear = paint(Pattern::Plain, &[0xf4faf7], 1.0, 0.0, 0.0);
    let leaf = paint(Pattern::Clouds, &[0x3f6b33, 0x5d8a48, 0x33582b], 0.12, 0.6, 0.0);
    let poster = paint(Pattern::Patches, &[0xc94f3d, 0xe8d9b5, 0x2e5c6e, 0xd9a441], 0.09, 0.9, 0.0);
    let glaze = paint(Pattern::Stripes, &[0x2d4f7c, 0xe9e3d2, 0x7c9bb5], 0.09, 0.2, 0.0);
    let cloth = paint(Pattern::Stripes, &[0x4a4f5e, 0x5d6374, 0x3c404d], 0.05, 1.0, 0.0);
    let reed = paint(Pattern::Stripes, &[0xa9824f, 0x8c693c, 0xbd9a68], 0.04, 0.8, 0.0);
    let iron = paint(Pattern::Clouds, &[0x2a2a2c, 0x343436], 0.3, 0.45, 0.0);
    let leg = || Shape::Capsule { radius: 0.016, half_length: 0.33 };
    let pole = |half_length| Shape::Capsule { radius: 0.018, half_length };
    let vase = Shape::Vase { radius: 0.3, half_height: 0.5 };
    let leaves = Shape::Leaves { radius: 0.16, leaf: 0.07, count: 130 };
    let back = WALL - 0.02;
    let mut all = vec![
        raised(
            thing("table", block(0.5, 0.17, 0.018, 0.1), oak, 1.0, (0.0, 0.68), none),
            TABLE - 0.036,
        ),
        raised(
            thing("mirror", block(0.3, 0.01, 0.38, 0.06), silver(), 1.0, (-0.2, back), none),
            0.95,
        ),
        raised(
            thing("poster", block(0.2, 0.008, 0.27, 0.06), poster, 1.0, (0.42, back), none),
            1.02,
        ),
        glass(
            thing(
                "pane",
                block(0.2, 0.002, 0.27, 0.06),
                clear.clone(),
                1.0,
                (0.42, back - 0.025),
                none,
            ),
            1.02,
        ),
        glass(thing("vase", vase, clear, 0.26, (-0.28, 0.64), none), TABLE),
        raised(thing("bouquet", leaves, leaf, 1.0, (-0.28, 0.64), none), TABLE + 0.2),
        raised(thing("bowl", block(0.13, 0.13, 0.055, 0.9), glaze, 1.0, (0.16, 0.66), none), TABLE),
        raised(thing("basket", block(0.17, 0.17, 0.16, 0.5), reed, 1.0, (0.3, 0.5), none), 0.0),
        raised(thing("stand", pole(0.78), iron.clone(), 1.0, (0.86, 0.56), none), 0.0),
        raised(
            thing(
                "coat",
                Shape::Cloth { axes: Vec3::new(0.14, 0.09, 0.4), wrinkles: 0.03 },
                cloth,
                1.0,
                (0.86, 0.46),
                none,
            ),
            0.62,
        ),
    ];
    for (name, x, y) in [
        ("leg_1", -0.46, 0.55),
        ("leg_2", 0.46, 0.55),
        ("leg_3", -0.46, 0.81),
        ("leg_4", 0.46, 0.81),
    ] {
        all.push(thing(name, leg(), iron.clone(), 1.0, (x, y), none));
    }
    all.extend(hooks(&iron));
    let rail = |name, x: f32, half: f32| {
        raised(
            thing(name, block(0.012, 0.016, half, 0.2), frame.clone(), 1.0, (x, back), none),
            0.93,
        )
    };
    all.extend([rail("frame_1", -0.515, 0.4), rail("frame_2", 0.115, 0.4)]);
    all
}

/// Rings about the top of the coat stand.
fn hooks(iron: &Paint) -> [Thing; 3] {
    [("hook_1", 0.0), ("hook_2", 2.1), ("hook_3", 4.2)].map(|(name, turn)| {
        let hook = Shape::Torus { ring: 0.05, tube: 0.009 };
        let (s, c) = f32::sin_cos(turn);
        let place = (0.86 + 0.06 * c, 0.56 + 0.06 * s);
        let turned = (std::f32::consts::FRAC_PI_2, 0.0, turn);
        raised(thing(name, hook, iron.clone(), 1.0, place, turned), 1.4)
    })
}
