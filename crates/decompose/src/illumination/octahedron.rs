//! Directions on a square: the octahedral map (Praun & Hoppe 2003; Cigolle et al. 2014).

use glam::{Vec2, Vec3};

/// A square of `side` by `side` directions over the whole sphere, with a rim of one texel so that values between texels need
/// no care at the seams.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Octahedron {
    pub(crate) side: usize,
}

/// The direction of a point of the square, both coordinates -1 to 1.
fn direction_of(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let fold = |a: f32, b: f32| (1.0 - b.abs()).copysign(a);
    let (x, y) = if z < 0.0 { (fold(p.x, p.y), fold(p.y, p.x)) } else { (p.x, p.y) };
    Vec3::new(x, y, z).normalize()
}

/// The point of the square of a direction.
fn point_of(d: Vec3) -> Vec2 {
    let d = d / (d.x.abs() + d.y.abs() + d.z.abs());
    let fold = |a: f32, b: f32| (1.0 - b.abs()).copysign(a);
    if d.z < 0.0 { Vec2::new(fold(d.x, d.y), fold(d.y, d.x)) } else { Vec2::new(d.x, d.y) }
}

impl Octahedron {
    /// Directions of the centers of the texels, row by row.
    pub(crate) fn centers(self) -> impl Iterator<Item = Vec3> {
        (0..self.side * self.side).map(move |k| {
            self.direction((k % self.side) as f32 + 0.5, (k / self.side) as f32 + 0.5)
        })
    }

    /// Number of texels with the rim.
    pub(crate) fn stored(&self) -> usize {
        (self.side + 2).pow(2)
    }

    /// Direction at (`x`, `y`) texels, centers at halves, without the rim.
    pub(crate) fn direction(&self, x: f32, y: f32) -> Vec3 {
        let side = self.side as f32;
        direction_of(Vec2::new(2.0 * x / side - 1.0, 2.0 * y / side - 1.0))
    }

    /// Texel that a direction falls into, without the rim.
    pub(crate) fn texel(&self, d: Vec3) -> usize {
        let p = (point_of(d) * 0.5 + 0.5) * self.side as f32;
        let cell = |v: f32| (v as usize).min(self.side - 1);
        cell(p.y) * self.side + cell(p.x)
    }

    /// Copies `side * side` values into a square with a rim.
    pub(crate) fn with_rim(&self, values: &[Vec3]) -> Vec<Vec3> {
        let side = self.side as isize;
        let at = |x: isize, y: isize| {
            // Over an edge the square goes on at the same edge, mirrored.
            let (mut x, mut y) = (x, y);
            if x < 0 || x >= side {
                (x, y) = (x.clamp(0, side - 1), side - 1 - y);
            }
            if y < 0 || y >= side {
                (x, y) = (side - 1 - x, y.clamp(0, side - 1));
            }
            values[(y * side + x) as usize]
        };
        let rows = (-1..=side).flat_map(|y| (-1..=side).map(move |x| (x, y)));
        rows.map(|(x, y)| at(x, y)).collect()
    }

    /// Value between the texels of a square with a rim.
    #[inline]
    pub(crate) fn look_up(&self, stored: &[Vec3], d: Vec3) -> Vec3 {
        let p = (point_of(d) * 0.5 + 0.5) * self.side as f32 + 0.5;
        let most = self.side as f32 + 0.999;
        let (px, py) = (p.x.clamp(0.0, most), p.y.clamp(0.0, most));
        let (x, y) = (px as usize, py as usize);
        let (s, t) = (px - x as f32, py - y as f32);
        let width = self.side + 2;
        let row = |y: usize| {
            let at = y * width + x;
            stored[at] + (stored[at + 1] - stored[at]) * s
        };
        row(y) + (row(y + 1) - row(y)) * t
    }

    /// Solid angle of every texel, without the rim, steradian: they sum to `4 π`.
    pub(crate) fn solid_angles(&self) -> Vec<f32> {
        let side = self.side;
        let corner = |x: usize, y: usize| self.direction(x as f32, y as f32).as_dvec3();
        // Two spherical triangles each (Van Oosterom & Strackee 1983).
        let triangle = |a: glam::DVec3, b: glam::DVec3, c: glam::DVec3| {
            let volume = a.dot(b.cross(c)).abs();
            2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
        };
        let of = |k: usize| {
            let (x, y) = (k % side, k / side);
            let (a, b) = (corner(x, y), corner(x + 1, y));
            let (c, d) = (corner(x + 1, y + 1), corner(x, y + 1));
            (triangle(a, b, c) + triangle(a, c, d)) as f32
        };
        (0..side * side).map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_return_and_fill_the_sphere() {
        let square = Octahedron { side: 12 };
        for k in 0..144 {
            let d = square.direction((k % 12) as f32 + 0.5, (k / 12) as f32 + 0.5);
            assert_eq!(square.texel(d), k);
            assert!((d.length() - 1.0).abs() < 1e-6);
        }
        let sum: f32 = square.solid_angles().iter().sum();
        assert!((sum - 4.0 * std::f32::consts::PI).abs() < 0.02, "{sum}");
    }

    #[test]
    fn a_smooth_field_is_found_between_texels_and_over_the_seams() {
        let square = Octahedron { side: 28 };
        let field = |d: Vec3| Vec3::new(1.0 + d.x, 1.0 + d.y * d.z, 1.0 - d.z);
        let centers = (0..28 * 28).map(|k| ((k % 28) as f32 + 0.5, (k / 28) as f32 + 0.5));
        let values: Vec<Vec3> = centers.map(|(x, y)| field(square.direction(x, y))).collect();
        let stored = square.with_rim(&values);
        assert_eq!(stored.len(), square.stored());
        let mut worst = 0.0f32;
        for k in 0..20_000 {
            let (a, b) = (k as f32 * 0.7548777, k as f32 * 0.5698403);
            let z = 2.0 * a.fract() - 1.0;
            let phi = std::f32::consts::TAU * b.fract();
            let r = (1.0 - z * z).sqrt();
            let d = Vec3::new(r * phi.cos(), r * phi.sin(), z);
            worst = worst.max((square.look_up(&stored, d) - field(d)).abs().max_element());
        }
        assert!(worst < 0.05, "{worst}");
    }
}
