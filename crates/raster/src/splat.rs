//! One projected Gaussian, and which pixels it can reach.
//!
//! With the upper triangular `L = [[sa, sb], [0, sd]]` and `(E, D) = L (dx, dy)`, offsets in pixels
//! from the center, `log2 alpha = 8 (level - E² - D²)`: a sum of squares, which neither cancels nor
//! turns negative however thin the ellipse is. The factor 8 belongs to the polynomial of
//! [`crate::exp2`].

use crate::options::{ALPHA_MAX, RenderOptions};

/// `(E² + D²)` times this is the squared Mahalanobis distance: 16 ln 2.
pub(crate) const MAHALANOBIS: f32 = 16.0 * std::f32::consts::LN_2;

/// Slack of every bound, pixels: rounding must never drop a pixel that the kernel would keep.
pub(crate) const SLACK: f32 = 0.01;

/// Cut-offs of a rendering in the units of the kernels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cutoffs {
    pub(crate) alpha_min: f32,
    /// `log2(alpha_min) / 8`
    pub(crate) level_min: f32,
    /// Squared extent in units of `E² + D²`; infinite without a cut-off.
    pub(crate) extent: f32,
}

impl Cutoffs {
    pub(crate) fn new(options: &RenderOptions) -> Self {
        let parameters = &options.parameters;
        let extent = parameters.extent_sigmas.map_or(f32::INFINITY, |s| s * s / MAHALANOBIS);
        Self {
            alpha_min: parameters.alpha_min,
            level_min: parameters.alpha_min.log2() / 8.0,
            extent,
        }
    }
}

/// One projected Gaussian as the tile kernels read it: exactly one cache line.
///
/// `half_height` 0 means: not visible.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Splat {
    /// Center, pixels.
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) sa: f32,
    pub(crate) sb: f32,
    pub(crate) sd: f32,
    /// `log2(opacity) / 8`
    pub(crate) level: f32,
    /// Pixels with `level - E² - D²` below this are not touched.
    pub(crate) threshold: f32,
    pub(crate) color: [f32; 3],
    /// z of the center in the camera frame.
    pub(crate) depth: f32,
    /// Half height of the bounding box.
    pub(crate) half_height: f32,
    /// dy of the rightmost point; the leftmost one is at its negative.
    pub(crate) rightmost_dy: f32,
    /// `1 / sa`
    pub(crate) inverse_sa: f32,
    /// Change of the depth of the densest point along the ray per pixel; only for sorting by it.
    pub(crate) depth_slope: [f32; 2],
}

impl Splat {
    pub(crate) const INVISIBLE: Self = Self {
        x: 0.0,
        y: 0.0,
        sa: 0.0,
        sb: 0.0,
        sd: 0.0,
        level: f32::MIN,
        threshold: 0.0,
        color: [0.0; 3],
        depth: 0.0,
        half_height: 0.0,
        rightmost_dy: 0.0,
        inverse_sa: 0.0,
        depth_slope: [0.0; 2],
    };

    /// From its fields in the order of memory.
    #[inline(always)]
    pub(crate) fn from_values(v: [f32; 16]) -> Self {
        Self {
            x: v[0],
            y: v[1],
            sa: v[2],
            sb: v[3],
            sd: v[4],
            level: v[5],
            threshold: v[6],
            color: [v[7], v[8], v[9]],
            depth: v[10],
            half_height: v[11],
            rightmost_dy: v[12],
            inverse_sa: v[13],
            depth_slope: [v[14], v[15]],
        }
    }

    /// The inverse of [`Self::from_values`].
    #[inline(always)]
    pub(crate) fn values(&self) -> [f32; 16] {
        let ([r, g, b], [depth_x, depth_y]) = (self.color, self.depth_slope);
        [
            self.x,
            self.y,
            self.sa,
            self.sb,
            self.sd,
            self.level,
            self.threshold,
            r,
            g,
            b,
            self.depth,
            self.half_height,
            self.rightmost_dy,
            self.inverse_sa,
            depth_x,
            depth_y,
        ]
    }

    /// From center, covariance (xx, xy, yy, px²), `schur = (xx yy - xy²) / yy` found without that
    /// difference, and opacity, with the half width of its bounding box; `None` when nothing of it
    /// can be seen or it is not an ellipse (also for NaN). One Gaussian at a time, for tests.
    #[cfg(test)]
    pub(crate) fn new(
        [x, y]: [f32; 2],
        [xx, xy, yy]: [f32; 3],
        schur: f32,
        opacity: f32,
        cutoffs: &Cutoffs,
    ) -> Option<(Self, f32)> {
        if !(schur > 0.0 && schur < f32::MAX && yy > 0.0 && opacity > cutoffs.alpha_min) {
            return None;
        }
        let scale = MAHALANOBIS.recip();
        let (sa, sd) = ((scale / schur).sqrt(), (scale / yy).sqrt());
        let (sb, inverse_sa) = (-sa * (xy / yy), sa.recip());
        let level = opacity.log2() / 8.0;
        let threshold = cutoffs.level_min.max(level - cutoffs.extent);
        let reach = level - threshold;
        let half_width = (reach * xx / scale).sqrt();
        let half_height = (reach * yy / scale).sqrt();
        let finite = |value: f32| value > 0.0 && value < f32::MAX;
        if ![half_width, half_height, inverse_sa, sd].map(finite).iter().all(|&ok| ok) {
            return None;
        }
        let rightmost_dy = half_width * (xy / xx);
        let splat = Self {
            x,
            y,
            sa,
            sb,
            sd,
            level,
            threshold,
            half_height,
            rightmost_dy,
            inverse_sa,
            ..Self::INVISIBLE
        };
        Some((splat, half_width))
    }

    /// `sb / sa`: how far the middle of a row moves against dx as dy grows.
    #[inline(always)]
    pub(crate) fn shear(&self) -> f32 {
        self.sb * self.inverse_sa
    }

    /// [`Self::new`] with the determinant taken as it stands, and visible.
    #[cfg(test)]
    pub(crate) fn from_covariance(
        center: [f32; 2],
        covariance: [f32; 3],
        opacity: f32,
    ) -> Option<(Self, f32)> {
        let [xx, xy, yy] = covariance;
        let cutoffs = Cutoffs::new(&RenderOptions::default());
        Self::new(center, covariance, (xx * yy - xy * xy) / yy, opacity, &cutoffs)
    }

    pub(crate) fn is_visible(&self) -> bool {
        self.half_height > 0.0
    }

    /// Range of dx over rows `dy_min..=dy_max` (relative to the center); `None` when the band
    /// misses the ellipse. The lists compute the same in lanes.
    #[cfg(test)]
    pub(crate) fn band(&self, dy_min: f32, dy_max: f32) -> Option<(f32, f32)> {
        let low = dy_min.max(-self.half_height);
        let high = dy_max.min(self.half_height);
        if !(low <= high + SLACK) {
            return None;
        }
        // The right edge is a concave function of dy, so it is largest as near as the band comes
        // to the rightmost point; likewise on the left.
        let k = self.level - self.threshold;
        let (slope, inverse_sa) = (-self.shear(), self.inverse_sa);
        let d_right = self.rightmost_dy.max(low).min(high);
        let d_left = (-self.rightmost_dy).max(low).min(high);
        let (right, left) = (d_right * self.sd, d_left * self.sd);
        Some((
            slope * d_left - inverse_sa * (k - left * left).max(0.0).sqrt() - SLACK,
            slope * d_right + inverse_sa * (k - right * right).max(0.0).sqrt() + SLACK,
        ))
    }

    /// Alpha at a pixel, `None` below the cut-offs: the kernels' decision for one pixel.
    pub(crate) fn alpha_at(&self, x: f32, y: f32, exp_degree: usize) -> Option<f32> {
        let (dx, dy) = (x - self.x, y - self.y);
        let (e, d) = (self.sa * dx + self.sb * dy, self.sd * dy);
        let depth = e * e + (d * d - self.level);
        if !(depth <= -self.threshold) {
            return None;
        }
        Some(crate::exp2::exp2_minus_8_scalar(exp_degree, depth).min(ALPHA_MAX))
    }

    /// Depth of the densest point on the ray through a pixel, by linear extrapolation from the
    /// center that stops at the edge of the ellipse's bounding box.
    pub(crate) fn depth_at(&self, x: f32, y: f32) -> f32 {
        let half_width = self.inverse_sa * (self.level - self.threshold).sqrt()
            + (self.shear() * self.half_height).abs();
        let dx = (x - self.x).clamp(-half_width, half_width);
        let dy = (y - self.y).clamp(-self.half_height, self.half_height);
        let depth = self.depth + self.depth_slope[0] * dx + self.depth_slope[1] * dy;
        // Never in front of the camera's plane: keys must stay positive.
        depth.max(1e-3 * self.depth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_the_ellipse_tightly() {
        for (xx, xy, yy, opacity) in [
            (9.0, 0.0, 9.0, 0.5f32),
            (20.0, 12.0, 9.0, 0.9),
            (2.0, -1.9, 5.0, 0.3),
            (4000.0, 390.0, 60.0, 0.99),
        ] {
            let (splat, half_width) =
                Splat::from_covariance([0.0, 0.0], [xx, xy, yy], opacity).unwrap();
            let inside = |x: f32, y: f32| splat.alpha_at(x, y, 5).is_some();
            let size = half_width.max(splat.half_height) * 1.2;
            let steps = 200;
            for band in 0..20 {
                let dy_min = -size + band as f32 * size / 10.0;
                let dy_max = dy_min + size / 10.0;
                let (mut left, mut right) = (f32::MAX, f32::MIN);
                for i in 0..=steps {
                    let dy = dy_min + (dy_max - dy_min) * i as f32 / steps as f32;
                    for j in 0..=2 * steps {
                        let dx = size * (j as f32 / steps as f32 - 1.0);
                        if inside(dx, dy) {
                            left = left.min(dx);
                            right = right.max(dx);
                        }
                    }
                }
                match splat.band(dy_min, dy_max) {
                    Some((l, r)) if left <= right => {
                        let tolerance = 2.0 * SLACK + 2.0 * size / steps as f32;
                        assert!(l <= left && left - l < tolerance, "left {l} {left}");
                        assert!(r >= right && r - right < tolerance, "right {r} {right}");
                    }
                    Some((l, r)) => assert!(r - l < 0.2 * size, "band barely touches: {l} {r}"),
                    None => assert!(left > right, "band {dy_min}..{dy_max} has pixels"),
                }
            }
        }
    }

    #[test]
    fn alpha_is_that_of_the_covariance() {
        let (xx, xy, yy, opacity) = (20.0f32, 12.0, 9.0, 0.8f32);
        let (splat, _) = Splat::from_covariance([3.0, -2.0], [xx, xy, yy], opacity).unwrap();
        for (dx, dy) in [(0.0f32, 0.0f32), (3.0, 1.0), (-2.0, 2.5), (5.0, 4.0)] {
            let det = xx * yy - xy * xy;
            let q = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / det;
            let got = splat.alpha_at(3.0 + dx, -2.0 + dy, 5).unwrap();
            let expected = opacity * (-0.5 * q).exp();
            assert!((got / expected - 1.0).abs() < 1e-5, "{dx} {dy}: {got} {expected}");
        }
    }

    #[test]
    fn degenerate_input_is_invisible() {
        let new = |covariance, opacity| Splat::from_covariance([0.0; 2], covariance, opacity);
        assert!(new([1.0, 1.0, 1.0], 0.5).is_none());
        assert!(new([1.0, 0.0, 1.0], 0.001).is_none());
        assert!(new([f32::NAN, 0.0, 1.0], 0.5).is_none());
        assert!(new([1e30, 0.0, 1e30], 0.5).is_none());
        assert!(new([1.0, 0.0, 1.0], f32::NAN).is_none());
        assert!(new([1.0, 0.0, 1.0], 0.5).is_some());
    }
}
