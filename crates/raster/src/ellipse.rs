//! Where a projected Gaussian is brighter than the cut-off: an ellipse, and its exact overlap
//! with bands of rows. Tiles and 4×4 pixel blocks are chosen by the same function.

/// The region `a dx² + 2 b dx dy + c dy² <= k` around a centre, `a c > b²`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ellipse {
    pub(crate) b_over_a: f32,
    /// `k / a`
    pub(crate) k_over_a: f32,
    /// `det / a²`
    pub(crate) det_over_a2: f32,
    /// Half width and half height of the bounding box.
    pub(crate) half_width: f32,
    pub(crate) half_height: f32,
    /// dy of the rightmost point; the leftmost one is at its negative.
    pub(crate) rightmost_dy: f32,
}

/// Slack of every bound, pixels: rounding must never drop a pixel that the kernel would keep.
pub(crate) const SLACK: f32 = 0.01;

impl Ellipse {
    /// Touches nothing.
    pub(crate) const EMPTY: Self = Self {
        b_over_a: 0.0,
        k_over_a: 0.0,
        det_over_a2: 0.0,
        half_width: 0.0,
        half_height: 0.0,
        rightmost_dy: 0.0,
    };

    /// `None` when the ellipse is empty or not an ellipse (also for NaN).
    #[inline]
    pub(crate) fn new(a: f32, b: f32, c: f32, k: f32) -> Option<Self> {
        let det = a * c - b * b;
        if !(k > 0.0 && a > 0.0 && det > 0.0) {
            return None;
        }
        let half_width = (k * c / det).sqrt();
        let half_height = (k * a / det).sqrt();
        if !(half_width < f32::MAX && half_height < f32::MAX) {
            return None;
        }
        Some(Self {
            b_over_a: b / a,
            k_over_a: k / a,
            det_over_a2: det / (a * a),
            half_width,
            half_height,
            rightmost_dy: -b * half_width / c,
        })
    }

    /// Range of dx over rows `dy_min..=dy_max` (relative to the centre); `None` when the band
    /// misses the ellipse.
    #[inline]
    pub(crate) fn band(&self, dy_min: f32, dy_max: f32) -> Option<(f32, f32)> {
        let low = dy_min.max(-self.half_height);
        let high = dy_max.min(self.half_height);
        if !(low <= high + SLACK) {
            return None;
        }
        // The right edge is a concave function of dy, so it is largest as near as the band comes
        // to the rightmost point; likewise on the left.
        let reach = |dy: f32| (self.k_over_a - self.det_over_a2 * dy * dy).max(0.0).sqrt();
        let dy_right = self.rightmost_dy.max(low).min(high);
        let dy_left = (-self.rightmost_dy).max(low).min(high);
        Some((
            -self.b_over_a * dy_left - reach(dy_left) - SLACK,
            -self.b_over_a * dy_right + reach(dy_right) + SLACK,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_the_ellipse_tightly() {
        for (a, b, c, k) in [
            (0.5, 0.0, 0.5, 4.0),
            (0.3, 0.2, 0.4, 5.0),
            (2.0, -0.9, 0.5, 7.0),
            (1e-3, 1e-4, 1e-3, 6.0),
        ] {
            let ellipse = Ellipse::new(a, b, c, k).unwrap();
            let inside = |dx: f32, dy: f32| a * dx * dx + 2.0 * b * dx * dy + c * dy * dy <= k;
            let size = ellipse.half_width.max(ellipse.half_height) * 1.2;
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
                match ellipse.band(dy_min, dy_max) {
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
    fn degenerate_input_is_empty() {
        assert!(Ellipse::new(1.0, 1.0, 1.0, 1.0).is_none());
        assert!(Ellipse::new(1.0, 0.0, 1.0, 0.0).is_none());
        assert!(Ellipse::new(f32::NAN, 0.0, 1.0, 1.0).is_none());
        assert!(Ellipse::new(1e-39, 0.0, 1e-39, 1e38).is_none());
    }
}
