//! An interior: light that is near, cloth, large walls without texture.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::{SceneRecipe, Thing, Views, Wall, block, overcast, paint, raised, sky, thing};
use crate::faults::Fault;
use crate::lamps::{Lamp, LampShape};
use crate::lights::Light;
use crate::shapes::Shape;
use crate::texture::{Paint, Pattern};

/// Height of the mattress, in units of the scene.
const BED: f32 = 0.24;

pub(super) fn recipe() -> SceneRecipe {
    let carpet = paint(Pattern::Clouds, &[0x6d6258, 0x857869, 0x5c5148], 0.2, 0.95, 0.0);
    SceneRecipe {
        name: "bedroom",
        unit: 2.4,
        origin: Vec3::new(1.7, -0.8, 0.6),
        lambert: false,
        waves: 0.0,
        has_ground: true,
        ground: carpet,
        things: things(),
        walls: walls(),
        lamps: lamps(),
        meters_lamps: true,
        views: Views {
            distance: 1.15,
            elevation_deg: (16.0, 48.0),
            azimuth_deg: (-62.0, 124.0),
            target: DVec3::new(0.0, 0.0, f64::from(BED) + 0.16),
            unsteady: 3.0,
        },
        focal: 0.95,
        is_masked: false,
        faults: Fault::PHONE.to_vec(),
        // What comes in at the open side of the room.
        capture_light: ("dim", Light::Boxes { room: Vec3::splat(0.12), boxes: Vec::new() }),
        relights: vec![
            ("morning", sky(25.0, 22.0, 3.0, 1.4)),
            ("noon", sky(40.0, 55.0, 3.0, 2.6)),
            ("overcast", overcast()),
        ],
    }
}

/// Nearly without texture, as painted walls are.
fn plaster(color: u32) -> Paint {
    paint(Pattern::Clouds, &[color, color + 0x01_01_01], 1.5, 0.9, 0.0)
}

/// Two walls behind the bed; the cameras stand at the open sides.
fn walls() -> Vec<Wall> {
    let wall = |corner: [f32; 3], along: [f32; 3], color| Wall {
        corner: corner.into(),
        along: along.into(),
        up: Vec3::new(0.0, 0.0, 2.1),
        paint: plaster(color),
    };
    vec![
        wall([-0.95, 3.0, 0.0], [0.0, -4.2, 0.0], 0xcfc8ba),
        wall([-0.95, -1.2, 0.0], [4.0, 0.0, 0.0], 0xb9c2c4),
    ]
    .into_iter()
    .map(facing_in)
    .collect()
}

/// Turned so that its front shows into the room.
fn facing_in(wall: Wall) -> Wall {
    let middle = wall.corner + 0.5 * (wall.along + wall.up);
    if wall.along.cross(wall.up).dot(-middle) > 0.0 {
        return wall;
    }
    Wall { corner: wall.corner + wall.along, along: -wall.along, ..wall }
}

fn lamps() -> Vec<Lamp> {
    vec![
        Lamp {
            name: "lamp",
            shape: LampShape::Ball { center: Vec3::new(-0.66, 0.62, 0.62), radius: 0.09 },
            radiance: Vec3::new(1.0, 0.72, 0.42) * 22.0,
        },
        Lamp {
            name: "window",
            shape: LampShape::Pane {
                corner: Vec3::new(0.35, -1.195, 0.75),
                along: Vec3::new(-0.75, 0.0, 0.0),
                up: Vec3::new(0.0, 0.0, 0.85),
            },
            radiance: Vec3::new(0.82, 0.93, 1.1) * 4.0,
        },
    ]
}

fn on_bed(thing: Thing) -> Thing {
    Thing { lift: thing.lift + BED, ..thing }
}

fn things() -> Vec<Thing> {
    let none = (0.0, 0.0, 0.0);
    let linen = paint(Pattern::Stripes, &[0xd8d2c4, 0xb9c4cf, 0xe4dfd3], 0.16, 0.9, 0.0);
    let cotton = paint(Pattern::Clouds, &[0xc9c3b8, 0xd6d0c6], 0.6, 0.9, 0.0);
    let fur = |colors: &[u32]| paint(Pattern::Clouds, colors, 0.1, 1.0, 0.0);
    let brown = fur(&[0x8a5a35, 0x9c6b44, 0x74492a]);
    let cream = fur(&[0xd8bd94, 0xc9aa7e]);
    let wood = paint(Pattern::Boards, &[0x6b4a2f, 0x7d5838], 0.12, 0.4, 0.0);
    let ball = |r: f32| Shape::Lumpy { radius: r, amplitude: 0.035, waves: 34.0 };
    let cloth = |x, y, z| Shape::Cloth { axes: Vec3::new(x, y, z), wrinkles: 0.028 };
    let mut all = vec![
        thing(
            "mattress",
            block(0.8, 0.62, BED / 2.0, 0.12),
            cotton.clone(),
            1.0,
            (-0.1, 0.0),
            none,
        ),
        on_bed(thing("pillow", cloth(0.2, 0.3, 0.09), cotton, 1.0, (-0.62, -0.1), none)),
        on_bed(thing(
            "blanket",
            cloth(0.34, 0.46, 0.07),
            linen,
            1.0,
            (0.34, 0.22),
            (0.0, 0.0, 0.4),
        )),
        raised(
            thing("nightstand", block(0.12, 0.12, 0.25, 0.1), wood, 1.0, (-0.66, 0.79), none),
            0.0,
        ),
    ];
    let plush = [
        ("body", ball(0.15), brown.clone(), (0.0, -0.05), 0.0),
        ("head", ball(0.115), brown.clone(), (0.02, -0.05), 0.24),
        ("muzzle", ball(0.05), cream.clone(), (0.13, -0.05), 0.27),
        ("ear_left", ball(0.04), brown.clone(), (0.01, 0.05), 0.42),
        ("ear_right", ball(0.04), brown.clone(), (0.01, -0.15), 0.42),
        ("arm_left", ball(0.055), brown.clone(), (0.09, 0.1), 0.11),
        ("arm_right", ball(0.055), brown.clone(), (0.09, -0.2), 0.11),
        ("leg_left", ball(0.065), cream.clone(), (0.18, 0.06), 0.0),
        ("leg_right", ball(0.065), cream, (0.18, -0.16), 0.0),
    ];
    all.extend(plush.map(|(name, shape, paint, place, lift)| {
        let turned = (0.0, 0.0, PI * place.1);
        on_bed(raised(thing(name, shape, paint, 1.0, place, turned), lift))
    }));
    all
}
