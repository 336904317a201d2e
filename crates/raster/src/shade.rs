//! Colors of Gaussians seen from a camera and their gradients, one Gaussian per lane.
//!
//! `color = max(0, 0.5 + Σ Y_k(direction) sh_k)`. The coefficients of a Gaussian lie in one row;
//! they are transposed, so that every coefficient is a vector over Gaussians.

use fearless_simd::{Simd, prelude::*};
use motes_math::sh::{sh_basis_gradient_of, sh_basis_of, sh_coefficients};
use motes_scene::Gaussians;

use crate::lanes::{
    MAX_LANES, Padded, Vec3s, dot, gather_columns, load_columns, scaled, scatter_columns, sum,
};
use crate::options::RenderOptions;
use crate::view::ViewTransform;

/// Vectors that hold the coefficients of degree 4, up to a multiple of the lanes.
const COLUMNS: usize = 80;

/// What the colors of a view depend on.
pub(crate) struct Shader<'a> {
    view: &'a ViewTransform,
    gaussians: &'a Gaussians,
    /// Degree in use.
    degree: u8,
}

/// Coefficients of the Gaussians of one vector: those in use, channels innermost.
pub(crate) struct Coefficients<S: Simd>([S::f32s; COLUMNS]);

impl<S: Simd> Coefficients<S> {
    /// Zeros.
    #[inline(always)]
    pub(crate) fn new(simd: S) -> Self {
        Self([S::f32s::simd_from(simd, 0.0); COLUMNS])
    }

    /// Zeros in the other lanes.
    #[inline(always)]
    pub(crate) fn keep(&mut self, simd: S, lanes: S::mask32s) {
        if !lanes.all_true() {
            let zero = S::f32s::simd_from(simd, 0.0);
            for v in &mut self.0 {
                *v = lanes.select(*v, zero);
            }
        }
    }
}

impl<'a> Shader<'a> {
    pub(crate) fn new(
        view: &'a ViewTransform,
        gaussians: &'a Gaussians,
        options: &RenderOptions,
    ) -> Self {
        let degree = options.sh_degree_limit.unwrap_or(4).min(gaussians.sh_degree);
        Self { view, gaussians, degree }
    }

    /// Hands the color of Gaussian `first + k` to `put`, for every `k` of `rows`; channels below 0
    /// and NaN are 0.
    #[inline(always)]
    pub(crate) fn color<S: Simd>(
        &self,
        simd: S,
        first: usize,
        rows: &Padded,
        mut put: impl FnMut(usize, [f32; 3]),
    ) {
        let mut sh = Coefficients::new(simd);
        for (rows, count) in rows.vectors(S::f32s::LEN) {
            self.gather(simd, first, rows, &mut sh);
            let mut mean = [[0.0; MAX_LANES]; 3];
            for (lane, &row) in rows.iter().enumerate() {
                let of_row = &self.gaussians.means[first + row as usize];
                for (column, value) in mean.iter_mut().zip(of_row) {
                    column[lane] = *value;
                }
            }
            let mean = load_columns(simd, &mean);
            let (direction, _) = self.direction(simd, mean);
            let color = self.raw(simd, direction, &sh);
            for (lane, &k) in rows[..count].iter().enumerate() {
                let raw = [0, 1, 2].map(|c| color[c].as_slice()[lane]);
                put(k as usize, raw.map(|v| v.max(0.0)));
            }
        }
    }

    #[inline(always)]
    pub(crate) fn gather<S: Simd>(
        &self,
        simd: S,
        first: usize,
        rows: &[u32],
        sh: &mut Coefficients<S>,
    ) {
        let row = 3 * self.gaussians.sh_coefficients();
        let columns = 3 * sh_coefficients(self.degree);
        gather_columns(simd, &self.gaussians.sh, row, first, rows, columns, &mut sh.0);
    }

    /// Unit vectors from the camera to `mean`, zero at the camera, and one over the distance.
    #[inline(always)]
    fn direction<S: Simd>(&self, simd: S, mean: Vec3s<S>) -> (Vec3s<S>, S::f32s) {
        let offset = self.view.lanes_to::<S>(mean);
        let inverse = S::f32s::simd_from(simd, 1.0) / dot(offset, offset).sqrt();
        let somewhere = inverse.simd_gt(0.0) & inverse.simd_lt(f32::MAX);
        let inverse = somewhere.select(inverse, S::f32s::simd_from(simd, 0.0));
        (scaled(offset, inverse), inverse)
    }

    /// Unclamped color `0.5 + Σ Y_k sh_k`.
    #[inline(always)]
    fn raw<S: Simd>(&self, simd: S, direction: Vec3s<S>, sh: &Coefficients<S>) -> Vec3s<S> {
        let one = S::f32s::simd_from(simd, 1.0);
        let mut basis = [one; 25];
        sh_basis_of::<f32, _>(self.degree, one, direction, &mut basis);
        let mut color = [S::f32s::simd_from(simd, 0.5); 3];
        let k = sh_coefficients(self.degree);
        for (y, sh) in basis[..k].iter().zip(sh.0.chunks_exact(3)) {
            for (color, sh) in color.iter_mut().zip(sh) {
                *color = sh.mul_add(*y, *color);
            }
        }
        color
    }

    /// From the gradient by the color, zero where the color was clamped, to that by the mean; `sh`
    /// holds the coefficients before and their gradients afterwards.
    #[inline(always)]
    pub(crate) fn backward<S: Simd>(
        &self,
        simd: S,
        mean: Vec3s<S>,
        d_color: Vec3s<S>,
        sh: &mut Coefficients<S>,
    ) -> Vec3s<S> {
        let (one, zero) = (S::f32s::simd_from(simd, 1.0), S::f32s::simd_from(simd, 0.0));
        let (direction, inverse_distance) = self.direction(simd, mean);
        let k = sh_coefficients(self.degree);
        let mut d_mean = [zero; 3];
        if self.degree > 0 {
            let mut gradient = [[zero; 3]; 25];
            sh_basis_gradient_of::<f32, _>(self.degree, one, direction, &mut gradient);
            let mut d_direction = [zero; 3];
            for (g, c) in gradient[1..k].iter().zip(sh.0[3..].chunks_exact(3)) {
                let weight = c[2].mul_add(d_color[2], c[1].mul_add(d_color[1], c[0] * d_color[0]));
                for (d, g) in d_direction.iter_mut().zip(g) {
                    *d = g.mul_add(weight, *d);
                }
            }
            // Normalizing projects on the tangent plane.
            let along = -dot(direction, d_direction);
            d_mean = scaled(sum(d_direction, scaled(direction, along)), inverse_distance);
        }
        let mut basis = [one; 25];
        sh_basis_of::<f32, _>(self.degree, one, direction, &mut basis);
        for (y, out) in basis[..k].iter().zip(sh.0.chunks_exact_mut(3)) {
            for (out, d) in out.iter_mut().zip(d_color) {
                *out = *y * d;
            }
        }
        let row = 3 * self.gaussians.sh_coefficients();
        sh.0[3 * k..row.next_multiple_of(S::f32s::LEN)].fill(zero);
        d_mean
    }

    /// Writes the rows `rows` of the gradients by all coefficients, zero past the degree in use.
    #[inline(always)]
    pub(crate) fn scatter<S: Simd>(
        &self,
        sh: &mut Coefficients<S>,
        target: &mut [f32],
        rows: &[u32],
    ) {
        let row = 3 * self.gaussians.sh_coefficients();
        scatter_columns::<S>(&mut sh.0, target, rows, row);
    }
}
