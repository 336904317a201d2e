//! Whose matter is at a place: that of the Gaussians that absorb most light there.
//!
//! ```text
//! κ_i(x) = m_i / Π_k s_k · exp(-½ Σ_k (a_k · (x - μ_i))² / s_k²)     s_k² = σ_k² + blur²
//! m_i    = -ln (1 - opacity_i) · (σ_1 σ_2 + σ_2 σ_3 + σ_3 σ_1) / 3
//! ```
//!
//! `a_k`, `σ_k` are the axes of a Gaussian and its standard deviations, `m_i` its optical depth times its projected area. The
//! centers of few large Gaussians, as those of a lawn, lie far from most of it; those of an object beside it may all be nearer.

use std::collections::HashMap;

use glam::{DQuat, DVec3};
use motes_scene::Gaussians;

use crate::mass::{optical_depth, projected_area};

/// A Gaussian ends so many standard deviations from its center.
const REACH: f64 = 3.0;
/// What stays has to absorb so many times more than what changed: inside of objects are Gaussians that nobody saw and selected.
const STAYING: f64 = 3.0;

/// A cell: the binary logarithm of its width, and where it is.
type Cell = (i32, [i64; 3]);

/// One Gaussian.
#[derive(Debug)]
struct Blob {
    row: u32,
    mean: DVec3,
    /// Unit axes over their standard deviations.
    axes: [DVec3; 3],
    /// `κ` at the center.
    peak: f64,
    reach: DVec3,
}

impl Blob {
    fn new(gaussians: &Gaussians, row: u32, blur: f64) -> Option<Self> {
        let i = row as usize;
        let [w, x, y, z] = gaussians.rotations[i].map(f64::from);
        let rotation = DQuat::from_xyzw(x, y, z, w).normalize();
        let mean = DVec3::from_array(gaussians.means[i].map(f64::from));
        let own = gaussians.log_scales[i].map(|s| f64::from(s).exp());
        let wide = own.map(|s| s.hypot(blur));
        let unit = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| rotation * axis);
        let mass = optical_depth(gaussians.opacity_logits[i]) * projected_area(own.into());
        let peak = mass / wide.iter().product::<f64>();
        let square = |k: usize| unit[k] * unit[k] * wide[k] * wide[k];
        let reach = REACH * (square(0) + square(1) + square(2)).map(f64::sqrt);
        let axes = [0, 1, 2].map(|k| unit[k] / wide[k]);
        (mean.is_finite() && reach.is_finite() && peak > 0.0 && peak.is_finite()).then_some(Self {
            row,
            mean,
            axes,
            peak,
            reach,
        })
    }

    fn absorption(&self, at: DVec3) -> f64 {
        let d = at - self.mean;
        let square: f64 = self.axes.iter().map(|axis| axis.dot(d).powi(2)).sum();
        if square > REACH * REACH { 0.0 } else { self.peak * (-0.5 * square).exp() }
    }
}

/// The Gaussians around those that changed, by cells as wide as themselves.
#[derive(Debug)]
pub(super) struct Absorption {
    blobs: Vec<Blob>,
    cells: HashMap<Cell, Vec<u32>>,
    /// Widths of the cells that there are.
    levels: Vec<i32>,
    low: DVec3,
    high: DVec3,
}

impl Absorption {
    /// Of these rows, as far as they lie where those that changed are. A place is known to within `blur`, world units.
    pub(super) fn around(
        gaussians: &Gaussians,
        rows: &[u32],
        is_changed: impl Fn(u32) -> bool,
        blur: f32,
    ) -> Self {
        let blob = |row: &u32| Blob::new(gaussians, *row, f64::from(blur));
        let mut blobs: Vec<Blob> = rows.iter().filter_map(blob).collect();
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for b in blobs.iter().filter(|b| is_changed(b.row)) {
            (low, high) = (low.min(b.mean - b.reach), high.max(b.mean + b.reach));
        }
        let meets =
            |b: &Blob| (b.mean + b.reach).cmpge(low).all() && (b.mean - b.reach).cmple(high).all();
        blobs.retain(meets);
        let mut cells: HashMap<Cell, Vec<u32>> = HashMap::new();
        for (k, b) in blobs.iter().enumerate() {
            let level = (2.0 * b.reach.max_element()).max(f64::MIN_POSITIVE).log2().ceil() as i32;
            let corner = |at: DVec3| cell_of(level, at.clamp(low, high));
            let ((_, from), (_, to)) = (corner(b.mean - b.reach), corner(b.mean + b.reach));
            for x in from[0]..=to[0] {
                for y in from[1]..=to[1] {
                    for z in from[2]..=to[2] {
                        cells.entry((level, [x, y, z])).or_default().push(k as u32);
                    }
                }
            }
        }
        let mut levels: Vec<i32> = cells.keys().map(|c| c.0).collect();
        levels.sort_unstable();
        levels.dedup();
        Self { blobs, cells, levels, low, high }
    }

    /// Whether anything that changed may reach a place.
    pub(super) fn is_near(&self, at: DVec3) -> bool {
        at.cmpge(self.low).all() && at.cmple(self.high).all()
    }

    /// The kind of Gaussian that absorbs most at a place, of those that `kind` tells apart, 0 being what stays; of equal ones the
    /// least. `None` where none absorbs.
    pub(super) fn kind_at(&self, at: DVec3, kind: impl Fn(u32) -> u32) -> Option<u32> {
        let mut sums: Vec<(u32, f64)> = Vec::new();
        for &level in &self.levels {
            for &k in self.cells.get(&cell_of(level, at)).into_iter().flatten() {
                let blob = &self.blobs[k as usize];
                let absorption = blob.absorption(at);
                if absorption > 0.0 {
                    let kind = kind(blob.row);
                    let absorption = absorption / if kind == 0 { STAYING } else { 1.0 };
                    match sums.iter_mut().find(|(known, _)| *known == kind) {
                        Some((_, sum)) => *sum += absorption,
                        None => sums.push((kind, absorption)),
                    }
                }
            }
        }
        sums.into_iter()
            .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))
            .map(|(kind, _)| kind)
    }
}

fn cell_of(level: i32, at: DVec3) -> Cell {
    (level, (at / f64::from(level).exp2()).to_array().map(|v| v.floor() as i64))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Opaque Gaussians at places on the axis `x`, flat in `z`, as wide as said.
    fn row_of(places: &[(f32, f32)]) -> Gaussians {
        let mut gaussians = Gaussians::empty(0);
        for &(x, width) in places {
            gaussians.means.push([x, 0.0, 0.0]);
            gaussians.rotations.push([1.0, 0.0, 0.0, 0.0]);
            gaussians.log_scales.push([width.ln(), width.ln(), 0.01f32.ln()]);
            gaussians.opacity_logits.push(3.0);
            gaussians.sh.extend([0.0; 3]);
        }
        gaussians
    }

    #[test]
    fn a_lawn_of_few_large_gaussians_is_not_of_the_pot_on_it() {
        // Five small ones whose centers are nearer than that of the large one.
        let gaussians =
            row_of(&[(4.0, 2.0), (0.0, 0.2), (0.1, 0.2), (0.2, 0.2), (0.3, 0.2), (0.4, 0.2)]);
        let rows: Vec<u32> = (0..6).collect();
        let is_pot = |row: u32| row > 0;
        let absorption = Absorption::around(&gaussians, &rows, is_pot, 0.02);
        let at = |x: f64, z: f64| {
            absorption.kind_at(DVec3::new(x, 0.0, z), |row| u32::from(is_pot(row)))
        };
        assert_eq!(at(0.2, 0.0), Some(1));
        assert_eq!(at(1.5, 0.0), Some(0));
        assert_eq!(at(1.5, 1.0), None, "nothing is there");
        assert!(absorption.is_near(DVec3::ZERO) && !absorption.is_near(DVec3::X * 3.0));
    }

    #[test]
    fn cells_hide_nothing() {
        let places: Vec<(f32, f32)> =
            (0..40).map(|k| ((k * 37 % 40) as f32 * 0.1, 0.03 * 1.2f32.powi(k % 17))).collect();
        let gaussians = row_of(&places);
        let rows: Vec<u32> = (0..40).collect();
        let absorption = Absorption::around(&gaussians, &rows, |row| row % 3 == 0, 0.01);
        for k in 0..200 {
            let at = DVec3::new(f64::from(k) * 0.02, 0.01 * f64::from(k % 5), 0.005);
            let mut sums = [0.0; 3];
            for row in &rows {
                let blob = Blob::new(&gaussians, *row, f64::from(0.01f32)).expect("a Gaussian");
                sums[(row % 3) as usize] += blob.absorption(at);
            }
            sums[0] /= STAYING;
            let most = (0..3).max_by(|&a, &b| sums[a].total_cmp(&sums[b]).then(b.cmp(&a)));
            let expected = most.filter(|m| sums[*m] > 0.0).map(|m| m as u32);
            if absorption.is_near(at) {
                assert_eq!(absorption.kind_at(at, |row| row % 3), expected, "{at}");
            }
        }
    }
}
