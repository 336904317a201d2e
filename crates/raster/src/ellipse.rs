//! Where a projected Gaussian is brighter than the cut-off: an ellipse, and its exact overlap
//! with bands of rows. Tiles and 4×4 pixel blocks are chosen by the same function.

/// The region `d Σ'⁻¹ d <= radius²` around a centre.
///
/// With `Σ' = [xx xy; xy yy]` and `schur = det / yy` (the variance of dx once dy is known),
/// `d Σ'⁻¹ d = (dx + r dy)² / schur + dy² / yy`, `r = -xy / yy`. Nothing here subtracts nearly
/// equal numbers, so a needle a thousand pixels long keeps its digits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ellipse {
    /// `r`
    pub(crate) shear: f32,
    /// `radius² schur`
    pub(crate) reach2: f32,
    /// `schur / yy`
    pub(crate) aspect: f32,
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
        shear: 0.0,
        reach2: 0.0,
        aspect: 0.0,
        half_width: 0.0,
        half_height: 0.0,
        rightmost_dy: 0.0,
    };

    /// `None` when the ellipse is empty or not an ellipse (also for NaN).
    #[inline]
    pub(crate) fn new([xx, xy, yy]: [f32; 3], schur: f32, radius2: f32) -> Option<Self> {
        if !(radius2 > 0.0 && schur > 0.0 && xx > 0.0 && yy > 0.0) {
            return None;
        }
        let half_width = (radius2 * xx).sqrt();
        let half_height = (radius2 * yy).sqrt();
        if !(half_width < f32::MAX && half_height < f32::MAX && schur < f32::MAX) {
            return None;
        }
        Some(Self {
            shear: -xy / yy,
            reach2: radius2 * schur,
            aspect: schur / yy,
            half_width,
            half_height,
            rightmost_dy: xy / xx * half_width,
        })
    }

    /// The region `a dx² + 2 b dx dy + c dy² <= k`.
    #[cfg(test)]
    pub(crate) fn from_conic(a: f32, b: f32, c: f32, k: f32) -> Option<Self> {
        let det = a * c - b * b;
        Self::new([c / det, -b / det, a / det], 1.0 / a, k).filter(|_| det > 0.0)
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
        let reach = |dy: f32| (self.reach2 - self.aspect * dy * dy).max(0.0).sqrt();
        let dy_right = self.rightmost_dy.max(low).min(high);
        let dy_left = (-self.rightmost_dy).max(low).min(high);
        Some((
            -self.shear * dy_left - reach(dy_left) - SLACK,
            -self.shear * dy_right + reach(dy_right) + SLACK,
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
            let ellipse = Ellipse::from_conic(a, b, c, k).unwrap();
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
        assert!(Ellipse::from_conic(1.0, 1.0, 1.0, 1.0).is_none());
        assert!(Ellipse::from_conic(1.0, 0.0, 1.0, 0.0).is_none());
        assert!(Ellipse::from_conic(f32::NAN, 0.0, 1.0, 1.0).is_none());
        assert!(Ellipse::from_conic(1e-39, 0.0, 1e-39, 1e38).is_none());
    }
}
