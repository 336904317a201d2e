//! What moved between the pictures of a series.
//!
//! A pixel of another picture is consistent with the reference when its log radiance is the same within noise, or when the reference is
//! black or saturated there and the other one is on the side that this implies. Where most of a neighborhood is inconsistent, the
//! picture is left out of the mean (after Grosch 2006, "Fast and robust high dynamic range image generation with camera and object
//! movement").

use super::{Exposed, Response, hat};

/// Difference of ln E that noise and errors of the response explain, at full weight; more where a value weighs little.
const TOLERANCE: f64 = 0.2;
/// A value that weighs less says little more than on which side it is.
const LEAST_WEIGHT: f32 = 0.08;
/// Half the side of the neighborhood, pixels.
const REACH: usize = 2;
/// Share of inconsistent pixels from which a neighborhood moved.
const MAJORITY: f32 = 0.4;

/// For every pixel, whether picture `other` shows something else than picture `reference`.
pub(super) fn moved(
    series: &[Exposed],
    reference: usize,
    other: usize,
    response: &Response,
) -> Vec<bool> {
    let (a, b) = (&series[reference], &series[other]);
    let (w, h) = (a.image.width, a.image.height);
    let raw: Vec<f32> = (0..w * h)
        .map(|i| {
            let differs = (0..3).any(|c| !is_consistent(a, b, i, c, response));
            f32::from(u8::from(differs))
        })
        .collect();
    // Two passes of a box.
    let blurred = blur(&blur(&raw, w, h, false), w, h, true);
    blurred.iter().map(|share| *share > MAJORITY).collect()
}

fn is_consistent(a: &Exposed, b: &Exposed, pixel: usize, c: usize, response: &Response) -> bool {
    let log = |e: &Exposed| {
        let v = e.image.data[pixel * e.image.channels + c];
        (v, response.log_exposure(c, v) - e.stops * std::f64::consts::LN_2)
    };
    let ((va, ea), (vb, eb)) = (log(a), log(b));
    let (wa, wb) = (hat(va), hat(vb));
    let tolerance = TOLERANCE / f64::from(wa.min(wb).max(LEAST_WEIGHT)).sqrt();
    // The true ln E lies above what a saturated value says, and below what a black one says.
    let high = |v: f32, w: f32| w < LEAST_WEIGHT && v > 0.5;
    let low = |v: f32, w: f32| w < LEAST_WEIGHT && v <= 0.5;
    let a_may_exceed = high(va, wa) || low(vb, wb);
    let b_may_exceed = high(vb, wb) || low(va, wa);
    let difference = eb - ea;
    if a_may_exceed && b_may_exceed {
        return true;
    }
    (difference <= tolerance || a_may_exceed) && (difference >= -tolerance || b_may_exceed)
}

fn blur(values: &[f32], w: usize, h: usize, down: bool) -> Vec<f32> {
    let mean = |i: usize| {
        let (x, y) = (i % w, i / w);
        let (at, n) = if down { (y, h) } else { (x, w) };
        let range = at.saturating_sub(REACH)..(at + REACH + 1).min(n);
        let count = range.len() as f32;
        range.map(|k| if down { values[k * w + x] } else { values[y * w + k] }).sum::<f32>() / count
    };
    (0..w * h).map(mean).collect()
}
