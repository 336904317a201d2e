//! Solid textures: a base color for every point of space, as sharp as the pixels.

use glam::{IVec3, Vec3};
use motes_shading::sampling::unit_f32;

/// How the colors of a palette are laid out. Lengths are in units of the object.
#[derive(Clone, Copy, Debug)]
pub enum Pattern {
    /// One patch per cell of a random mosaic (Worley 1996) with dark joints.
    Patches,
    /// Small spots of the later colors on the first.
    Speckles,
    /// Wavy bands.
    Stripes,
    /// Soft clouds between the colors with grain on top.
    Clouds,
    /// Boards along x with grain.
    Boards,
    /// The first color everywhere.
    Plain,
}

/// What a surface is made of, everywhere.
#[derive(Clone, Debug)]
pub struct Paint {
    /// Layout.
    pub pattern: Pattern,
    /// Base colors, linear.
    pub palette: Vec<Vec3>,
    /// Length of a cell, band or board.
    pub cell: f32,
    /// Perceptual roughness.
    pub roughness: f32,
    /// 0 or 1.
    pub metallic: f32,
}

impl Paint {
    /// Base color at a point of the object.
    pub fn base_color(&self, p: Vec3) -> Vec3 {
        let q = p / self.cell;
        let grain = |p: Vec3, strength: f32| 1.0 + strength * (fractal(p * 3.0, 3) - 0.5);
        let pick = |h: f32| {
            let n = self.palette.len();
            self.palette[((h * n as f32) as usize).min(n - 1)]
        };
        let color = match self.pattern {
            Pattern::Plain => self.palette[0],
            Pattern::Patches => {
                let (nearest, second, cell) = worley(q);
                let joint = smooth_step(0.02, 0.07, second - nearest);
                pick(hash(cell, 9)) * (0.35 + 0.65 * joint) * grain(q, 0.3)
            }
            Pattern::Speckles => {
                let mut color = self.palette[0] * grain(q, 0.4);
                for (layer, scale) in [(1, 1.0), (2, 2.3), (3, 4.1)] {
                    let (nearest, _, cell) = worley(q * scale + Vec3::splat(7.3 * layer as f32));
                    let h = hash(cell, layer);
                    let inside = 1.0 - smooth_step(0.30, 0.36, nearest / (0.5 + 0.7 * h));
                    color = color.lerp(pick(hash(cell, layer + 20)), inside);
                }
                color
            }
            Pattern::Stripes => {
                let wave = q.z + 0.35 * (1.7 * q.x + 0.6 * q.y).sin() + 0.25 * (1.3 * q.y).cos();
                let band = wave.floor();
                let edge = (wave - band).min(1.0 - (wave - band));
                let color = pick(hash(IVec3::splat(band as i32), 3));
                color * (0.55 + 0.45 * smooth_step(0.03, 0.09, edge)) * grain(q, 0.25)
            }
            Pattern::Clouds => {
                let t = fractal(q, 5).clamp(0.0, 0.999) * (self.palette.len() - 1) as f32;
                let i = t as usize;
                let soft = self.palette[i].lerp(self.palette[i + 1], t.fract());
                let (nearest, _, cell) = worley(q * 3.0);
                let fleck = (1.0 - smooth_step(0.2, 0.3, nearest)) * hash(cell, 5);
                (soft * grain(q * 2.0, 0.5)).lerp(pick(hash(cell, 6)), 0.7 * fleck)
            }
            Pattern::Boards => {
                let board = q.y.floor();
                let shift = hash(IVec3::new(board as i32, 0, 0), 1) * 5.0;
                let end = ((q.x / 5.0) + shift).floor();
                let h = hash(IVec3::new(board as i32, end as i32, 1), 2);
                let fiber = fractal(Vec3::new(q.x * 0.7, q.y * 9.0, h * 40.0), 4);
                let edge = (q.y - board).min(1.0 - (q.y - board));
                pick(h) * (0.55 + 0.75 * fiber) * (0.3 + 0.7 * smooth_step(0.01, 0.03, edge))
            }
        };
        color.clamp(Vec3::splat(0.02), Vec3::splat(0.92))
    }
}

fn smooth_step(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A number in [0, 1) of a cell of the integer grid (Jarzynski & Olano, JCGT 2020, `pcg3d`).
#[inline]
fn hash(cell: IVec3, salt: u32) -> f32 {
    hash3(cell, salt).x
}

#[inline]
fn hash3(cell: IVec3, salt: u32) -> Vec3 {
    let lcg = |v: i32| (v as u32).wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    let (mut x, mut y) = (lcg(cell.x), lcg(cell.y));
    let mut z = lcg(cell.z) ^ salt.wrapping_mul(0x9e37_79b9);
    for shift in [16, 32] {
        x = x.wrapping_add(y.wrapping_mul(z));
        y = y.wrapping_add(z.wrapping_mul(x));
        z = z.wrapping_add(x.wrapping_mul(y));
        if shift == 16 {
            (x, y, z) = (x ^ (x >> shift), y ^ (y >> shift), z ^ (z >> shift));
        }
    }
    Vec3::new(unit_f32(x), unit_f32(y), unit_f32(z))
}

/// Distances to the nearest and second nearest feature point, and the cell of the nearest.
fn worley(p: Vec3) -> (f32, f32, IVec3) {
    let home = p.floor().as_ivec3();
    let (mut nearest, mut second, mut of) = (f32::INFINITY, f32::INFINITY, home);
    for i in 0..27 {
        let cell = home + IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
        let jitter = hash3(cell, 11);
        let distance = (cell.as_vec3() + jitter - p).length_squared();
        if distance < nearest {
            (second, nearest, of) = (nearest, distance, cell);
        } else if distance < second {
            second = distance;
        }
    }
    (nearest.sqrt(), second.sqrt(), of)
}

/// Value noise, about 0.5 on average.
fn noise(p: Vec3) -> f32 {
    let home = p.floor();
    let f = p - home;
    let f = f * f * (Vec3::splat(3.0) - 2.0 * f);
    let home = home.as_ivec3();
    let at = |x, y, z| hash(home + IVec3::new(x, y, z), 17);
    let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let plane =
        |z| lerp(lerp(at(0, 0, z), at(1, 0, z), f.x), lerp(at(0, 1, z), at(1, 1, z), f.x), f.y);
    lerp(plane(0), plane(1), f.z)
}

/// Octaves of [`noise`], 0 to 1.
pub(crate) fn fractal(p: Vec3, octaves: u32) -> f32 {
    let (mut sum, mut total, mut weight, mut scale) = (0.0, 0.0, 1.0, 1.0);
    for _ in 0..octaves {
        sum += weight * noise(p * scale);
        total += weight;
        weight *= 0.55;
        scale *= 2.03;
    }
    sum / total
}
