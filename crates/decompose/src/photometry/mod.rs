//! What the camera did to the photos: an exposure and a white balance for each, one tone curve for all.
//!
//! A point of the scene shows the same radiance `L` to all photos, but for what is glossy. What photo `i` shows in channel `c`, encoded, is
//!
//! ```text
//! y_ic = T(encode(exp(g_ic) L_c))        T: tone curve (`motes_math::tone_curve`), g: log gain of the photo
//! ```
//!
//! With `x = ln decode(T⁻¹(y))` that is a table of photos and points, `x = ln L + g`, which is fitted robustly. `T` follows from how
//! much dark, middle and bright points answer to the gains: under the right curve all by the same share (Grossberg and Nayar 2003:
//! photos alone tell a response up to a power, so its shape is a family that keeps black, one half and white). Without gains that
//! differ nothing tells a curve, and the photos are taken as sRGB.

mod apply;
mod options;
mod points;
mod report;
mod response;

use motes_math::additive_fit::{AdditiveFit, Entry};
use motes_math::srgb;
use motes_math::tone_curve::ToneCurve;
use motes_raster::RenderOptions;
use motes_scene::{Gaussians, Switch};

use crate::observation::Photo;
use crate::report::Term;

pub use options::Options;
use points::{Point, points_of};
use response::Response;

/// Residuals of log radiance beyond this count linearly.
const HUBER: f64 = 0.15;
/// Turns of photos and points.
const ROUNDS: usize = 200;
/// Root mean square of the log gains from which on photos differ in exposure: view-dependent looks of glossy things make up to 0.07.
const LEAST_SPREAD: f64 = 0.1;
/// The same for the channels against each other.
const LEAST_BALANCE_SPREAD: f64 = 0.02;
/// How far both halves of the scene must agree on the gains, -1 to 1.
const LEAST_AGREEMENT: f64 = 0.5;
/// The same for dark and bright points: an exposure is the same factor for both, and a wrong one is taken for gloss.
const LEAST_BRIGHTNESS_AGREEMENT: f64 = 0.7;
/// Photos under one light, from which on their exposures can be told.
const LEAST_PHOTOS: usize = 5;
/// A photo with fewer values in a half says nothing about its gain there.
const LEAST_VALUES: usize = 20;
/// Drop of chi square from which on a tone curve is kept: the cost of a parameter, and room for errors that are not independent.
const LEAST_EVIDENCE: f64 = 10.0;
/// A tone curve of less contrast is none.
const LEAST_CONTRAST: f32 = 0.1;

/// What the camera did to the photos.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Photometry {
    /// Natural logarithm of the gain of every photo, linear r, g, b; mean 0 over the photos of a light. Zeros where exposures are left
    /// out.
    pub log_gains: Vec<[f64; 3]>,
    /// The tone curve.
    pub tone_curve: ToneCurve,
    /// What was modeled or left out, and why.
    pub terms: Vec<Term>,
}

/// Finds it from photos and the Gaussians that were fitted to them, which say where the points are.
pub fn calibrate(
    photos: &[Photo],
    gaussians: &Gaussians,
    render: &RenderOptions,
    options: &Options,
) -> Photometry {
    let none = vec![[0.0; 3]; photos.len()];
    if (options.exposure, options.tone_curve) == (Switch::Off, Switch::Off) {
        return Photometry { log_gains: none, ..Photometry::default() };
    }
    let table = Table::new(photos, points_of(photos, gaussians, render));
    let plain = Exposures::of(&table, ToneCurve::default());
    let may_differ = plain.differ_everywhere(&table);
    // Without exposures that differ nothing tells a curve.
    let response = match options.tone_curve {
        Switch::Off => None,
        Switch::Auto if !may_differ => None,
        Switch::Auto | Switch::On => response::find(&table),
    };
    let is_curved = |found: &Response| options.tone_curve == Switch::On || found.is_evident();
    let mut tone_curve = response.filter(is_curved).map_or(ToneCurve::default(), |r| r.curve);
    let exposures =
        if tone_curve.is_identity() { plain } else { Exposures::of(&table, tone_curve) };
    let are_kept = match options.exposure {
        Switch::On => true,
        Switch::Off => false,
        Switch::Auto => exposures.are_evident(&table),
    };
    if !are_kept && options.tone_curve == Switch::Auto {
        tone_curve = ToneCurve::default();
    }
    let terms = report::terms(&exposures, are_kept, response, tone_curve);
    let log_gains = if are_kept { exposures.log_gains } else { none };
    Photometry { log_gains, tone_curve, terms }
}

/// Points with what photos show of them.
struct Table {
    /// Light of every photo.
    lights: Vec<usize>,
    points: Vec<Point>,
}

impl Table {
    fn new(photos: &[Photo], points: Vec<Point>) -> Self {
        Self { lights: photos.iter().map(|p| p.light).collect(), points }
    }

    /// Rows are channels of photos, columns those of points; `keep` chooses points.
    fn entries(&self, curve: ToneCurve, keep: impl Fn(usize) -> bool) -> Vec<Entry> {
        let mut entries = Vec::new();
        for (k, point) in self.points.iter().enumerate().filter(|(k, _)| keep(*k)) {
            for c in (0..3).filter(|&c| point.is_told(c)) {
                entries.extend(point.shown.iter().map(|(photo, shown)| Entry {
                    row: 3 * photo + c as u32,
                    column: (3 * k + c) as u32,
                    value: f64::from(srgb::decode(curve.invert(shown[c]))).ln(),
                }));
            }
        }
        entries
    }

    fn solve(&self, entries: &[Entry]) -> Vec<f64> {
        let size = [3 * self.lights.len(), 3 * self.points.len()];
        AdditiveFit::solve(entries, size, HUBER, ROUNDS, |rows| self.center(rows)).rows
    }

    /// Takes the mean of every light and channel out.
    fn center(&self, rows: &mut [f64]) {
        let lights = self.lights.iter().max().map_or(0, |l| l + 1);
        for light in 0..lights {
            let of: Vec<usize> =
                (0..self.lights.len()).filter(|&i| self.lights[i] == light).collect();
            for c in 0..3 {
                let mean = of.iter().map(|i| rows[3 * i + c]).sum::<f64>() / of.len().max(1) as f64;
                of.iter().for_each(|i| rows[3 * i + c] -= mean);
            }
        }
    }
}

/// Gains of the photos, and how sure they are.
struct Exposures {
    log_gains: Vec<[f64; 3]>,
    /// Root mean square of the mean of the channels.
    spread: f64,
    /// Of the channels against that mean.
    balance_spread: f64,
    /// Of the gains that one half of the scene gives with those of the other.
    agreement: f64,
    /// Of the gains that the darker half of the points gives with those of the brighter.
    brightness_agreement: f64,
}

impl Exposures {
    fn of(table: &Table, curve: ToneCurve) -> Self {
        let rows = table.solve(&table.entries(curve, |_| true));
        let mut log_gains: Vec<[f64; 3]> =
            rows.chunks_exact(3).map(|r| [r[0], r[1], r[2]]).collect();
        let mean = |g: &[f64; 3]| g.iter().sum::<f64>() / 3.0;
        let spread = root_mean_square(log_gains.iter().map(mean));
        let balance_spread =
            root_mean_square(log_gains.iter().flat_map(|g| g.map(|channel| channel - mean(g))));
        if balance_spread < LEAST_BALANCE_SPREAD {
            log_gains.iter_mut().for_each(|g| *g = [mean(g); 3]);
        }
        let (side, bright) = (points::sides(&table.points), points::bright(&table.points));
        let (agreement, brightness_agreement) =
            rayon::join(|| agreement(table, curve, &side), || agreement(table, curve, &bright));
        Self { log_gains, spread, balance_spread, agreement, brightness_agreement }
    }

    fn differ_everywhere(&self, table: &Table) -> bool {
        table.lights.len() >= LEAST_PHOTOS
            && self.spread >= LEAST_SPREAD
            && self.agreement >= LEAST_AGREEMENT
    }

    fn are_evident(&self, table: &Table) -> bool {
        self.differ_everywhere(table) && self.brightness_agreement >= LEAST_BRIGHTNESS_AGREEMENT
    }
}

/// 0 of nothing.
fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), v| (sum + v * v, count + 1));
    (sum / f64::from(count.max(1))).sqrt()
}

/// How far the gains that one half of the points gives are those of the other, -1 to 1: what a highlight makes of one thing, others
/// do not have.
/// Light that changes somewhere does not change all alike, either.
fn agreement(table: &Table, curve: ToneCurve, halves: &[bool]) -> f64 {
    let of = |half: bool| {
        let entries = table.entries(curve, |k| halves[k] == half);
        let mut count = vec![0usize; 3 * table.lights.len()];
        entries.iter().for_each(|e| count[e.row as usize] += 1);
        (table.solve(&entries), count)
    };
    let ((a, count_a), (b, count_b)) = rayon::join(|| of(false), || of(true));
    let (mut product, mut squares) = (0.0, 0.0);
    for i in 0..a.len() {
        if count_a[i].min(count_b[i]) >= LEAST_VALUES {
            product += 2.0 * a[i] * b[i];
            squares += a[i] * a[i] + b[i] * b[i];
        }
    }
    if squares > 0.0 { product / squares } else { 0.0 }
}

#[cfg(test)]
mod tests;
