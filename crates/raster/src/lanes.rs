//! One Gaussian per lane: small vectors of lanes, elementary functions, rows to lanes and back.
//!
//! Lanes never meet in arithmetic, so what a Gaussian gives does not depend on its neighbors.
//! Closures over lanes given to `array::map` and the like stay calls through memory, because the
//! standard library is compiled without the vector instructions; [`three`] takes their place.

use std::ops::{Add, Mul, Sub};

use fearless_simd::{Simd, prelude::*};

/// Most lanes that a register has.
pub(crate) const MAX_LANES: usize = 16;

/// Row numbers, padded with the last one to a multiple of any number of lanes.
pub(crate) struct Padded {
    rows: Vec<u32>,
    count: usize,
}

impl Padded {
    #[inline(always)]
    pub(crate) fn new(mut rows: Vec<u32>) -> Self {
        let count = rows.len();
        if let Some(&last) = rows.last() {
            rows.resize(count.next_multiple_of(MAX_LANES), last);
        }
        Self { rows, count }
    }

    /// Rows of one vector after the other, `lanes` of them, and how many are not padding.
    #[inline(always)]
    pub(crate) fn vectors(&self, lanes: usize) -> impl Iterator<Item = (&[u32], usize)> {
        let starts = (0..self.count).step_by(lanes);
        starts.map(move |at| (&self.rows[at..at + lanes], lanes.min(self.count - at)))
    }
}

/// A three-vector per lane.
pub(crate) type Vec3s<S> = [<S as Simd>::f32s; 3];

/// The array of an expression for `k` = 0, 1, 2.
macro_rules! three {
    ($k:ident => $value:expr) => {
        [
            {
                let $k = 0usize;
                $value
            },
            {
                let $k = 1usize;
                $value
            },
            {
                let $k = 2usize;
                $value
            },
        ]
    };
}
pub(crate) use three;

#[inline(always)]
pub(crate) fn dot<F: Copy + Add<Output = F> + Mul<Output = F>>(a: [F; 3], b: [F; 3]) -> F {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vectors from the first lanes of arrays.
#[inline(always)]
pub(crate) fn load_columns<S: Simd, const N: usize>(
    simd: S,
    columns: &[[f32; MAX_LANES]; N],
) -> [S::f32s; N] {
    let mut out = [S::f32s::simd_from(simd, 0.0); N];
    for (out, column) in out.iter_mut().zip(columns) {
        *out = S::f32s::from_slice(simd, &column[..S::f32s::LEN]);
    }
    out
}

#[inline(always)]
pub(crate) fn cross<F: Copy + Sub<Output = F> + Mul<Output = F>>(a: [F; 3], b: [F; 3]) -> [F; 3] {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}

/// `v * factor`; the factor is a vector of lanes or one number.
#[inline(always)]
pub(crate) fn scaled<F: Copy + Mul<K, Output = F>, K: Copy>(v: [F; 3], factor: K) -> [F; 3] {
    [v[0] * factor, v[1] * factor, v[2] * factor]
}

/// Componentwise sum.
#[inline(always)]
pub(crate) fn sum<F: Copy + Add<Output = F>>(a: [F; 3], b: [F; 3]) -> [F; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Componentwise product.
#[inline(always)]
pub(crate) fn product<F: Copy + Mul<Output = F>>(a: [F; 3], b: [F; 3]) -> [F; 3] {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

/// `Σ columns[k] v[k]`
#[inline(always)]
pub(crate) fn from_axes<F: Copy + Add<Output = F> + Mul<Output = F>>(
    columns: [[F; 3]; 3],
    v: [F; 3],
) -> [F; 3] {
    let [x, y, z] = columns;
    sum(sum(scaled(x, v[0]), scaled(y, v[1])), scaled(z, v[2]))
}

/// `columns[k] · v`
#[inline(always)]
pub(crate) fn in_axes<F: Copy + Add<Output = F> + Mul<Output = F>>(
    columns: [[F; 3]; 3],
    v: [F; 3],
) -> [F; 3] {
    three!(k => dot(columns[k], v))
}

/// Adding it leaves the nearest integer, and 127, in the low bits of the sum.
const ROUND: f32 = 12_582_912.0 + 127.0;
/// ln 2 in two parts, the first short enough that its multiples are exact (Cephes, `expf`).
const LN_2: [f32; 2] = [0.693_359_375, -2.121_944_4e-4];
/// `(exp(r) - 1 - r) / r²` on `|r| <= ln 2 / 2` from the highest power down (Cephes, `expf`).
const EXP: [f32; 6] = [
    1.987_569_15e-4,
    1.398_199_950_7e-3,
    8.333_451_907_3e-3,
    4.166_579_589_4e-2,
    0.166_666_654_59,
    0.500_000_012_01,
];

/// `exp(x)` to 2e-7; 0 below -87.3, infinite above 88, NaN for NaN.
#[inline(always)]
pub(crate) fn exp<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let zero = S::f32s::simd_from(simd, 0.0);
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = n.mul_add(-LN_2[1], n.mul_add(-LN_2[0], x));
    let mut p = S::f32s::simd_from(simd, EXP[0]);
    for &c in &EXP[1..] {
        p = p.mul_add(r, c);
    }
    let value = (p * r).mul_add(r, r) + 1.0;
    let bits: S::u32s = shifted.bitcast();
    let power: S::f32s = (bits << 23).bitcast();
    let value = x.simd_gt(-87.3).select(value * power, zero);
    x.simd_lt(88.0).select(value, x * f32::INFINITY)
}

/// `log2(x)` of positive normal numbers, to 2e-7 beside 1 and relatively elsewhere.
#[inline(always)]
pub(crate) fn log2<S: Simd>(x: S::f32s) -> S::f32s {
    /// Bits of `sqrt(1/2)`: mantissas are taken around 1.
    const ROOT: u32 = 0x3f35_04f3;
    let bits: S::u32s = x.bitcast();
    let shifted = bits + (0x3f80_0000 - ROOT);
    let exponent = (shifted >> 23).to_float::<S::f32s>() - 127.0;
    let mantissa: S::f32s = ((shifted & 0x007f_ffff) + ROOT).bitcast();
    let z = (mantissa - 1.0) / (mantissa + 1.0);
    let z2 = z * z;
    // The series of 2 artanh(z), |z| <= 0.172.
    let series = (z2 * (1.0 / 9.0) + 1.0 / 7.0).mul_add(z2, 1.0 / 5.0);
    let series = series.mul_add(z2, 1.0 / 3.0).mul_add(z2, 1.0);
    (z * (2.0 * std::f32::consts::LOG2_E)).mul_add(series, exponent)
}

/// `1 / (1 + exp(-x))`; NaN for NaN.
#[inline(always)]
pub(crate) fn sigmoid<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let one = S::f32s::simd_from(simd, 1.0);
    let e = exp(simd, -x.abs());
    x.simd_ge(0.0).select(one, e) / (e + 1.0)
}

/// As many vectors as a register has lanes: rows become columns.
///
/// Interleaving the halves rotates the bits of the address of a value (row, then lane) by one; as
/// many rotations as a lane has bits exchange the two.
#[inline(always)]
pub(crate) fn transpose<S: Simd>(v: &mut [S::f32s]) {
    let n = S::f32s::LEN;
    let mut next = [v[0]; MAX_LANES];
    let mut stage = 1;
    while stage < n {
        for i in 0..n / 2 {
            (next[2 * i], next[2 * i + 1]) = v[i].interleave(v[i + n / 2]);
        }
        v[..n].copy_from_slice(&next[..n]);
        stage *= 2;
    }
}

/// Columns `0..columns` of the rows `first + rows[lane]`, which are `stride` values apart, a vector
/// each; `out` is filled up to a multiple of the lanes with whatever follows.
#[inline(always)]
pub(crate) fn gather_columns<S: Simd>(
    simd: S,
    source: &[f32],
    stride: usize,
    first: usize,
    rows: &[u32],
    columns: usize,
    out: &mut [S::f32s],
) {
    let n = S::f32s::LEN;
    for (block, out) in out.chunks_exact_mut(n).take(columns.div_ceil(n)).enumerate() {
        for (out, &row) in out.iter_mut().zip(rows) {
            let at = (first + row as usize) * stride + block * n;
            *out = match source.get(at..at + n) {
                Some(row) => S::f32s::from_slice(simd, row),
                None => {
                    let mut row = [0.0; MAX_LANES];
                    let rest = &source[at..];
                    row[..rest.len()].copy_from_slice(rest);
                    S::f32s::from_slice(simd, &row[..n])
                }
            };
        }
        transpose::<S>(out);
    }
}

/// The inverse of [`gather_columns`]: rows of `columns` values without gaps, one per lane of
/// `rows`. The vectors are used up.
#[inline(always)]
pub(crate) fn scatter_columns<S: Simd>(
    values: &mut [S::f32s],
    target: &mut [f32],
    rows: &[u32],
    columns: usize,
) {
    let n = S::f32s::LEN;
    for (block, values) in values.chunks_exact_mut(n).take(columns.div_ceil(n)).enumerate() {
        transpose::<S>(values);
        let width = n.min(columns - block * n);
        for (value, &row) in values.iter().zip(rows) {
            let at = row as usize * columns + block * n;
            if width == n {
                value.store_slice(&mut target[at..at + n]);
            } else {
                target[at..at + width].copy_from_slice(&value.as_slice()[..width]);
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;
