//! The color of the sky as a smooth function of the direction, one brightness and tint per photo.
//!
//! `log L_k(d) = Σ_j c_j f_j(d) + g_k`: harmonics of degree 2 and two falloffs above the horizon, where haze is; `g_k` takes up what
//! exposure, white balance and vignetting are left. Reweighted least squares (Geman & McClure 1987), the scale of the weights falling.

use glam::Vec3;

use crate::mesh::conjugate_gradients;

/// Functions of the direction.
const FUNCTIONS: usize = 11;
/// Weight of each against its being there, per look: what photos do not tell stays smooth.
const RIDGE: [f32; FUNCTIONS] = [1e-5, 1e-3, 1e-3, 1e-3, 1e-2, 1e-2, 1e-2, 1e-2, 1e-2, 1e-3, 1e-3];
/// Elevations, as sines, over which the haze thins out.
const HAZE: [f32; 2] = [0.06, 0.2];
/// Looks of a photo at which its own brightness is believed half, as a share of the looks of all per photo.
const OWN_LEVEL: f32 = 0.05;
/// Scale of the weights, natural logarithm: the first, its share after every round, and the least.
const SCALE: [f32; 3] = [0.8, 0.8, 0.15];
const ROUNDS: usize = 15;
/// Looks below which there is nothing to fit.
const LEAST_LOOKS: usize = 200;
/// Difference of a channel, natural logarithm, up to which a pixel agrees.
const AGREES: f32 = 0.3;

/// A pixel that may be sky.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    /// Index of the photo.
    pub(super) photo: u32,
    /// Unit; x and y lie in the ground, z is up.
    pub(super) direction: Vec3,
    /// Natural logarithm of its radiance.
    pub(super) log: Vec3,
}

/// The function and the levels of the photos.
#[derive(Clone, Debug)]
pub(super) struct SkyModel {
    coefficients: Vec<Vec3>,
    levels: Vec<Vec3>,
    /// Share of the looks that agree with it.
    pub(super) explained: f64,
}

fn functions(d: Vec3) -> [f32; FUNCTIONS] {
    let haze = HAZE.map(|falloff| (-d.z.max(0.0) / falloff).exp());
    let [near, far] = haze;
    [
        1.0,
        d.x,
        d.y,
        d.z,
        d.x * d.y,
        d.y * d.z,
        d.x * d.z,
        d.x * d.x - d.y * d.y,
        3.0 * d.z * d.z - 1.0,
        near,
        far,
    ]
}

impl SkyModel {
    /// Fits the looks at `photos` photos; none where there are too few.
    pub(super) fn fit(looks: &[Look], photos: usize) -> Option<Self> {
        if looks.len() < LEAST_LOOKS {
            return None;
        }
        let rows: Vec<[f32; FUNCTIONS]> = looks.iter().map(|l| functions(l.direction)).collect();
        let mut model = Self {
            coefficients: vec![Vec3::ZERO; FUNCTIONS],
            levels: vec![Vec3::ZERO; photos],
            explained: 0.0,
        };
        let mut weights = vec![1.0f32; looks.len()];
        let mut scale = SCALE[0];
        for _ in 0..ROUNDS {
            model.coefficients = solved(looks, &rows, &weights, &model.levels);
            model.level(looks, &rows, &weights);
            for ((weight, look), row) in weights.iter_mut().zip(looks).zip(&rows) {
                let off = model.off(look, row) / scale;
                *weight = (1.0 + off * off).powi(-2);
            }
            scale = (scale * SCALE[1]).max(SCALE[2]);
        }
        let agree = looks.iter().zip(&rows).filter(|(look, row)| model.off(look, row) < AGREES);
        model.explained = agree.count() as f64 / looks.len() as f64;
        Some(model)
    }

    /// Whether a pixel has the color of the sky in its direction.
    pub(super) fn agrees(&self, look: &Look) -> bool {
        self.off(look, &functions(look.direction)) < AGREES
    }

    fn value(&self, row: &[f32; FUNCTIONS]) -> Vec3 {
        row.iter().zip(&self.coefficients).map(|(f, c)| *c * *f).sum()
    }

    /// Largest difference of a channel.
    fn off(&self, look: &Look, row: &[f32; FUNCTIONS]) -> f32 {
        (look.log - self.levels[look.photo as usize] - self.value(row)).abs().max_element()
    }

    /// Sets the levels of the photos, each the mean of what the function leaves.
    fn level(&mut self, looks: &[Look], rows: &[[f32; FUNCTIONS]], weights: &[f32]) {
        let usual = OWN_LEVEL * looks.len() as f32 / self.levels.len().max(1) as f32;
        let mut sums = vec![(Vec3::ZERO, usual); self.levels.len()];
        for ((look, row), weight) in looks.iter().zip(rows).zip(weights) {
            let (sum, total) = &mut sums[look.photo as usize];
            *sum += (look.log - self.value(row)) * *weight;
            *total += weight;
        }
        self.levels = sums.into_iter().map(|(sum, total)| sum / total).collect();
    }
}

/// Coefficients of least weighted squares.
fn solved(
    looks: &[Look],
    rows: &[[f32; FUNCTIONS]],
    weights: &[f32],
    levels: &[Vec3],
) -> Vec<Vec3> {
    let mut products = [[0.0f64; FUNCTIONS]; FUNCTIONS];
    let mut right = [glam::DVec3::ZERO; FUNCTIONS];
    for ((look, row), weight) in looks.iter().zip(rows).zip(weights) {
        let rest = (look.log - levels[look.photo as usize]).as_dvec3();
        for (a, fa) in row.iter().enumerate() {
            let weighted = f64::from(fa * weight);
            right[a] += rest * weighted;
            products[a].iter_mut().zip(row).for_each(|(sum, fb)| *sum += weighted * f64::from(*fb));
        }
    }
    let count = looks.len().max(1) as f64;
    let apply = |c: &[Vec3]| -> Vec<Vec3> {
        let of = |(a, ridge): (usize, &f32)| {
            let sum: glam::DVec3 = products[a].iter().zip(c).map(|(p, c)| c.as_dvec3() * *p).sum();
            (sum / count).as_vec3() + c[a] * *ridge
        };
        RIDGE.iter().enumerate().map(of).collect()
    };
    let right = right.map(|r| (r / count).as_vec3()).to_vec();
    conjugate_gradients::solve(right, apply, 4 * FUNCTIONS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks into a sky that is bluer above and brighter to one side, from photos of other exposures, with other things among it.
    fn looks(photos: u32, things: usize) -> Vec<Look> {
        (0..photos)
            .flat_map(|photo| (0..200).map(move |i| (photo, i)))
            .map(|(photo, i)| {
                let turn = i as f32 * 2.4;
                let z = 0.02 + 0.6 * (i as f32 * 0.37).fract();
                let flat = (1.0 - z * z).sqrt();
                let direction = Vec3::new(flat * turn.cos(), flat * turn.sin(), z);
                let sky = Vec3::new(-0.8 * z, -0.4 * z, 0.1) + Vec3::splat(0.3 * direction.x);
                let thing = Vec3::new(-0.5, -1.5, -2.0) * (1.0 + (i as f32 * 0.71).fract());
                let log = if (i as usize) < things { thing } else { sky };
                Look { photo, direction, log: log + Vec3::splat(0.3 * (photo as f32).sin()) }
            })
            .collect()
    }

    #[test]
    fn a_sky_is_found_among_other_things_and_over_exposures() {
        let looks = looks(6, 60);
        let model = SkyModel::fit(&looks, 6).unwrap();
        assert!((model.explained - 0.7).abs() < 0.02, "{}", model.explained);
        let is_sky = |i: usize| i % 200 >= 60;
        let right = looks.iter().enumerate().filter(|(i, l)| model.agrees(l) == is_sky(*i)).count();
        assert!(right >= looks.len() * 98 / 100, "{right} of {}", looks.len());
    }

    #[test]
    fn few_looks_are_no_sky() {
        assert!(SkyModel::fit(&looks(0, 0), 0).is_none());
        assert!(SkyModel::fit(&looks(1, 0)[..150], 1).is_none());
    }
}
