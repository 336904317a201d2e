//! Tearing of relit pictures, without a reference.
//!
//! The ratio of a relit to the captured picture has no texture left: on a smooth surface it changes as slowly as shading does, but
//! for the edges of shadows. What changes faster is torn:
//!
//! ```text
//! l = log (relit + b) - log (captured + b)                    b: 2 % of white; luminance, linear
//! h = l - (G * m l) / (G * m)                                 m: pixels smooth in the splat's depth; G: Gaussian of 1/100 of the width
//! tearing = mean over m of min(|h|, 1)
//! ```
//!
//! A pixel is smooth where second differences of depth over two pixels, both ways, stay below 0.4 % of it, in all pixels within two of it;
//! that is for pictures 480 pixels wide, and grows with the square of the angle of a pixel, as the bend of a curved surface does.

use motes_math::luminance::luminance;
use motes_math::srgb;
use motes_scene::ImageU8;

/// Linear photo value below which ratios are noise.
const BLACK: f32 = 0.02;
/// Standard deviation of the low pass over the width of the picture.
const BLUR_SHARE: f32 = 0.01;
/// Second difference of depth over depth, in pictures as wide as this.
const BEND: (f32, f32) = (0.004, 480.0);
/// Pixels that differences of depth reach.
const REACH: usize = 2;

/// Tearing of `relit` against `captured` where `depth` (`[h, w]`, 0 for nothing) is smooth, and the share of such pixels; none
/// without one.
///
/// # Panics
/// When the sizes differ.
pub fn tearing(captured: &ImageU8, relit: &ImageU8, depth: &[f32]) -> Option<(f64, f64)> {
    let (w, h) = (captured.width, captured.height);
    assert_eq!((relit.width, relit.height, depth.len()), (w, h, w * h), "one size");
    let mask = smooth(depth, w, h);
    let log = |image: &ImageU8, i: usize| {
        let c = &image.data[image.channels * i..];
        let linear = [c[0], c[1], c[2]].map(|v| srgb::decode(f32::from(v) / 255.0));
        (luminance(linear) + BLACK).ln()
    };
    let ratio: Vec<f32> = (0..w * h)
        .map(|i| if mask[i] > 0.0 { log(relit, i) - log(captured, i) } else { 0.0 })
        .collect();
    let sigma = (BLUR_SHARE * w as f32).max(1.0);
    let (sum, weight) = (blurred(&ratio, w, sigma), blurred(&mask, w, sigma));
    let inside = (0..w * h).filter(|i| mask[*i] > 0.0);
    let high = inside.map(|i| f64::from((ratio[i] - sum[i] / weight[i]).abs().min(1.0)));
    let (total, count) = high.fold((0.0, 0usize), |(sum, n), v| (sum + v, n + 1));
    (count > 0).then(|| (total / count as f64, count as f64 / (w * h) as f64))
}

/// 1 where the depth is smooth.
fn smooth(depth: &[f32], w: usize, h: usize) -> Vec<f32> {
    let most = BEND.0 * (BEND.1 / w as f32).powi(2);
    let is_smooth = |x: usize, y: usize| {
        if x < REACH || y < REACH || x + REACH >= w || y + REACH >= h {
            return false;
        }
        let i = y * w + x;
        let bend = |step: usize| {
            let (a, b) = (depth[i - step], depth[i + step]);
            a > 0.0 && b > 0.0 && (a + b - 2.0 * depth[i]).abs() < most * depth[i]
        };
        bend(REACH) && bend(REACH * w)
    };
    let first: Vec<bool> = (0..w * h).map(|i| is_smooth(i % w, i / w)).collect();
    let all = |i: usize| {
        let (x, y) = (i % w, i / w);
        let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(h);
        let columns = x.saturating_sub(REACH)..(x + REACH + 1).min(w);
        rows.flat_map(|y| columns.clone().map(move |x| y * w + x)).all(|k| first[k])
    };
    (0..w * h).map(|i| if all(i) { 1.0 } else { 0.0 }).collect()
}

/// Gaussian blur of a picture of `w` columns, nothing beyond its border.
fn blurred(values: &[f32], w: usize, sigma: f32) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil() as isize;
    let kernel: Vec<f32> =
        (-reach..=reach).map(|d| (-0.5 * (d as f32 / sigma).powi(2)).exp()).collect();
    let h = values.len() / w.max(1);
    let pass = |from: &[f32], across: bool| -> Vec<f32> {
        let at = |i: usize| {
            let (x, y) = ((i % w) as isize, (i / w) as isize);
            let (place, length) = if across { (x, w as isize) } else { (y, h as isize) };
            let taps = (-reach..=reach).zip(&kernel);
            let inside = taps.filter(|(d, _)| (0..length).contains(&(place + d)));
            let step = if across { 1 } else { w as isize };
            inside.map(|(d, k)| k * from[(i as isize + d * step) as usize]).sum()
        };
        (0..from.len()).map(at).collect()
    };
    pass(&pass(values, true), false)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (96, 72);

    fn picture(at: impl Fn(usize, usize) -> f32) -> ImageU8 {
        let (w, h) = SIZE;
        let value = |i: usize| (255.0 * srgb::encode_clipped(at(i % w, i / w))).round() as u8;
        ImageU8::from_data(w, h, 3, (0..3 * w * h).map(|k| value(k / 3)).collect())
    }

    fn texture(x: usize, y: usize) -> f32 {
        0.15 + 0.35 * ((x * 7 + y * 13) % 11) as f32 / 11.0
    }

    #[test]
    fn smooth_light_over_texture_is_whole_and_shards_are_torn() {
        let depth = vec![2.0; SIZE.0 * SIZE.1];
        let captured = picture(texture);
        let slope = |x: usize| 0.5 + x as f32 / 96.0;
        let whole = picture(|x, y| texture(x, y) * slope(x));
        let shard = |x: usize, y: usize| {
            if (x / 5 * 31 + y / 4 * 17).is_multiple_of(3) { 0.4 } else { 1.0 }
        };
        let torn = picture(|x, y| texture(x, y) * slope(x) * shard(x, y));
        let of = |relit: &ImageU8| tearing(&captured, relit, &depth).unwrap().0;
        assert!(of(&whole) < 0.02, "{}", of(&whole));
        assert!(of(&torn) > 0.15, "{}", of(&torn));
        // The edge of one shadow is not a tear.
        let shadow = picture(|x, y| texture(x, y) * if x < 50 { 0.3 } else { 1.0 });
        assert!(of(&shadow) < 0.05, "{}", of(&shadow));
    }

    #[test]
    fn only_smooth_depth_counts() {
        let (w, h) = SIZE;
        let step: Vec<f32> = (0..w * h).map(|i| if i % w < 48 { 2.0 } else { 3.0 }).collect();
        let captured = picture(texture);
        let (_, share) = tearing(&captured, &captured, &step).unwrap();
        assert!(share > 0.7 && share < 0.9, "{share}");
        assert_eq!(tearing(&captured, &captured, &vec![0.0; w * h]), None);
        assert_eq!(tearing(&captured, &captured, &vec![f32::NAN; w * h]), None);
    }
}
