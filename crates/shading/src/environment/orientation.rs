//! Which pixel is which direction.
//!
//! Canonical lat-long map, as OpenEXR's `envmap` attribute and USD's dome light define it, in the
//! map's own axes (+y up): `u = atan2(x, -z) / 2π mod 1`, `v = acos(y) / π`, row 0 up, seen from
//! inside. Image center +z, a quarter from the left +x. Other conventions use the same picture
//! with other names for the axes, so they are exact permutations and no pixel moves:
//!
//! | convention | up | center | u = 1/4 | map (x, y, z) of world (x, y, z) |
//! |---|---|---|---|---|
//! | `openexr` | +y | +z | +x | (x, y, z) |
//! | `blender` | +z | +x | +y | (y, z, x) |
//! | `threejs` | +y | +x | -z | (-z, y, x) |

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DQuat, DVec3};
use motes_scene::Convention;

/// An up that is estimated from photos errs by several degrees: within this of an axis of the world it is taken to be that
/// axis, which is how the world was made.
const SNAP_DEG: f64 = 10.0;

/// Whose axes a map has, and where its zenith is in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapAxes {
    /// Names of the axes.
    pub convention: Convention,
    /// Unit vector to what the map's first row shows.
    pub zenith_in_world: DVec3,
}

impl MapAxes {
    /// The map's axes are the world's.
    pub fn of_world(convention: Convention) -> Self {
        Self { convention, zenith_in_world: convention.up() }
    }

    /// The map's zenith is `up_in_world`, or the axis of the world that is within 10 degrees of it.
    pub fn upright(convention: Convention, up_in_world: DVec3) -> Self {
        let up = up_in_world.try_normalize().unwrap_or(convention.up());
        let axis = nearest_axis(up);
        let is_axis = axis.dot(up) >= SNAP_DEG.to_radians().cos();
        Self { convention, zenith_in_world: if is_axis { axis } else { up } }
    }

    /// The axes of the convention, turned so that its up becomes the zenith: first by a right angle or two to the nearest
    /// axis of the world, as programs convert between them (+y to +z about x, +y to -y by half a turn about x), then by the
    /// smallest angle. So the heading does not depend on the noise of an up that is nearly opposite.
    pub fn orientation(&self) -> Orientation {
        let own = self.convention.up();
        let zenith = self.zenith_in_world.try_normalize().unwrap_or(own);
        let axis = nearest_axis(zenith);
        let to_axis = match axis.dot(own) {
            1.0 => DMat3::IDENTITY,
            // Half a turn about x, which is the up of no convention.
            -1.0 => DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)),
            _ => quarter_turn(own, axis),
        };
        let to_zenith = if axis == zenith {
            DMat3::IDENTITY
        } else {
            DMat3::from_quat(DQuat::from_rotation_arc(axis, zenith))
        };
        let Orientation { map_from_world } = Orientation::new(self.convention);
        Orientation { map_from_world: map_from_world * (to_zenith * to_axis).transpose() }
    }
}

/// The signed axis with the largest share of `d`; of equal ones the last.
fn nearest_axis(d: DVec3) -> DVec3 {
    let [x, y, z] = d.abs().to_array();
    if z >= x && z >= y {
        DVec3::Z * d.z.signum()
    } else if y >= x {
        DVec3::Y * d.y.signum()
    } else {
        DVec3::X * d.x.signum()
    }
}

/// The rotation that takes the axis `from` to the axis `to`, which is perpendicular; exact.
fn quarter_turn(from: DVec3, to: DVec3) -> DMat3 {
    let about = from.cross(to);
    let turned = |v: DVec3| to * from.dot(v) - from * to.dot(v) + about * about.dot(v);
    DMat3::from_cols(turned(DVec3::X), turned(DVec3::Y), turned(DVec3::Z))
}

/// The rotation from world to the map's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation {
    /// Orthonormal, right-handed.
    pub map_from_world: DMat3,
}

impl Orientation {
    /// The axes of a convention.
    pub fn new(convention: Convention) -> Self {
        // Columns: where world x, y and z go.
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let map_from_world = match convention {
            Convention::OpenExr => DMat3::IDENTITY,
            Convention::Blender => DMat3::from_cols(z, x, y),
            Convention::ThreeJs => DMat3::from_cols(z, y, -x),
        };
        Self { map_from_world }
    }

    /// Turns the light about the map's up axis by `degrees`, counter-clockwise seen from above:
    /// what was at `u` is then seen at `u - degrees / 360`. Quarter turns are exact.
    pub fn rotated(self, degrees: f64) -> Self {
        let quarter = degrees.rem_euclid(360.0) / 90.0;
        let (sin, cos) = match quarter {
            0.0 => (0.0, 1.0),
            1.0 => (1.0, 0.0),
            2.0 => (0.0, -1.0),
            3.0 => (-1.0, 0.0),
            _ => degrees.to_radians().sin_cos(),
        };
        // A world direction looks up what stood `degrees` clockwise of it.
        let back =
            DMat3::from_cols(DVec3::new(cos, 0.0, sin), DVec3::Y, DVec3::new(-sin, 0.0, cos));
        Self { map_from_world: back * self.map_from_world }
    }

    /// The direction in the map's axes.
    pub fn map_from_world(&self, world: DVec3) -> DVec3 {
        self.map_from_world * world
    }

    /// The direction in world.
    pub fn world_from_map(&self, map: DVec3) -> DVec3 {
        self.map_from_world.transpose() * map
    }
}

/// Unit vector in the map's axes at `u`, `v` in [0, 1].
pub fn direction_from_uv(u: f64, v: f64) -> DVec3 {
    let (sin_phi, cos_phi) = (TAU * u).sin_cos();
    let (sin_theta, cos_theta) = (PI * v).sin_cos();
    DVec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi)
}

/// `u` in [0, 1), `v` in [0, 1] of a unit vector in the map's axes.
pub fn uv_from_direction(d: DVec3) -> (f64, f64) {
    let u = (d.x.atan2(-d.z) / TAU).rem_euclid(1.0);
    // acos loses half the digits near the poles, where the sun may stand.
    (if u < 1.0 { u } else { 0.0 }, d.x.hypot(d.z).atan2(d.y) / PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `u` of the six axes, `None` at the poles, from the formulas of the three programs.
    fn expected(convention: Convention, d: DVec3) -> (f64, f64) {
        match convention {
            Convention::OpenExr => (d.x.atan2(-d.z) / TAU, d.y.acos() / PI),
            Convention::Blender => (0.5 - d.y.atan2(d.x) / TAU, d.z.acos() / PI),
            Convention::ThreeJs => (d.z.atan2(d.x) / TAU + 0.5, 0.5 - d.y.asin() / PI),
        }
    }

    #[test]
    fn conventions_are_those_of_their_programs() {
        for convention in [Convention::OpenExr, Convention::Blender, Convention::ThreeJs] {
            let orientation = Orientation::new(convention);
            assert_eq!(orientation.map_from_world.determinant(), 1.0);
            for i in 0..500 {
                // Off the poles, where u means nothing.
                let (u, v) =
                    (f64::from(i) * 0.618 % 1.0, 0.01 + 0.98 * (f64::from(i) * 0.277 % 1.0));
                let d = orientation.world_from_map(direction_from_uv(u, v));
                let (eu, ev) = expected(convention, d);
                let wrap = (eu - u).rem_euclid(1.0);
                assert!(wrap.min(1.0 - wrap) < 1e-9 && (ev - v).abs() < 1e-7, "{convention:?} {d}");
                let (bu, bv) = uv_from_direction(orientation.map_from_world(d));
                assert!((bu - u).abs() < 1e-9 && (bv - v).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn an_upright_map_has_its_zenith_up_and_stays_where_the_world_is_its_own() {
        let conventions = [Convention::OpenExr, Convention::Blender, Convention::ThreeJs];
        let tilted = DVec3::new(0.02, -0.82, -0.57).normalize();
        for convention in conventions {
            let own = Orientation::new(convention);
            assert_eq!(MapAxes::of_world(convention).orientation(), own);
            let nearly = convention.up() + DVec3::new(0.1, 0.05, -0.04);
            assert_eq!(MapAxes::upright(convention, nearly).orientation(), own);
            for up in [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z, tilted] {
                let Orientation { map_from_world: m } =
                    MapAxes::upright(convention, up).orientation();
                assert!(
                    (m.determinant() - 1.0).abs() < 1e-12 && (m * up - DVec3::Y).length() < 1e-12
                );
                assert!(
                    (m * m.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-12),
                    "{convention:?} {up}"
                );
            }
        }
        assert_eq!(MapAxes::upright(Convention::Blender, DVec3::NAN).zenith_in_world, DVec3::Z);
    }

    #[test]
    fn an_upright_map_is_turned_as_programs_convert_their_axes() {
        let center = |convention, up| {
            MapAxes::upright(convention, up).orientation().world_from_map(DVec3::Z)
        };
        // A map for y up over a world with z up, as Blender imports glTF: (x, y, z) to (x, -z, y).
        assert_eq!(center(Convention::OpenExr, DVec3::Z), DVec3::NEG_Y);
        assert_eq!(center(Convention::ThreeJs, DVec3::Z), DVec3::X);
        // Over a camera's world with y down, as OpenGL's axes from OpenCV's: (x, -y, -z).
        assert_eq!(center(Convention::OpenExr, DVec3::NEG_Y), DVec3::NEG_Z);
        assert_eq!(center(Convention::ThreeJs, DVec3::NEG_Y), DVec3::X);
        // And the heading is the same however the estimate of an opposite up leans.
        for lean in [DVec3::new(0.05, -1.0, 0.25), DVec3::new(-0.2, -1.0, -0.2)] {
            let turned = center(Convention::OpenExr, lean);
            assert!(turned.angle_between(DVec3::NEG_Z).to_degrees() < 16.0, "{turned}");
        }
    }

    #[test]
    fn named_directions_are_at_their_places() {
        let at = |c, d| uv_from_direction(Orientation::new(c).map_from_world(d));
        assert_eq!(at(Convention::OpenExr, DVec3::Z), (0.5, 0.5));
        assert_eq!(at(Convention::OpenExr, DVec3::X), (0.25, 0.5));
        assert_eq!(at(Convention::Blender, DVec3::X), (0.5, 0.5));
        assert_eq!(at(Convention::Blender, DVec3::Y), (0.25, 0.5));
        assert_eq!(at(Convention::Blender, DVec3::Z).1, 0.0);
        assert_eq!(at(Convention::ThreeJs, DVec3::X), (0.5, 0.5));
        assert_eq!(at(Convention::ThreeJs, -DVec3::Z), (0.25, 0.5));
    }

    #[test]
    fn rotation_turns_the_light_counter_clockwise_from_above() {
        // Blender axes: light at +x (center), turned by 90 degrees, comes from +y.
        for degrees in [90.0, 90.0 + 1e-9] {
            let turned = Orientation::new(Convention::Blender).rotated(degrees);
            let (u, v) = uv_from_direction(turned.map_from_world(DVec3::Y));
            assert!((u - 0.5).abs() < 1e-9 && (v - 0.5).abs() < 1e-9, "{u} {v}");
        }
    }
}
