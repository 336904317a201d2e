//! Things without gloss, under sun and sky.

use glam::Vec3;

use super::{SceneRecipe, Views, block, overcast, paint, sky, soft_boxes, thing};
use crate::shapes::Shape;
use crate::texture::Pattern::{Boards, Clouds, Patches, Speckles, Stripes};

pub(super) fn recipe() -> SceneRecipe {
    let p = |pattern, palette: &[u32], cell| paint(pattern, palette, cell, 1.0, 0.0);
    let lumpy = Shape::Lumpy { radius: 0.5, amplitude: 0.09, waves: 5.0 };
    let (clay, slate) = ([0xb5653f, 0xd9a066, 0x8c4a35], [0x5d6d7e, 0x85929e, 0xaeb6bf]);
    SceneRecipe {
        name: "matte",
        unit: 1.0,
        origin: Vec3::ZERO,
        lambert: true,
        waves: 0.0,
        has_ground: true,
        ground: p(Boards, &[0xa67c52, 0x8d6742, 0xbf9a6f, 0x7a5a3c], 0.16),
        things: vec![
            thing("boulder", lumpy, p(Clouds, &slate, 0.3), 0.55, (-0.36, 0.22), (0.3, 0.1, 0.0)),
            thing(
                "brick",
                block(0.5, 0.3, 0.22, 0.18),
                p(Patches, &clay, 0.16),
                0.5,
                (0.32, 0.34),
                (0.0, 0.0, 0.5),
            ),
            thing(
                "ring",
                Shape::Torus { ring: 0.36, tube: 0.13 },
                p(Stripes, &[0x2e6f6b, 0xe8d9b5, 0xc8553d], 0.12),
                0.52,
                (0.36, -0.2),
                (0.0, 0.0, 0.0),
            ),
            thing(
                "jar",
                Shape::Vase { radius: 0.34, half_height: 0.5 },
                p(Speckles, &[0xe9dcc3, 0x6b4f3a, 0xa44a3f], 0.11),
                0.5,
                (-0.16, -0.34),
                (0.0, 0.0, 0.0),
            ),
        ],
        walls: Vec::new(),
        lamps: Vec::new(),
        meters_lamps: true,
        views: Views::around(1.75, 27.0, 56.0),
        is_masked: false,
        faults: Vec::new(),
        focal: 1.08,
        capture_light: ("noon", sky(-35.0, 52.0, 3.0, 3.2)),
        relights: vec![
            ("morning", sky(150.0, 14.0, 3.5, 1.3)),
            ("overcast", overcast()),
            ("boxes", soft_boxes()),
        ],
    }
}
