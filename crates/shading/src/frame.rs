//! An orthonormal basis round a normal, without a branch.
//!
//! Duff et al., "Building an Orthonormal Basis, Revisited" (JCGT 2017).

use glam::{DVec3, Vec3};

macro_rules! frame_for {
    ($frame:ident, $vec:ident, $t:ty) => {
        /// Local axes of a surface point: `tangent`, `bitangent`, `normal` are x, y, z.
        #[derive(Clone, Copy, Debug)]
        pub struct $frame {
            /// Local x in world.
            pub tangent: $vec,
            /// Local y in world.
            pub bitangent: $vec,
            /// Local z in world.
            pub normal: $vec,
        }

        impl $frame {
            /// A right-handed basis whose z axis is the unit vector `normal`.
            #[inline]
            pub fn from_normal(normal: $vec) -> Self {
                let n = normal;
                let sign = (1.0 as $t).copysign(n.z);
                let a = -1.0 / (sign + n.z);
                let b = n.x * n.y * a;
                Self {
                    tangent: $vec::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
                    bitangent: $vec::new(b, sign + n.y * n.y * a, -n.y),
                    normal,
                }
            }

            /// Coordinates of a world vector in this frame.
            #[inline]
            pub fn local_from_world(&self, v: $vec) -> $vec {
                $vec::new(v.dot(self.tangent), v.dot(self.bitangent), v.dot(self.normal))
            }

            /// The world vector with these coordinates.
            #[inline]
            pub fn world_from_local(&self, v: $vec) -> $vec {
                self.tangent * v.x + self.bitangent * v.y + self.normal * v.z
            }
        }
    };
}

frame_for!(Frame, Vec3, f32);
frame_for!(FrameF64, DVec3, f64);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_orthonormal_and_right_handed_everywhere() {
        for i in 0..1000 {
            let z = 1.0 - 2.0 * f64::from(i) / 999.0;
            let phi = 2.4 * f64::from(i);
            let r = (1.0 - z * z).max(0.0).sqrt();
            let n = DVec3::new(r * phi.cos(), r * phi.sin(), z);
            let f = FrameF64::from_normal(n);
            assert!((f.tangent.cross(f.bitangent) - n).length() < 1e-12, "normal {n}");
            assert!((f.tangent.length() - 1.0).abs() < 1e-12);
            let v = DVec3::new(0.3, -0.8, 0.5);
            assert!((f.world_from_local(f.local_from_world(v)) - v).length() < 1e-12);
            let f = Frame::from_normal(n.as_vec3());
            assert!((f.tangent.cross(f.bitangent) - f.normal).length() < 1e-6, "normal {n}");
        }
    }
}
