//! The scenes: objects, paints and lights as numbers.

mod bedroom;
mod figure;
mod garden;
mod hall;
mod hillside;
mod kitchen;
mod lounge;
mod matte;
mod studio;
mod yard;

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
    /// A polished floor, a mirror on the wall, a glass vase and a glazed picture, a thin coat stand; photographed by a phone that moves.
    Hall,
    /// A figure that hangs in the air, masked in the photos, seen from all sides and from below.
    Figure,
    /// A sofa, a table and a shelf between three walls, lit by a lamp and a window; photographed by a phone.
    Lounge,
    /// A brick wall, paving, a bench and a bicycle in hard sun, with sky beside and above; photographed by a phone.
    Yard,
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
    /// Thin glass, tinted by the first color of the paint.
    pub is_glass: bool,
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
    /// Whether there is a ground; else things hang in the air.
    pub has_ground: bool,
    /// Paint of the ground, in units of the scene.
    pub ground: Paint,
    /// What stands on it.
    pub things: Vec<Thing>,
    /// Flat pieces around it; they count as support.
    pub walls: Vec<Wall>,
    /// Lamps and windows: lit in the photos, dark in the relit pictures.
    pub lamps: Vec<Lamp>,
    /// The camera exposes for its lamps, too; else for what they shine at, and they burn out.
    pub meters_lamps: bool,
    /// Where the cameras are.
    pub views: Views,
    /// Photos show its things alone: what is around them is transparent.
    pub is_masked: bool,
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
    Thing {
        name,
        shape,
        paint,
        size,
        place: place.into(),
        turned: turned.into(),
        lift: 0.0,
        is_glass: false,
    }
}

/// A thing whose lowest point is `lift` above the ground.
fn raised(thing: Thing, lift: f32) -> Thing {
    Thing { lift, ..thing }
}

/// A thing of size 1 that is not turned.
fn at(name: &'static str, shape: Shape, paint: &Paint, place: (f32, f32), lift: f32) -> Thing {
    raised(thing(name, shape, paint.clone(), 1.0, place, (0.0, 0.0, 0.0)), lift)
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
            Self::Matte => matte::recipe(),
            Self::Studio => studio::recipe(),
            Self::Hillside => hillside::recipe(),
            Self::Bedroom => bedroom::recipe(),
            Self::Garden => garden::recipe(),
            Self::Kitchen => kitchen::recipe(),
            Self::Hall => hall::recipe(),
            Self::Figure => figure::recipe(),
            Self::Lounge => lounge::recipe(),
            Self::Yard => yard::recipe(),
        }
    }
}
