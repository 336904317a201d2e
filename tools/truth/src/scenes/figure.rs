//! A figure in the air, as a turntable with a mask shows it: nothing stands under it or behind it.

use std::f32::consts::FRAC_PI_2;

use glam::{DVec3, Vec3};

use super::{SceneRecipe, Thing, Views, block, overcast, paint, raised, sky, soft_boxes, thing};
use crate::faults::Fault;
use crate::shapes::Shape;
use crate::texture::Pattern;

pub(super) fn recipe() -> SceneRecipe {
    SceneRecipe {
        name: "figure",
        unit: 0.4,
        origin: Vec3::new(0.3, -0.2, 5.0),
        lambert: false,
        waves: 0.0,
        has_ground: false,
        ground: paint(Pattern::Clouds, &[0x808080, 0x808080], 1.0, 1.0, 0.0),
        things: things(),
        walls: Vec::new(),
        lamps: Vec::new(),
        meters_lamps: true,
        views: Views {
            distance: 2.3,
            elevation_deg: (-24.0, 46.0),
            azimuth_deg: (0.0, 360.0),
            target: DVec3::new(0.0, 0.0, 0.45),
            unsteady: 1.0,
        },
        focal: 1.15,
        is_masked: true,
        faults: vec![Fault::PoseNoise, Fault::SensorNoise],
        capture_light: ("morning", sky(35.0, 33.0, 3.0, 2.2)),
        relights: vec![
            ("evening", sky(-120.0, 14.0, 3.5, 1.4)),
            ("overcast", overcast()),
            ("boxes", soft_boxes()),
        ],
    }
}

/// A figure of clay with a hat, a scarf and a staff, and a lantern of brass in the other hand.
fn things() -> Vec<Thing> {
    let none = (0.0, 0.0, 0.0);
    let clay = paint(Pattern::Speckles, &[0xb5795a, 0x9a5f44, 0xc99172], 0.05, 0.8, 0.0);
    let glaze = paint(Pattern::Stripes, &[0x24506b, 0xe8dfc8, 0x2f6f73], 0.1, 0.25, 0.0);
    let wool = paint(Pattern::Stripes, &[0x8c2f39, 0xd9c9a8], 0.08, 1.0, 0.0);
    let wood = paint(Pattern::Boards, &[0x6b4a2f, 0x7d5838], 0.06, 0.7, 0.0);
    let brass = paint(Pattern::Clouds, &[0xd6b65a, 0xc9a548], 0.3, 0.3, 1.0);
    let body = Shape::Lumpy { radius: 0.26, amplitude: 0.05, waves: 9.0 };
    let head = Shape::Lumpy { radius: 0.15, amplitude: 0.03, waves: 7.0 };
    let arm = Shape::Capsule { radius: 0.06, half_length: 0.13 };
    let staff = Shape::Capsule { radius: 0.018, half_length: 0.42 };
    let scarf = Shape::Torus { ring: 0.13, tube: 0.045 };
    let leg = || block(0.08, 0.1, 0.14, 0.4);
    vec![
        raised(thing("leg_1", leg(), glaze.clone(), 1.0, (0.0, 0.13), none), 0.0),
        raised(thing("leg_2", leg(), glaze.clone(), 1.0, (0.0, -0.13), none), 0.02),
        raised(thing("body", body, clay.clone(), 1.0, (0.0, 0.0), (0.0, 0.0, 0.4)), 0.2),
        raised(thing("scarf", scarf, wool, 1.0, (0.0, 0.0), (0.1, 0.05, 0.0)), 0.62),
        raised(thing("head", head, clay.clone(), 1.0, (0.0, 0.0), none), 0.66),
        raised(thing("hat", block(0.17, 0.17, 0.09, 1.3), glaze, 1.0, (0.0, 0.0), none), 0.88),
        raised(thing("arm_1", arm, clay.clone(), 1.0, (0.02, 0.33), (0.9, 0.0, 0.0)), 0.38),
        raised(thing("arm_2", arm, clay, 1.0, (0.05, -0.32), (-FRAC_PI_2, 0.0, 0.3)), 0.42),
        raised(thing("staff", staff, wood, 1.0, (0.04, 0.45), (0.08, 0.0, 0.0)), 0.06),
        raised(
            thing("lantern", block(0.07, 0.07, 0.1, 0.5), brass, 1.0, (0.06, -0.47), none),
            0.24,
        ),
    ]
}
