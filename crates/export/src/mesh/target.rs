//! Whose axes, units and environment maps.
//!
//! A glTF file has +y up and meters whoever reads it, and every importer turns it into its own axes, so
//! the mesh is the same for all; what differs is where the importer puts north in a lat-long map:
//!
//! | target | own axes of glTF's (x, y, z) | lat-long map, in glTF axes |
//! |---|---|---|
//! | `blender` | (x, -z, y) | center +x, right of it +z |
//! | `threejs` | (x, y, z) | center +x, right of it +z |
//! | `unreal` | (x, z, y), centimeters, left-handed | center +x, right of it +z |
//! | `usd` | (x, y, z) | center +z, right of it -x (`DomeLight`, OpenEXR) |

pub use super::options::Target;
use glam::{DMat3, DVec3};
use motes_shading::environment::Convention;

/// An up axis within this angle of an axis of the world, degrees, is taken to be that axis, so that
/// coordinates stay recognisable.
const SNAP_DEG: f64 = 1.0;

impl Target {
    /// Axes of a lat-long map, in the axes of glTF.
    pub fn map_convention(self) -> Convention {
        match self {
            // Blender's map in Blender's axes is three.js's in glTF's: docs/methods/shading.md.
            Self::Blender | Self::Unreal | Self::Threejs => Convention::ThreeJs,
            Self::Usd => Convention::OpenExr,
        }
    }
}

/// From the world to the axes and units of a glTF file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GltfFrame {
    /// Orthonormal, right-handed: up becomes +y.
    pub rotation: DMat3,
    /// Meters per world unit.
    pub scale: f64,
}

impl GltfFrame {
    /// With `up_in_world` upwards. A world with z upwards maps (x, y, z) to (x, z, -y), so that Blender shows
    /// the world's own coordinates.
    pub fn new(up_in_world: DVec3, scale: f64) -> Self {
        let up = up_in_world.try_normalize().unwrap_or(DVec3::Z);
        let axes = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        let close = SNAP_DEG.to_radians().cos();
        let up = axes.into_iter().find(|axis| axis.dot(up) > close).unwrap_or(up);
        // x stays x unless it is up.
        let side = if up.x.abs() < 0.9 { DVec3::X } else { DVec3::NEG_Y * up.x.signum() };
        let x = (side - up * side.dot(up)).normalize();
        let z = x.cross(up);
        Self { rotation: DMat3::from_cols(x, up, z).transpose(), scale }
    }

    /// A position.
    pub fn point(&self, world: [f32; 3]) -> [f32; 3] {
        (self.rotation * DVec3::from(world.map(f64::from)) * self.scale).as_vec3().to_array()
    }

    /// A direction.
    pub fn direction(&self, world: [f32; 3]) -> [f32; 3] {
        (self.rotation * DVec3::from(world.map(f64::from))).as_vec3().to_array()
    }

    /// Row by row, for those who bring cameras along: `gltf = matrix (world, 1)`.
    pub fn matrix_rows(&self) -> [[f64; 4]; 3] {
        [0, 1, 2].map(|k| {
            let row = self.rotation.row(k) * self.scale;
            [row.x, row.y, row.z, 0.0]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn up_is_y_and_blender_shows_the_coordinates_of_a_world_with_z_up() {
        for up in [
            DVec3::X,
            DVec3::NEG_X,
            DVec3::Y,
            DVec3::NEG_Y,
            DVec3::Z,
            DVec3::NEG_Z,
            DVec3::new(0.3, -0.5, 0.8).normalize(),
        ] {
            let frame = GltfFrame::new(up, 1.0);
            assert!((frame.rotation.determinant() - 1.0).abs() < 1e-12);
            assert!((frame.rotation * up - DVec3::Y).length() < 1e-12, "{up}");
        }
        let frame = GltfFrame::new(DVec3::new(0.001, 0.0, 1.0), 2.0);
        let [x, y, z] = frame.point([1.0, 2.0, 3.0]);
        assert_eq!([x, -z, y], [2.0, 4.0, 6.0]);
        assert_eq!(GltfFrame::new(DVec3::Y, 1.0).rotation, DMat3::IDENTITY);
    }
}
