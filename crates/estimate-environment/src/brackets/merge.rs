//! The mean of a series in log radiance (Debevec & Malik 1997, eq. 6):
//!
//! ```text
//! ln E = Σ_j w(Z_j) (g(Z_j) - ln t_j) / Σ_j w(Z_j)
//! ```
//!
//! The result is in units of the reference exposure: `value = E t_reference`, scaled so that a mid-gray value (128 of 255, which
//! sRGB decodes to 0.2158) of the reference keeps the value that it shows.

use motes_math::srgb;
use motes_scene::ImageF32;

use super::{BracketError, Exposed, Response, check, ghosts, hat, reference};

/// Values above are saturated, below black, in all pictures: the mean has no weight there.
const NO_WEIGHT: f64 = 1e-3;
/// Value from which a picture is saturated.
const SATURATED: f32 = 0.985;

/// How a series becomes one picture.
#[derive(Clone, Copy, Debug)]
pub struct MergeOptions {
    /// Leave out of each picture what contradicts the reference.
    pub deghost: bool,
}

impl Default for MergeOptions {
    fn default() -> Self {
        Self { deghost: true }
    }
}

/// Radiance of a series.
#[derive(Clone, Debug)]
pub struct Merged {
    /// Linear RGB.
    pub radiance: ImageF32,
    /// Whether a channel of the pixel is saturated in the shortest picture that counts there: its value is a lower bound.
    pub clipped: Vec<bool>,
    /// Share of the pixels of the other pictures that moved.
    pub ghosts: f64,
    /// Index of the reference.
    pub reference: usize,
}

/// Merges a series.
///
/// # Errors
/// The pictures are no series.
pub fn merge(
    series: &[Exposed],
    response: &Response,
    options: &MergeOptions,
) -> Result<Merged, BracketError> {
    check(series)?;
    let reference = reference(series);
    let (w, h) = (series[0].image.width, series[0].image.height);
    let ghost: Vec<Option<Vec<bool>>> = (0..series.len())
        .map(|j| {
            let compares = options.deghost && j != reference;
            compares.then(|| ghosts::moved(series, reference, j, response))
        })
        .collect();
    let mut order: Vec<usize> = (0..series.len()).collect();
    order.sort_by(|a, b| series[*a].stops.total_cmp(&series[*b].stops));
    // Only the reference of a linear series is in its own units already.
    let gray = match response {
        Response::Linear => 1.0,
        Response::Curve(_) => srgb::decode_f64(128.0 / 255.0),
    };
    let gain = gray * series[reference].stops.exp2();
    let mut radiance = ImageF32::filled(w, h, 3, 0.0);
    let mut clipped = vec![false; w * h];
    for i in 0..w * h {
        let counts = |j: &usize| ghost[*j].as_ref().is_none_or(|moved| !moved[i]);
        let valid: Vec<usize> = order.iter().copied().filter(counts).collect();
        for c in 0..3 {
            let (log, saturated) = log_radiance(series, &valid, response, i, c);
            radiance.data[3 * i + c] = (gain * log.exp()) as f32;
            clipped[i] |= saturated;
        }
    }
    let moved: usize = ghost.iter().flatten().map(|g| g.iter().filter(|m| **m).count()).sum();
    let ghosts = moved as f64 / ((series.len() - 1) * w * h) as f64;
    Ok(Merged { radiance, clipped, ghosts, reference })
}

/// ln E of a pixel, and whether all that is known is a lower bound. `valid` goes from dark to bright pictures.
fn log_radiance(
    series: &[Exposed],
    valid: &[usize],
    response: &Response,
    pixel: usize,
    c: usize,
) -> (f64, bool) {
    let value = |j: usize| series[j].image.data[pixel * series[j].image.channels + c];
    let log =
        |j: usize| response.log_exposure(c, value(j)) - series[j].stops * std::f64::consts::LN_2;
    let (mut sum, mut total) = (0.0, 0.0);
    for &j in valid {
        let w = f64::from(hat(value(j)));
        sum += w * log(j);
        total += w;
    }
    let (darkest, brightest) = (valid[0], valid[valid.len() - 1]);
    let saturated = value(darkest) >= SATURATED;
    if total > NO_WEIGHT && !saturated {
        return (sum / total, false);
    }
    // All saturated: at least what the shortest says. All black: at most what the longest says.
    (log(if value(darkest) > 0.5 { darkest } else { brightest }), saturated)
}
