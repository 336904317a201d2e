//! Glazed and metal things between soft boxes.

use glam::Vec3;

use super::{SceneRecipe, Views, block, overcast, paint, sky, soft_boxes, thing};
use crate::shapes::Shape;
use crate::texture::Pattern::{Clouds, Patches, Speckles, Stripes};

pub(super) fn recipe() -> SceneRecipe {
    let vase = Shape::Vase { radius: 0.36, half_height: 0.55 };
    let glaze = paint(Patches, &[0x1f4e79, 0xe8e4d8, 0xc27c2c, 0x7ba05b], 0.15, 0.22, 0.0);
    let enamel = paint(Stripes, &[0x9b2335, 0xf2ead7, 0x2a3d45], 0.13, 0.3, 0.0);
    let steel = paint(Clouds, &[0xb9bcc0, 0xcfd0d1, 0xa7a9ac], 0.5, 0.3, 1.0);
    let bronze = paint(Clouds, &[0xc58b4b, 0xd9a566, 0xb77a3c], 0.4, 0.38, 1.0);
    let stone = paint(Speckles, &[0x8f8a82, 0x3f3c38, 0xc9c2b5], 0.07, 0.75, 0.0);
    SceneRecipe {
        name: "studio",
        unit: 60.0,
        origin: Vec3::new(20.0, -35.0, 4.0),
        lambert: false,
        waves: 0.0,
        has_ground: true,
        ground: paint(Speckles, &[0x5a5d63, 0x8a8d90, 0x33363b, 0xb0a89a], 0.075, 0.5, 0.0),
        things: vec![
            thing("vase", vase, glaze, 0.55, (-0.3, 0.3), (0.0, 0.0, 0.7)),
            thing(
                "knot",
                Shape::Knot { size: 0.5, tube: 0.105 },
                enamel,
                0.62,
                (0.37, 0.27),
                (0.0, 0.0, 0.4),
            ),
            thing(
                "pill",
                Shape::Capsule { radius: 0.26, half_length: 0.34 },
                steel,
                0.5,
                (0.3, -0.33),
                (1.571, 0.0, 0.6),
            ),
            thing(
                "bowl",
                block(0.46, 0.46, 0.33, 0.85),
                bronze,
                0.46,
                (-0.37, -0.26),
                (0.0, 0.0, 0.0),
            ),
            thing("cube", block(0.4, 0.4, 0.4, 0.16), stone, 0.36, (0.0, -0.02), (0.0, 0.0, 0.35)),
        ],
        walls: Vec::new(),
        lamps: Vec::new(),
        meters_lamps: true,
        views: Views::around(1.9, 26.0, 60.0),
        is_masked: false,
        faults: Vec::new(),
        focal: 1.12,
        capture_light: ("boxes", soft_boxes()),
        relights: vec![
            ("noon", sky(70.0, 50.0, 3.0, 2.8)),
            ("evening", sky(-110.0, 16.0, 4.0, 1.6)),
            ("overcast", overcast()),
        ],
    }
}
