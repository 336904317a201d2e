//! Mixed materials on uneven ground.

use glam::Vec3;

use super::{SceneRecipe, Views, block, paint, sky, soft_boxes, thing};
use crate::shapes::Shape;
use crate::texture::Pattern::{Boards, Clouds, Patches, Speckles, Stripes};

pub(super) fn recipe() -> SceneRecipe {
    let brass = paint(Clouds, &[0xd6b65a, 0xe3c66f, 0xc9a548], 0.5, 0.22, 1.0);
    let gold = paint(Clouds, &[0xf0c05a, 0xf5cf78, 0xe2ab44], 0.6, 0.36, 1.0);
    let lumpy = Shape::Lumpy { radius: 0.5, amplitude: 0.13, waves: 4.2 };
    let waxed = paint(Boards, &[0x7a4b2a, 0x9c6b3f, 0x5f3a22], 0.12, 0.12, 0.0);
    SceneRecipe {
        name: "hillside",
        unit: 7.3,
        origin: Vec3::new(-3.1, 5.2, -1.4),
        lambert: false,
        waves: 0.035,
        has_ground: true,
        ground: paint(Clouds, &[0x4d5a2c, 0x6f7a3c, 0x8c7a52, 0x5a4a35], 0.12, 0.9, 0.0),
        things: vec![
            thing(
                "rock",
                lumpy,
                paint(Speckles, &[0x9a8f80, 0x5b5349, 0xc7bfae], 0.1, 0.85, 0.0),
                0.62,
                (-0.34, 0.3),
                (0.4, 0.2, 0.0),
            ),
            thing(
                "hoop",
                Shape::Torus { ring: 0.38, tube: 0.12 },
                brass,
                0.55,
                (0.38, 0.26),
                (1.05, 0.0, 0.5),
            ),
            thing(
                "pod",
                Shape::Capsule { radius: 0.24, half_length: 0.3 },
                paint(Stripes, &[0xd1495b, 0xedae49, 0x00798c, 0xf3ead3], 0.11, 0.4, 0.0),
                0.55,
                (-0.36, -0.3),
                (0.0, 0.0, 0.0),
            ),
            thing(
                "nugget",
                block(0.36, 0.42, 0.3, 1.35),
                gold,
                0.52,
                (0.06, -0.42),
                (0.0, 0.0, 0.2),
            ),
            thing(
                "crate",
                block(0.38, 0.38, 0.34, 0.22),
                waxed,
                0.44,
                (0.42, -0.2),
                (0.0, 0.0, 0.9),
            ),
            thing(
                "gourd",
                Shape::Vase { radius: 0.34, half_height: 0.46 },
                paint(Patches, &[0xe07a5f, 0x81b29a, 0xf4f1de, 0x3d405b], 0.14, 0.6, 0.0),
                0.46,
                (0.02, 0.06),
                (0.15, 0.1, 0.0),
            ),
        ],
        walls: Vec::new(),
        lamps: Vec::new(),
        meters_lamps: true,
        views: Views::around(1.85, 25.0, 58.0),
        is_masked: false,
        faults: Vec::new(),
        focal: 1.05,
        capture_light: ("evening", sky(-60.0, 27.0, 3.5, 2.2)),
        relights: vec![
            ("dawn", sky(110.0, 12.0, 2.5, 1.1)),
            ("noon", sky(20.0, 61.0, 3.0, 3.0)),
            ("boxes", soft_boxes()),
        ],
    }
}
