//! From gradients of one projected Gaussian to gradients of its stored parameters.
//!
//! The chain of [`crate::project`], backwards. The moments are those of `v` with `(E, D) = L offset`
//! and `Σ'⁻¹ = κ LᵀL`, κ = 16 ln 2; then `∂L/∂center = Σ v Σ'⁻¹ offset` and `∂L/∂Σ' = ½ κ² Lᵀ M L`
//! with `M` the second moments. Sums of rows with `shear = sb / sa` are formed first, because that is
//! where the length of a needle cancels.

use fearless_simd::{Simd, prelude::*};
use motes_scene::Gaussians;

use crate::backward::MOMENTS;
use crate::footprint::{Footprint, Rows};
use crate::gradients::GradientRows;
use crate::lanes::{MAX_LANES, Padded, Vec3s, dot, load_columns, product, scaled, sum, three};
use crate::options::{Modifiers, RenderOptions};
use crate::shade::{Coefficients, Shader};
use crate::splat::{MAHALANOBIS, Splat};
use crate::view::ViewTransform;

/// Chains `moments` (summed over all tiles) of the Gaussians from `first` on; writes all of `out`,
/// zeros where a splat is not visible.
#[inline(always)]
pub(crate) fn project_backward<S: Simd>(
    simd: S,
    view: &ViewTransform,
    gaussians: &Gaussians,
    first: usize,
    modifiers: &Modifiers<'_>,
    options: &RenderOptions,
    splats: &[Splat],
    moments: &[[f32; MOMENTS]],
    out: &mut GradientRows<'_>,
) {
    let mut visible = Vec::with_capacity(splats.len());
    for (k, splat) in splats.iter().enumerate() {
        match splat.is_visible() {
            true => visible.push(k as u32),
            false => out.clear(k),
        }
    }
    let shader = Shader::new(view, gaussians, options);
    let mut sh = Coefficients::new(simd);
    for (lanes, count) in Padded::new(visible).vectors(S::f32s::LEN) {
        let rows = &lanes[..count];
        let parameters = Rows::gather(simd, gaussians, modifiers, first, lanes);
        let projected = Projected::gather(simd, splats, moments, lanes);
        let Some(f) = Footprint::new(simd, view, &parameters, options.near) else {
            rows.iter().for_each(|&k| out.clear(k as usize));
            continue;
        };
        shader.gather(simd, first, lanes, &mut sh);
        let values = chain(simd, view, &shader, &parameters, &f, &projected, &mut sh);
        let mut columns = [[0.0; MAX_LANES]; 12];
        for (column, value) in columns.iter_mut().zip(values) {
            value.store_slice(&mut column[..S::f32s::LEN]);
        }
        out.set(rows, &columns);
        shader.scatter(&mut sh, out.sh, rows);
    }
}

/// What the chain reads of the splats and what the tiles summed up.
struct Projected<S: Simd> {
    sa: S::f32s,
    sd: S::f32s,
    shear: S::f32s,
    color: Vec3s<S>,
    moments: [S::f32s; MOMENTS],
}

impl<S: Simd> Projected<S> {
    #[inline(always)]
    fn gather(simd: S, splats: &[Splat], moments: &[[f32; MOMENTS]], rows: &[u32]) -> Self {
        let mut columns = [[0.0f32; MAX_LANES]; 6 + MOMENTS];
        for (lane, &k) in rows.iter().enumerate() {
            let k = k as usize;
            let splat = &splats[k];
            let [r, g, b] = splat.color;
            let values = [splat.sa, splat.sd, splat.shear(), r, g, b];
            for (column, value) in columns.iter_mut().zip(values.iter().chain(&moments[k])) {
                column[lane] = *value;
            }
        }
        let [sa, sd, shear, r, g, b, moments @ ..] = load_columns(simd, &columns);
        Self { sa, sd, shear, color: [r, g, b], moments }
    }
}

/// Gradients in the order of [`GradientRows::set`]; those by the coefficients replace `sh`.
#[inline(always)]
fn chain<S: Simd>(
    simd: S,
    view: &ViewTransform,
    shader: &Shader<'_>,
    parameters: &Rows<S>,
    f: &Footprint<S>,
    projected: &Projected<S>,
    sh: &mut Coefficients<S>,
) -> [S::f32s; 12] {
    let zero = S::f32s::simd_from(simd, 0.0);
    let [v0, ve, vd, vee, ved, vdd, colors @ ..] = projected.moments;
    let (sa, sd) = (projected.sa * MAHALANOBIS, projected.sd * MAHALANOBIS);
    let shear = projected.shear;
    let d_center = [sa * ve, shear * (sa * ve) + sd * vd];
    let (alpha, beta, gamma) = (sa * sa * vee, sa * sd * ved, sd * sd * vdd);

    // Σ' = (JW) Σ (JW)ᵀ with Σ = R diag(s) Rᵀ; work in local axes, where Σ is diagonal.
    let local = f.local;
    let sheared = sum(local[0], scaled(local[1], shear));
    let s = f.smoothed_variance;
    // ∂L/∂(JW rows) = 2 ∂L/∂Σ' (JW) Σ
    let d_local0 = product(sum(scaled(sheared, alpha), scaled(local[1], beta)), s);
    let below = product(sum(scaled(sheared, beta), scaled(local[1], gamma)), s);
    let d_local = [d_local0, sum(scaled(d_local0, shear), below)];
    let d_jw = [f.in_world(d_local[0]), f.in_world(d_local[1])];

    // Opacity and the 3D filter: ln o = ln sigmoid + Σ (ln σ_k - ½ ln s_k).
    let filtered = parameters.filter.simd_gt(0.0);
    let d_log_scale = three!(k => {
        // ∂L/∂s_k, twice
        let d_s = sheared[k] * sheared[k] * alpha
            + sheared[k] * local[1][k] * (beta * 2.0)
            + local[1][k] * local[1][k] * gamma;
        let faded = v0 - v0 * (f.variance[k] / s[k]);
        d_s * f.variance[k] + filtered.select(faded, zero)
    });

    let d_mean_camera = mean_through_projection(simd, view, f, d_center, d_jw);
    let d_color: Vec3s<S> = three!(c => projected.color[c].simd_gt(0.0).select(colors[c], zero));
    // A Gaussian whose numbers overflow cannot be improved by a step; it must not spoil the others.
    // The basis is below 16, so gradients by coefficients do not overflow before this does.
    let usable = three!(c => (d_color[c] * 16.0).abs().simd_lt(f32::MAX));
    let usable = usable[0] & usable[1] & usable[2] & f.alive;
    let d_color = three!(c => usable.select(d_color[c], zero));
    let d_mean_color = shader.backward(simd, parameters.mean, d_color, sh);
    let r = view.rotation;
    let axes = [r.x_axis.to_array(), r.y_axis.to_array(), r.z_axis.to_array()];
    let d = d_mean_camera;
    let d_mean: Vec3s<S> = three!(k => {
        d[0] * axes[k][0] + d[1] * axes[k][1] + d[2] * axes[k][2] + d_mean_color[k]
    });
    let d_rotation = quaternion_gradient(parameters.quaternion, f, d_local);
    let half = [view.size[0] as f32 * 0.5, view.size[1] as f32 * 0.5];
    let norm = norm2::<S>(d_center[0] * half[0], d_center[1] * half[1]);
    let [mx, my, mz] = d_mean;
    let [qw, qx, qy, qz] = d_rotation;
    let [sx, sy, sz] = d_log_scale;
    let mut values = [mx, my, mz, qw, qx, qy, qz, sx, sy, sz, v0 - v0 * f.sigmoid, norm];
    let mut size = zero;
    for v in values {
        size += v * 0.0;
    }
    let usable = usable & size.simd_eq(0.0);
    sh.keep(simd, usable);
    for v in &mut values {
        *v = usable.select(*v, zero);
    }
    values
}

/// `sqrt(x² + y²)` without overflow in between.
#[inline(always)]
fn norm2<S: Simd>(x: S::f32s, y: S::f32s) -> S::f32s {
    let (x, y) = (x.abs(), y.abs());
    let (small, large) = (x.min(y), x.max(y));
    let ratio = small / large.max(f32::MIN_POSITIVE);
    large * (ratio * ratio + 1.0).sqrt()
}

/// Gradient by the camera-frame center, through the pixel position and through `J`.
#[inline(always)]
fn mean_through_projection<S: Simd>(
    simd: S,
    view: &ViewTransform,
    f: &Footprint<S>,
    d_center: [S::f32s; 2],
    d_jw: [Vec3s<S>; 2],
) -> Vec3s<S> {
    let zero = S::f32s::simd_from(simd, 0.0);
    let row2 = view.rotation.row(2).to_array();
    let mut d = [zero; 3];
    for axis in 0..2 {
        let scale = f.inverse_z * view.focal[axis];
        // pixel = focal p_axis / z
        let through_pixel = d_center[axis] * scale;
        d[axis] += through_pixel;
        d[2] -= through_pixel * f.raw_slope[axis];
        // jw = (row_axis - row2 slope) focal / z
        d[2] -= dot(d_jw[axis], f.jw[axis]) * f.inverse_z;
        let along = d_jw[axis][0] * row2[0] + d_jw[axis][1] * row2[1] + d_jw[axis][2] * row2[2];
        let d_slope = -(along * scale) * f.inverse_z;
        let free = f.raw_slope[axis].simd_eq(f.slope[axis]);
        let d_slope = free.select(d_slope, zero);
        d[axis] += d_slope;
        d[2] -= d_slope * f.raw_slope[axis];
    }
    d
}

/// `∂L/∂q` of the stored quaternion `w x y z`; Σ' depends on R through `local = Rᵀ jw`, so
/// `∂L/∂R = Σ_r jw_r (∂L/∂local_r)ᵀ`.
#[inline(always)]
fn quaternion_gradient<S: Simd>(
    stored: [S::f32s; 4],
    f: &Footprint<S>,
    d_local: [Vec3s<S>; 2],
) -> [S::f32s; 4] {
    let n = f.inverse_norm;
    let [w, x, y, z] = [stored[0] * n, stored[1] * n, stored[2] * n, stored[3] * n];
    // ∂L/∂R, row i of it.
    let ([a, b], [c, d]) = (f.jw, d_local);
    let e = three!(i => sum(scaled(c, a[i]), scaled(d, b[i])));
    let [[e00, e01, e02], [e10, e11, e12], [e20, e21, e22]] = e;
    // Halves of the gradient by the unit quaternion.
    let unit = [
        x * (e21 - e12) + y * (e02 - e20) + z * (e10 - e01),
        y * (e01 + e10) + z * (e02 + e20) + w * (e21 - e12) - x * (e11 + e22) * 2.0,
        x * (e01 + e10) + z * (e12 + e21) + w * (e02 - e20) - y * (e00 + e22) * 2.0,
        x * (e02 + e20) + y * (e12 + e21) + w * (e10 - e01) - z * (e00 + e11) * 2.0,
    ];
    let along = w * unit[0] + x * unit[1] + y * unit[2] + z * unit[3];
    let scale = n * 2.0;
    [
        (unit[0] - w * along) * scale,
        (unit[1] - x * along) * scale,
        (unit[2] - y * along) * scale,
        (unit[3] - z * along) * scale,
    ]
}
