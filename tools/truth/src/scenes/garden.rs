//! Outdoors: leaves, stems thinner than pixels are far apart, a lawn, sky all around.

use glam::{DVec3, Vec3};

use super::{SceneRecipe, Thing, Views, block, overcast, paint, raised, sky, soft_boxes, thing};
use crate::faults::Fault;
use crate::shapes::Shape;
use crate::texture::Pattern;

pub(super) fn recipe() -> SceneRecipe {
    let lawn = [0x4c6b2a, 0x5f7d36, 0x3f5a24, 0x7c8a4a];
    SceneRecipe {
        name: "garden",
        unit: 3.1,
        origin: Vec3::new(-6.0, 2.0, 0.9),
        lambert: false,
        waves: 0.05,
        has_ground: true,
        ground: paint(Pattern::Speckles, &lawn, 0.06, 0.95, 0.0),
        things: things(),
        walls: Vec::new(),
        lamps: Vec::new(),
        meters_lamps: true,
        views: Views {
            distance: 1.8,
            elevation_deg: (8.0, 42.0),
            azimuth_deg: (0.0, 360.0),
            target: DVec3::new(0.0, 0.0, 0.32),
            unsteady: 3.0,
        },
        focal: 0.9,
        is_masked: false,
        faults: Fault::PHONE.to_vec(),
        capture_light: ("afternoon", sky(-70.0, 38.0, 3.0, 2.4)),
        relights: vec![
            ("sunrise", sky(95.0, 9.0, 2.5, 0.9)),
            ("overcast", overcast()),
            ("boxes", soft_boxes()),
        ],
    }
}

fn things() -> Vec<Thing> {
    let none = (0.0, 0.0, 0.0);
    let clay = paint(Pattern::Clouds, &[0xb0643c, 0xc27a4e, 0x9a5431], 0.2, 0.85, 0.0);
    let box_leaf = paint(Pattern::Clouds, &[0x2f5a22, 0x46772f, 0x5d8a3c], 0.15, 0.55, 0.0);
    let fern_leaf = paint(Pattern::Clouds, &[0x6a8f2f, 0x8aa845, 0x4f7a28], 0.12, 0.6, 0.0);
    let hedge_leaf = paint(Pattern::Clouds, &[0x274a20, 0x3b6330], 0.1, 0.6, 0.0);
    let wood = paint(Pattern::Boards, &[0x7c6248, 0x6a523b, 0x8e7456], 0.05, 0.8, 0.0);
    let stone = paint(Pattern::Speckles, &[0x9a958c, 0x6d6962, 0xbab4a8], 0.06, 0.9, 0.0);
    let leaves = |count, leaf| Shape::Leaves { radius: 0.5, leaf, count };
    let stem = Shape::Capsule { radius: 0.016, half_length: 0.42 };
    let mut all = vec![
        thing("pot", Shape::Vase { radius: 0.34, half_height: 0.4 }, clay, 0.55, (0.0, 0.0), none),
        raised(thing("shrub", leaves(700, 0.07), box_leaf, 0.62, (0.0, 0.0), none), 0.36),
        thing("fern", leaves(420, 0.11), fern_leaf, 0.5, (-0.5, 0.36), none),
        thing(
            "slab",
            block(0.4, 0.28, 0.05, 0.15),
            stone.clone(),
            0.8,
            (0.48, -0.3),
            (0.0, 0.0, 0.3),
        ),
        raised(
            thing(
                "cobble",
                Shape::Lumpy { radius: 0.3, amplitude: 0.08, waves: 5.0 },
                stone,
                0.5,
                (0.48, -0.3),
                none,
            ),
            0.07,
        ),
    ];
    let stems =
        [("stem_a", 0.1, 0.5, 0.12), ("stem_b", 0.22, 0.56, -0.15), ("stem_c", 0.02, 0.62, 0.2)];
    all.extend(stems.map(|(name, x, y, lean)| {
        thing(name, stem, wood.clone(), 1.0, (x, y), (lean, -lean, 0.0))
    }));
    // Far away, all around: what photos of a garden show behind it.
    let hedges = ["hedge_a", "hedge_b", "hedge_c", "hedge_d", "hedge_e", "hedge_f"];
    all.extend(hedges.into_iter().zip(0u8..).map(|(name, k)| {
        let turn = f32::from(k) * 1.05 + 0.4;
        let far = 4.2 + 0.7 * (2.0 * turn).sin();
        let place = (far * turn.cos(), far * turn.sin());
        let size = 2.0 + 0.5 * (3.0 * turn).cos();
        thing(name, leaves(900, 0.08), hedge_leaf.clone(), size, place, (0.0, 0.0, turn))
    }));
    all
}
