//! From scene-linear light to the values of an 8-bit picture.
//!
//! `Srgb` clips and applies the sRGB curve. `Standard` adds the tone curve of the camera, so that a linear value is shown as a photo shows
//! it. `Agx` is a film-like curve after the published
//! description of AgX (Troy Sobotka): light is expressed in wider primaries, so that strong colors carry some of all channels and go to
//! white as they get brighter; each channel goes through a sigmoid of its logarithm; then most of the widening is taken back.

use glam::{DMat3, DVec2, DVec3, Mat3, Vec3};
use motes_math::srgb;
use motes_math::tone_curve::ToneCurve;

use crate::options::ViewTransform;

/// How far the working primaries of AgX lie outside of Rec. 709, and how much of it is taken back.
const INSET: f64 = 0.2;
const OUTSET: f64 = 0.14;
/// Stops below and above middle gray between black and white.
const STOPS: (f32, f32) = (10.0, 6.5);
/// Middle gray keeps its value, and about the slope that the sRGB curve has there.
const MIDDLE_GRAY: f32 = 0.18;
const SLOPE: f32 = 2.4;
/// How abruptly the sigmoid bends.
const BEND: f32 = 1.5;

/// A view transform, ready for pixels.
#[derive(Clone, Copy, Debug)]
pub struct View {
    agx: Option<(Mat3, Mat3)>,
    /// Of the camera.
    curve: ToneCurve,
}

impl ViewTransform {
    /// Prepares it for a scene whose photos have this tone curve.
    pub fn view(self, tone_curve: ToneCurve) -> View {
        let agx = (self == Self::Agx).then(|| {
            let inset = inset(INSET).as_mat3();
            (inset, inset_inverse(OUTSET))
        });
        let curve = if self == Self::Standard { tone_curve } else { ToneCurve::default() };
        View { agx, curve }
    }
}

impl View {
    /// The linear value that is shown as `encoded`, without AgX.
    pub fn decode(&self, encoded: f32) -> f32 {
        srgb::decode(self.curve.invert(encoded))
    }

    /// sRGB-encoded values, 0 to 1, of linear Rec. 709 light; NaN becomes 0.
    pub fn encode(&self, linear: Vec3) -> [f32; 3] {
        let Some((inset, outset)) = self.agx else {
            return linear.to_array().map(|v| self.curve.apply(srgb::encode(clean(v))));
        };
        let wide = inset * Vec3::from(linear.to_array().map(|v| if v.is_nan() { 0.0 } else { v }));
        let curved = Vec3::from(wide.to_array().map(|v| srgb::decode(sigmoid(v))));
        (outset * curved).to_array().map(|v| srgb::encode(clean(v)))
    }
}

fn clean(v: f32) -> f32 {
    if v.is_nan() { 0.0 } else { v.clamp(0.0, 1.0) }
}

/// Display value, 0 to 1, of a linear one: straight in the logarithm about middle gray, and bent so that it meets black and white at
/// the ends of the range. With `d` the straight line's distance from the pivot and `b` what the end allows, the distance is
/// `(d^-p + s^-p)^(-1/p)`, `s^-p = b^-p - d_end^-p`.
fn sigmoid(linear: f32) -> f32 {
    let range = STOPS.0 + STOPS.1;
    let pivot = STOPS.0 / range;
    let middle = srgb::encode(MIDDLE_GRAY);
    let stops = (linear.max(1e-12) / MIDDLE_GRAY).log2().clamp(-STOPS.0, STOPS.1);
    let x = (stops + STOPS.0) / range;
    let (distance, end, room, sign) = if x >= pivot {
        (SLOPE * (x - pivot), SLOPE * (1.0 - pivot), 1.0 - middle, 1.0)
    } else {
        (SLOPE * (pivot - x), SLOPE * pivot, middle, -1.0)
    };
    if distance < 1e-6 {
        return middle;
    }
    let s = room.powf(-BEND) - end.powf(-BEND);
    middle + sign * (distance.powf(-BEND) + s).powf(-1.0 / BEND)
}

/// Rec. 709 values in primaries that lie further from the white point by `1 / (1 - share)`.
fn inset(share: f64) -> DMat3 {
    xyz_from_rgb(1.0 / (1.0 - share)).inverse() * xyz_from_rgb(1.0)
}

fn inset_inverse(share: f64) -> Mat3 {
    inset(share).inverse().as_mat3()
}

/// Of Rec. 709's primaries, `spread` times as far from D65; white is 1, 1, 1.
fn xyz_from_rgb(spread: f64) -> DMat3 {
    let white = DVec2::new(0.3127, 0.3290);
    let xyz = |xy: DVec2| DVec3::new(xy.x, xy.y, 1.0 - xy.x - xy.y);
    let primaries = [DVec2::new(0.64, 0.33), DVec2::new(0.30, 0.60), DVec2::new(0.15, 0.06)];
    let [r, g, b] = primaries.map(|p| xyz(white + (p - white) * spread));
    let columns = DMat3::from_cols(r, g, b);
    let scales = columns.inverse() * (xyz(white) / white.y);
    DMat3::from_cols(r * scales.x, g * scales.y, b * scales.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tone_curve_of_the_camera_is_put_on_once() {
        let curve = ToneCurve::new(0.5);
        let gray =
            |transform: ViewTransform, v: f32| transform.view(curve).encode(Vec3::splat(v))[0];
        for v in [0.01, 0.18, 0.7] {
            let encoded = srgb::encode(v);
            assert_eq!(gray(ViewTransform::Srgb, v), encoded);
            assert_eq!(gray(ViewTransform::Standard, v), curve.apply(encoded));
            let agx = ViewTransform::Agx.view(ToneCurve::default()).encode(Vec3::splat(v))[0];
            assert_eq!(gray(ViewTransform::Agx, v), agx);
            let back = ViewTransform::Standard.view(curve).decode(gray(ViewTransform::Standard, v));
            assert!((back - v).abs() < 1e-5, "{back} {v}");
        }
        assert_eq!(gray(ViewTransform::Standard, 9.0), 1.0);
    }

    #[test]
    fn standard_is_the_srgb_curve() {
        let view = ViewTransform::Standard.view(ToneCurve::default());
        let c = view.encode(Vec3::new(0.18, 2.0, f32::NAN));
        assert!((c[0] - srgb::encode(0.18)).abs() + (c[1] - 1.0).abs() + c[2] < 1e-6, "{c:?}");
    }

    #[test]
    fn agx_keeps_gray_gray_rises_and_never_leaves_the_picture() {
        let view = ViewTransform::Agx.view(ToneCurve::default());
        let gray = |v: f32| {
            let [r, g, b] = view.encode(Vec3::splat(v));
            assert!((r - g).abs() < 2e-3 && (g - b).abs() < 2e-3, "{v}: {r} {g} {b}");
            g
        };
        assert!((gray(0.18) - srgb::encode(0.18)).abs() < 2e-3);
        assert!(gray(0.0) < 5e-3 && gray(16.3) > 0.995 && gray(1.0) < 0.9);
        let mut last = -1.0;
        for i in 0..100 {
            let v = gray(0.18 * 2f32.powf(-10.0 + 0.165 * i as f32));
            assert!(v > last, "{i}");
            last = v;
        }
        for extreme in [f32::INFINITY, 1e30, -1.0, f32::NAN, 1e-30] {
            for c in [Vec3::splat(extreme), Vec3::new(extreme, 0.1, 0.0)] {
                assert!(view.encode(c).iter().all(|v| (0.0..=1.0).contains(v)), "{c}");
            }
        }
    }

    #[test]
    fn strong_colors_go_to_white_as_they_get_brighter() {
        let view = ViewTransform::Agx.view(ToneCurve::default());
        let spread = |v: f32| {
            let c = view.encode(Vec3::new(v, 0.25 * v, 0.05 * v));
            c[0] - c[2]
        };
        assert!(
            spread(0.4) > 0.3 && spread(8.0) < 0.6 * spread(0.6),
            "{} {}",
            spread(0.6),
            spread(8.0)
        );
        // An orange highlight stays orange in order, where clipping makes it yellow.
        let [r, g, b] = view.encode(Vec3::new(4.0, 1.5, 0.4));
        assert!(r > g && g > b && r < 1.0, "{r} {g} {b}");
    }
}
