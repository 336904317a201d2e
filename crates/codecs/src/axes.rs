//! Half turns and axis flips between the frames of formats.
//!
//! Flipping the signs of axes maps real spherical harmonics to themselves up to a sign, so no
//! matrix is needed: `Y_(l, m)` is odd in y when `m < 0`, odd in x when `m` is odd and positive or
//! even and negative, odd in z when `l + m` is odd.

use motes_math::sh::MAX_SH_DEGREE;

/// Coefficients up to the highest degree.
const COEFFICIENTS: usize = (MAX_SH_DEGREE as usize + 1).pow(2);

/// The two axes whose sign changes between two right-handed frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Flip {
    axes: [f32; 3],
    sh: [f32; COEFFICIENTS],
}

impl Flip {
    /// Right, down, forward (PLY) to right, up, back (spz, OpenGL) and back: half a turn about x.
    pub(crate) const ABOUT_X: Self = Self::new([1.0, -1.0, -1.0]);
    /// Right, down, forward (PLY) to left, up, forward (glTF) and back: half a turn about z.
    pub(crate) const ABOUT_Z: Self = Self::new([-1.0, -1.0, 1.0]);

    const fn new(axes: [f32; 3]) -> Self {
        let mut sh = [1.0; COEFFICIENTS];
        let mut l: i32 = 0;
        while l <= MAX_SH_DEGREE as i32 {
            let mut m = -l;
            while m <= l {
                let odd_x = if m < 0 { m % 2 == 0 } else { m % 2 == 1 };
                let mut sign = if odd_x { axes[0] } else { 1.0 };
                if m < 0 {
                    sign *= axes[1];
                }
                if (l + m) % 2 != 0 {
                    sign *= axes[2];
                }
                sh[(l * l + l + m) as usize] = sign;
                m += 1;
            }
            l += 1;
        }
        Self { axes, sh }
    }

    pub(crate) fn point(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        [x * self.axes[0], y * self.axes[1], z * self.axes[2]]
    }

    /// A rotation `w, x, y, z`. The local axes flip along, which an ellipsoid does not show.
    pub(crate) fn rotation(&self, [w, x, y, z]: [f32; 4]) -> [f32; 4] {
        let [a, b, c] = self.axes;
        [w, x * b * c, y * a * c, z * a * b]
    }

    /// The sign of SH coefficient `k`.
    pub(crate) fn sh_sign(&self, k: usize) -> f32 {
        self.sh[k]
    }
}

#[cfg(test)]
mod tests {
    use glam::{Quat, Vec3};
    use motes_math::sh::sh_basis;

    use super::*;

    #[test]
    fn flipped_coefficients_are_the_function_in_the_other_frame() {
        let d = Vec3::new(0.3, -0.7, 0.5).normalize();
        for flip in [Flip::ABOUT_X, Flip::ABOUT_Z] {
            let (mut here, mut there) = ([0.0; 25], [0.0; 25]);
            sh_basis(4, d.to_array(), &mut here);
            sh_basis(4, flip.point(d.to_array()), &mut there);
            for k in 0..25 {
                assert!((there[k] - flip.sh_sign(k) * here[k]).abs() < 1e-6, "{k}");
            }
        }
    }

    #[test]
    fn flipped_rotations_make_the_flipped_covariance() {
        let q = Quat::from_xyzw(0.1, -0.5, 0.3, 0.8).normalize();
        let variances = Vec3::new(1.0, 2.0, 3.0);
        let covariance = |q: Quat| {
            let r = glam::Mat3::from_quat(q);
            r * glam::Mat3::from_diagonal(variances) * r.transpose()
        };
        for flip in [Flip::ABOUT_X, Flip::ABOUT_Z] {
            let [w, x, y, z] = flip.rotation([q.w, q.x, q.y, q.z]);
            let f = glam::Mat3::from_diagonal(Vec3::from_array(flip.axes));
            let difference =
                covariance(Quat::from_xyzw(x, y, z, w)) - f * covariance(q) * f.transpose();
            assert!(difference.to_cols_array().iter().all(|v| v.abs() < 1e-6));
        }
    }
}
