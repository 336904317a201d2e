//! The scenes: objects, paints and lights as numbers.

mod bedroom;
mod garden;
mod kitchen;

use glam::{DVec3, EulerRot, Mat3, Vec2, Vec3};
use motes_math::srgb;
use motes_shading::environment::SunSky;

use crate::faults::Fault;
use crate::lamps::Lamp;
use crate::lights::Light;
use crate::shapes::Shape;
use crate::texture::{Paint, Pattern};

/// Which scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum SceneName {
    /// Lambert surfaces only, under sun and sky.
    Matte,
    /// Glazed and metal things between soft boxes in a dark room; centimeters.
    Studio,
    /// Mixed materials on uneven ground in the evening.
    Hillside,
    /// A plush toy on a bed in the corner of a room, lit by a lamp and a window; photographed by a phone.
    Bedroom,
    /// Shrubs, stems and pots on a lawn under the sky, which the photos show; photographed by a phone.
    Garden,
    /// Cabinets with doors and handles along a wall, a counter with a few things, under an overcast sky.
    Kitchen,
}

/// A thing on the ground.
#[derive(Clone, Debug)]
pub struct Thing {
    /// Name in the documents.
    pub name: &'static str,
    /// Its surface, before size.
    pub shape: Shape,
    /// Paint in the coordinates of the shape.
    pub paint: Paint,
    /// World units per unit of the shape, over the unit of the scene.
    pub size: f32,
    /// Where it stands, in units of the scene.
    pub place: Vec2,
    /// Turned about x, y, z before it is set down, radians.
    pub turned: Vec3,
    /// How far its lowest point is above the ground, in units of the scene.
    pub lift: f32,
}

impl Thing {
    /// Rotation of the shape.
    pub fn rotation(&self) -> Mat3 {
        let t = self.turned;
        Mat3::from_euler(EulerRot::XYZ, t.x, t.y, t.z)
    }
}

/// A flat piece of a room: a parallelogram whose front is where `along` x `up` points.
#[derive(Clone, Debug)]
pub struct Wall {
    /// A corner, in units of the scene.
    pub corner: Vec3,
    /// From the corner along one side.
    pub along: Vec3,
    /// From the corner along the other.
    pub up: Vec3,
    /// Paint, in units of the scene.
    pub paint: Paint,
}

/// Where the cameras are.
#[derive(Clone, Copy, Debug)]
pub struct Views {
    /// Of the cameras from the target.
    pub distance: f32,
    /// Lowest and highest elevation, degrees.
    pub elevation_deg: (f32, f32),
    /// First azimuth and how far around they go, degrees.
    pub azimuth_deg: (f64, f64),
    /// What they look at, in units of the scene.
    pub target: DVec3,
    /// How unevenly they are held: 1 a tripod that was moved, more by hand.
    pub unsteady: f64,
}

impl Views {
    /// Once around something on the ground.
    fn around(distance: f32, low: f32, high: f32) -> Self {
        let target = DVec3::new(0.0, 0.0, 0.1);
        let azimuth_deg = (0.0, 360.0);
        Self { distance, elevation_deg: (low, high), azimuth_deg, target, unsteady: 1.0 }
    }
}

/// A whole scene; lengths are in `unit`.
#[derive(Clone, Debug)]
pub struct SceneRecipe {
    /// Its name in files.
    pub name: &'static str,
    /// World units of a unit of length.
    pub unit: f32,
    /// Where the middle of the ground is, world units.
    pub origin: Vec3,
    /// Only `base_color / π`.
    pub lambert: bool,
    /// Height of the ground's waves.
    pub waves: f32,
    /// Paint of the ground, in units of the scene.
    pub ground: Paint,
    /// What stands on it.
    pub things: Vec<Thing>,
    /// Flat pieces around it; they count as support.
    pub walls: Vec<Wall>,
    /// Lamps and windows: lit in the photos, dark in the relit pictures.
    pub lamps: Vec<Lamp>,
    /// Where the cameras are.
    pub views: Views,
    /// What is wrong with the camera when nothing else is asked for.
    pub faults: Vec<Fault>,
    /// Focal length over the width of a picture.
    pub focal: f32,
    /// The light of the photos.
    pub capture_light: (&'static str, Light),
    /// The lights of the relit pictures.
    pub relights: Vec<(&'static str, Light)>,
}

fn rgb(hex: u32) -> Vec3 {
    let channel = |shift: u32| srgb::decode(((hex >> shift) & 255) as f32 / 255.0);
    Vec3::new(channel(16), channel(8), channel(0))
}

fn paint(pattern: Pattern, palette: &[u32], cell: f32, roughness: f32, metallic: f32) -> Paint {
    Paint { pattern, palette: palette.iter().map(|&c| rgb(c)).collect(), cell, roughness, metallic }
}

fn thing(
    name: &'static str,
    shape: Shape,
    paint: Paint,
    size: f32,
    place: (f32, f32),
    turned: (f32, f32, f32),
) -> Thing {
    Thing { name, shape, paint, size, place: place.into(), turned: turned.into(), lift: 0.0 }
}

fn sky(azimuth_deg: f64, elevation_deg: f64, turbidity: f64, irradiance: f32) -> Light {
    let sky =
        SunSky { azimuth_deg, elevation_deg, turbidity, ground_albedo: 0.25, ..SunSky::default() };
    Light::Sky { sky, irradiance }
}

fn block(x: f32, y: f32, z: f32, exponent: f32) -> Shape {
    Shape::Superquadric { axes: Vec3::new(x, y, z), vertical: exponent, horizontal: exponent }
}

fn overcast() -> Light {
    Light::Overcast { zenith: Vec3::new(0.86, 0.93, 1.05) }
}

fn soft_boxes() -> Light {
    let white = |s: f32| Vec3::new(1.0, 0.95, 0.88) * s;
    Light::Boxes {
        room: Vec3::splat(0.035),
        boxes: vec![
            ([40.0, 48.0, 26.0, 17.0], white(7.5)),
            ([165.0, 30.0, 13.0, 22.0], Vec3::new(0.75, 0.88, 1.0) * 4.5),
            ([-80.0, 36.0, 18.0, 11.0], white(3.2)),
            ([-140.0, 66.0, 20.0, 8.0], white(3.6)),
        ],
    }
}

impl SceneName {
    /// The numbers of the scene.
    pub fn recipe(self) -> SceneRecipe {
        match self {
            Self::Matte => matte(),
            Self::Studio => studio(),
            Self::Hillside => hillside(),
            Self::Bedroom => bedroom::recipe(),
            Self::Garden => garden::recipe(),
            Self::Kitchen => kitchen::recipe(),
        }
    }
}

fn matte() -> SceneRecipe {
    use Pattern::{Boards, Clouds, Patches, Speckles, Stripes};
    let p = |pattern, palette: &[u32], cell| paint(pattern, palette, cell, 1.0, 0.0);
    let lumpy = Shape::Lumpy { radius: 0.5, amplitude: 0.09, waves: 5.0 };
    let (clay, slate) = ([0xb5653f, 0xd9a066, 0x8c4a35], [0x5d6d7e, 0x85929e, 0xaeb6bf]);
    SceneRecipe {
        name: "matte",
        unit: 1.0,
        origin: Vec3::ZERO,
        lambert: true,
        waves: 0.0,
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
        views: Views::around(1.75, 27.0, 56.0),
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

fn studio() -> SceneRecipe {
    use Pattern::{Clouds, Patches, Speckles, Stripes};
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
        views: Views::around(1.9, 26.0, 60.0),
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

fn hillside() -> SceneRecipe {
    use Pattern::{Boards, Clouds, Patches, Speckles, Stripes};
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
        views: Views::around(1.85, 25.0, 58.0),
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
