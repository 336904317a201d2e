//! World Gaussians to projected Gaussians of one view.
//!
//! With `p = W (mean - center)` in the camera frame and `J` the Jacobian of the pinhole
//! projection at `p`, the projected covariance is `Σ' = J W Σ Wᵀ Jᵀ + blur I` (Zwicker et al.
//! 2001). `Σ = R diag(σ² + filter²) Rᵀ`, where `filter` is the per-Gaussian 3D smoothing scale of
//! Mip-Splatting (Yu et al. 2024), which also lowers the opacity by
//! `Π sqrt(σ² / (σ² + filter²))`.

use fearless_simd::{Simd, prelude::*};
use motes_scene::Gaussians;

use crate::footprint::{Footprint, Rows};
use crate::lanes::{MAX_LANES, Padded, log2, transpose};
use crate::options::{Antialias, Modifiers, RenderOptions};
use crate::parameters::Sorting;
use crate::shade::Shader;
use crate::splat::{Cutoffs, MAHALANOBIS, Splat};
use crate::view::ViewTransform;

/// Projects the Gaussians from `first` on, one per splat; [`Splat::INVISIBLE`] those that cannot
/// touch the image.
#[inline(always)]
pub(crate) fn project<S: Simd>(
    simd: S,
    view: &ViewTransform,
    gaussians: &Gaussians,
    first: usize,
    modifiers: &Modifiers<'_>,
    options: &RenderOptions,
    splats: &mut [Splat],
) {
    let cutoffs = Cutoffs::new(options);
    let mut visible = Vec::with_capacity(splats.len());
    for (block, out) in splats.chunks_mut(S::f32s::LEN).enumerate() {
        let start = block * S::f32s::LEN;
        // Lanes past the end repeat the last Gaussian.
        let ids: [u32; MAX_LANES] =
            std::array::from_fn(|lane| (start + lane.min(out.len() - 1)) as u32);
        let rows = Rows::gather(simd, gaussians, modifiers, first, &ids);
        let seen = project_lanes(simd, view, &rows, options, &cutoffs, out);
        for lane in 0..out.len() {
            if seen >> lane & 1 != 0 {
                visible.push((start + lane) as u32);
            }
        }
    }
    let shader = Shader::new(view, gaussians, options);
    shader.color(simd, first, &Padded::new(visible), |k, color| {
        match color.iter().all(|v| v.is_finite()) {
            true => splats[k].color = color,
            false => splats[k] = Splat::INVISIBLE,
        }
    });
}

/// Writes the splats of one vector of Gaussians without their colors; a bit for each visible one.
#[inline(always)]
fn project_lanes<S: Simd>(
    simd: S,
    view: &ViewTransform,
    rows: &Rows<S>,
    options: &RenderOptions,
    cutoffs: &Cutoffs,
    out: &mut [Splat],
) -> u64 {
    let Some(f) = Footprint::new(simd, view, rows, options.near) else {
        out.fill(Splat::INVISIBLE);
        return 0;
    };
    let mut opacity = f.opacity;
    if options.antialias == Antialias::Mip {
        opacity *= (f.sharp_schur / f.schur).sqrt();
    }
    let x = f.p[0] * f.inverse_z * view.focal[0] + view.principal[0];
    let y = f.p[1] * f.inverse_z * view.focal[1] + view.principal[1];
    let (shape, elliptic, half_width) = Shape::new(simd, &f, opacity, cutoffs);
    let [w, h] = view.size.map(|s| s as f32);
    let on_image = (x + half_width).simd_gt(0.0)
        & (x - half_width).simd_lt(w)
        & (y + shape.half_height).simd_gt(0.0)
        & (y - shape.half_height).simd_lt(h);
    let seen = (f.alive & elliptic & on_image).to_bitmask();
    if seen == 0 {
        out.fill(Splat::INVISIBLE);
        return 0;
    }
    let zero = S::f32s::simd_from(simd, 0.0);
    let [depth_x, depth_y] = match options.parameters.sort {
        Sorting::Global => [zero; 2],
        Sorting::Tile | Sorting::Pixel => f.depth_slope(view),
    };
    // In the order of `Splat::from_values`.
    let mut values = [
        x,
        y,
        shape.sa,
        shape.sb,
        shape.sd,
        shape.level,
        shape.threshold,
        zero,
        zero,
        zero,
        f.p[2],
        shape.half_height,
        shape.rightmost_dy,
        shape.inverse_sa,
        depth_x,
        depth_y,
    ];
    for part in values.chunks_exact_mut(S::f32s::LEN) {
        transpose::<S>(part);
    }
    for (lane, splat) in out.iter_mut().enumerate() {
        if seen >> lane & 1 == 0 {
            *splat = Splat::INVISIBLE;
            continue;
        }
        let mut row = [0.0; MAX_LANES];
        for (row, part) in row.chunks_exact_mut(S::f32s::LEN).zip(values.chunks_exact(S::f32s::LEN))
        {
            part[lane].store_slice(row);
        }
        *splat = Splat::from_values(row);
    }
    seen
}

#[inline(always)]
fn finite<S: Simd>(v: S::f32s) -> S::mask32s {
    v.simd_gt(0.0) & v.simd_lt(f32::MAX)
}

/// The conic of a vector of splats, as [`Splat`] keeps it.
struct Shape<S: Simd> {
    sa: S::f32s,
    sb: S::f32s,
    sd: S::f32s,
    level: S::f32s,
    threshold: S::f32s,
    half_height: S::f32s,
    rightmost_dy: S::f32s,
    inverse_sa: S::f32s,
}

impl<S: Simd> Shape<S> {
    /// Also which lanes are ellipses of which something can be seen (NaN is none), and half the
    /// width of their bounding boxes.
    #[inline(always)]
    fn new(
        simd: S,
        f: &Footprint<S>,
        opacity: S::f32s,
        cutoffs: &Cutoffs,
    ) -> (Self, S::mask32s, S::f32s) {
        let [xx, xy, yy] = f.covariance;
        let opaque = opacity.simd_gt(cutoffs.alpha_min) & opacity.simd_lt(f32::MAX);
        let scale = S::f32s::simd_from(simd, MAHALANOBIS.recip());
        let (sa, sd) = ((scale / f.schur).sqrt(), (scale / yy).sqrt());
        let inverse_sa = S::f32s::simd_from(simd, 1.0) / sa;
        let level = log2::<S>(opacity) * 0.125;
        let threshold = (level - cutoffs.extent).max(cutoffs.level_min);
        let reach = (level - threshold) * MAHALANOBIS;
        let (half_width, half_height) = ((reach * xx).sqrt(), (reach * yy).sqrt());
        let elliptic = opaque
            & finite::<S>(f.schur)
            & finite::<S>(half_width)
            & finite::<S>(half_height)
            & finite::<S>(inverse_sa)
            & finite::<S>(sd);
        let sb = -sa * (xy / yy);
        let rightmost_dy = half_width * (xy / xx);
        let shape = Self { sa, sb, sd, level, threshold, half_height, rightmost_dy, inverse_sa };
        (shape, elliptic, half_width)
    }
}
