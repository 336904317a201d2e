//! How the photos' brightness follows the exposure that their metadata names.
//!
//! A model that fits an exposure per training photo cannot know that of a photo it never saw, and a
//! held-out photo's pixels must not be used. Its metadata may: exposure time, ISO speed and f-number
//! say how bright the camera was set. The brightness `b` of point `p` in photo `i` (log of the mean
//! sRGB-encoded value around it) is `surface_p + g_i`; both minimize the sum of Huber losses over the
//! training photos, which stands shadows, occluders and highlights. (Medians in turn would stand them
//! too, but stop where no single value can be improved alone, with the gains of photos that share few
//! points too small.) Then `g = slope (stops - reference) + constant` is fitted by least squares, and
//! kept when it explains the gains better than no response by more than its cost (Schwarz 1978, the
//! Bayesian information criterion).

use motes_math::additive_fit::{AdditiveFit, Entry};
use motes_math::median::median;
use motes_scene::{ExposureResponse, ImageU8};

/// Half side of the square that is averaged around a point, share of the long side: wide enough for
/// a keypoint's scatter and for grain, narrow enough for one surface.
const HALF_SIDE: f64 = 0.005;
/// Encoded values beyond these are clipped or mostly noise.
const USABLE: [f64; 2] = [0.08, 0.95];
/// Alternations; the gains of 20 photos settle to 1e-3 within 100.
const ROUNDS: usize = 200;
/// Residuals of log brightness beyond this count linearly: about the median of those between photos of
/// bark and ground taken by hand.
const HUBER: f64 = 0.05;
/// A photo with fewer points says nothing about its gain.
const MIN_POINTS: usize = 20;
/// Fewer photos make no trend.
const MIN_PHOTOS: usize = 5;
/// Metadata is coarse: below this spread (stops) it holds nothing but rounding.
const MIN_SPREAD_STOPS: f64 = 0.05;

/// Log of the mean encoded value around a pixel; `None` where it is clipped, dark or outside.
pub(crate) fn log_brightness(image: &ImageU8, [x, y]: [f64; 2]) -> Option<f64> {
    let (width, height) = (image.width as f64, image.height as f64);
    if !(x >= 0.0 && y >= 0.0 && x < width && y < height) {
        return None;
    }
    let half = (HALF_SIDE * width.max(height)).max(1.0) as usize;
    let (x, y) = (x as usize, y as usize);
    let (mut sum, mut count) = (0u64, 0u64);
    for row in y.saturating_sub(half)..(y + half + 1).min(image.height) {
        for column in x.saturating_sub(half)..(x + half + 1).min(image.width) {
            sum += image.pixel(column, row)[..3].iter().map(|&v| u64::from(v)).sum::<u64>();
            count += 3;
        }
    }
    let mean = sum as f64 / (255 * count.max(1)) as f64;
    (mean > USABLE[0] && mean < USABLE[1]).then(|| mean.ln())
}

/// What one training photo says.
#[derive(Clone, Debug, Default)]
pub(crate) struct PhotoBrightness {
    /// Its exposure, stops.
    pub(crate) stops: Option<f64>,
    /// Point and log brightness around it.
    pub(crate) samples: Vec<(usize, f64)>,
}

/// A response and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FittedResponse {
    pub(crate) response: ExposureResponse,
    /// `n ln(RSS without / RSS with) - 2 ln n`: its parameter is counted twice, so that chance does
    /// not switch it on.
    pub(crate) evidence: f64,
    /// Photos it was fitted to.
    pub(crate) photos: usize,
}

/// Fits the response; `None` when there is too little to fit it to. Keep it where the evidence is
/// positive.
pub(crate) fn fit(photos: &[PhotoBrightness], points: usize) -> Option<FittedResponse> {
    let gains = gains(photos, points);
    let known: Vec<(f64, f64)> = photos
        .iter()
        .zip(gains)
        .filter(|(photo, _)| photo.samples.len() >= MIN_POINTS)
        .filter_map(|(photo, gain)| Some((photo.stops?, gain)))
        .collect();
    if known.len() < MIN_PHOTOS {
        return None;
    }
    let n = known.len() as f64;
    let mean_e = known.iter().map(|k| k.0).sum::<f64>() / n;
    let mean_g = known.iter().map(|k| k.1).sum::<f64>() / n;
    let (mut ee, mut eg, mut gg) = (0.0, 0.0, 0.0);
    for (e, g) in known {
        let (e, g) = (e - mean_e, g - mean_g);
        (ee, eg, gg) = (ee + e * e, eg + e * g, gg + g * g);
    }
    if !((ee / n).sqrt() > MIN_SPREAD_STOPS && gg > 0.0) {
        return None;
    }
    let slope = eg / ee;
    let rest = (gg - slope * eg).max(1e-9 * gg);
    // More light cannot make a photo darker.
    let evidence =
        if slope > 0.0 { n * (gg / rest).ln() - 2.0 * n.ln() } else { f64::NEG_INFINITY };
    let response = ExposureResponse { slope_per_stop: slope, reference_stops: mean_e };
    Some(FittedResponse { response, evidence, photos: n as usize })
}

/// What the report says about it.
pub(crate) fn note(fitted: Option<FittedResponse>) -> Option<String> {
    let FittedResponse { response, evidence, photos } = fitted?;
    let verdict = if evidence > 0.0 { "kept" } else { "left out" };
    let percent = 100.0 * (response.slope_per_stop.exp() - 1.0);
    Some(format!(
        "exposure metadata {verdict}: one stop more makes photos {percent:.0} % brighter \
         (evidence {evidence:.1} from {photos} training photos, kept above 0)"
    ))
}

/// Log gain per photo, median 0: what minimizes `Σ huber(b_ip - surface_p - g_i)`.
fn gains(photos: &[PhotoBrightness], points: usize) -> Vec<f64> {
    let mut seen_by = vec![0; points];
    photos.iter().flat_map(|photo| &photo.samples).for_each(|&(point, _)| seen_by[point] += 1);
    // A point that one photo alone sees fits any gain.
    let entries: Vec<Entry> = photos
        .iter()
        .enumerate()
        .flat_map(|(i, photo)| photo.samples.iter().map(move |sample| (i, sample)))
        .filter(|(_, (point, _))| seen_by[*point] > 1)
        .map(|(i, &(point, value))| Entry { row: i as u32, column: point as u32, value })
        .collect();
    let center = |gains: &mut [f64]| {
        let middle = middle_or_zero(gains.to_vec());
        gains.iter_mut().for_each(|gain| *gain -= middle);
    };
    AdditiveFit::solve(&entries, [photos.len(), points], HUBER, ROUNDS, center).rows
}

/// 0 of nothing.
fn middle_or_zero(values: Vec<f64>) -> f64 {
    median(values).unwrap_or(0.0)
}

#[cfg(test)]
mod tests;
