//! How much more alike a lamp makes the base colors of neighbors that it lights differently.
//!
//! A pendant over one corner of a room hardly changes the cost of all pairs. Pairs count by how much they tell of a lamp:
//!
//! ```text
//! saved_j = 1 - Σ w |s_aj - s_bj| ρ(log b_a - log b_b) / the same of the light without lamps
//! ```
//!
//! with the share `s_pj` of all light on point `p` that lamp `j` gives.

use glam::Vec3;

use super::pairs::Pair;
use super::solve::{LitPoints, likeness, log_base};
use crate::illumination::CellLight;

/// A light that was found, what it lights, and the pairs that told it.
pub(super) struct SmoothLight {
    /// Of the last step.
    pub cost: f64,
    /// The light of the only capture.
    pub light: CellLight,
    /// Its points.
    pub lit: LitPoints,
    /// Of these points.
    pub pairs: Vec<Pair>,
}

impl SmoothLight {
    fn shading(&self) -> Vec<Vec3> {
        self.lit.shading(&self.light.sources())
    }

    /// Share that lamp `j` has of the light on every point.
    fn shares(&self, j: usize, shading: &[Vec3]) -> Vec<f32> {
        let transport = &self.lit.transport;
        let column = self.light.cells.len() + j;
        let radiance = self.light.lamps[j].radiance;
        let share = |(p, all): (usize, &Vec3)| {
            let of_lamp = radiance * transport.cells[p * transport.columns + column];
            of_lamp.element_sum() / all.element_sum()
        };
        shading.iter().enumerate().map(share).collect()
    }
}

/// What every lamp of `with` saves beside the same points under a light `without` lamps; 0 where nothing tells.
pub(super) fn saved(with: &SmoothLight, without: &SmoothLight, sigma: f32) -> Vec<f64> {
    let shading = with.shading();
    let lit = log_base(&with.lit.radiance, &shading);
    let unlit = log_base(&without.lit.radiance, &without.shading());
    let of_lamp = |j: usize| {
        let share = with.shares(j, &shading);
        let telling = |pair: &Pair| {
            let told = (share[pair.a as usize] - share[pair.b as usize]).abs();
            Pair { weight: pair.weight * told, ..*pair }
        };
        let pairs: Vec<Pair> = with.pairs.iter().map(telling).collect();
        let [cost, cost_without] = [&lit, &unlit].map(|log_base| {
            let mut cost = 0.0;
            likeness(log_base, &pairs, sigma, &mut cost);
            cost
        });
        if cost_without > 0.0 { 1.0 - cost / cost_without } else { 0.0 }
    };
    (0..with.light.lamps.len()).map(of_lamp).collect()
}

#[cfg(test)]
mod tests {
    use super::super::lamps::Lamps;
    use super::super::transport::Transport;
    use super::*;
    use crate::illumination::Lamp;
    use motes_shading::environment::{Convention, Orientation};

    const COUNT: usize = 30;

    /// A row of points under an even sky of radiance 1, of which each receives 1/2, and a lamp at its start; `shown` is what the photos
    /// show.
    fn row(radiance: &[Vec3], lamp: Option<f32>) -> SmoothLight {
        let sky = CellLight::uniform(4, 2, Vec3::ONE, Orientation::new(Convention::Blender));
        let lamps = lamp.map(|l| Lamp { radiance: Vec3::splat(l), seen: Vec3::ONE });
        let light = CellLight { lamps: lamps.into_iter().collect(), ..sky };
        let columns = light.cells.len() + light.lamps.len();
        let of = |p: usize| {
            let sky = vec![0.5 / light.cells.len() as f32; light.cells.len()];
            sky.into_iter().chain(light.lamps.iter().map(move |_| falls_off(p))).collect::<Vec<_>>()
        };
        let cells = (0..COUNT).flat_map(of).collect();
        let transport = Transport { cells, bounce: vec![Vec3::ZERO; COUNT], columns };
        let pair = |a: u32| Pair { a, b: a + 1, weight: 1.0 };
        SmoothLight {
            cost: 0.0,
            lit: LitPoints { transport, radiance: radiance.to_vec() },
            light,
            pairs: (0..COUNT as u32 - 1).map(pair).collect(),
        }
    }

    fn falls_off(p: usize) -> f32 {
        0.5 * (-0.5 * p as f32).exp()
    }

    /// What photos show of a row of `paint` under a lamp of radiance `lamp`.
    fn shown(paint: impl Fn(usize) -> f32, lamp: f32) -> Vec<Vec3> {
        (0..COUNT).map(|p| Vec3::splat(paint(p) * (0.5 + lamp * falls_off(p)))).collect()
    }

    #[test]
    fn a_lamp_saves_where_it_shines_however_small_that_place_is() {
        let checks = |p: usize| if p.is_multiple_of(3) { 0.6 } else { 0.4 };
        let lit = shown(checks, 4.0);
        let of = |lamp| saved(&row(&lit, Some(lamp)), &row(&lit, None), 0.05)[0];
        let [dim, right, bright] = [1.0, 4.0, 40.0].map(of);
        println!(
            "saved by a lamp of a quarter {dim:.3}, of the true radiance {right:.3}, of ten times that {bright:.3}"
        );
        assert!(right > 0.1 && right > dim && dim > 0.0 && bright < 0.0, "{dim} {right} {bright}");
        // Nothing fades as light does.
        let unlit = shown(checks, 0.0);
        assert!(saved(&row(&unlit, Some(4.0)), &row(&unlit, None), 0.05)[0] < 0.0);
    }

    #[test]
    fn a_lamp_is_kept_that_shines_more_than_is_seen_and_saves_anything() {
        let kept = |radiance: f32, saved: f64| {
            let row = row(&shown(|_| 0.5, 4.0), Some(radiance));
            let piece = Lamps { of_vertex: vec![0, 1], seen: vec![Vec3::ONE], ..Lamps::default() };
            piece.kept(&row.light, &row.lit, &[saved]).of_vertex == [0, 1]
        };
        assert!(kept(4.0, 0.001));
        assert!(!kept(4.0, 0.0) && !kept(4.0, -0.02) && !kept(1.4, 0.1));
    }

    #[test]
    fn nothing_tells_of_a_lamp_that_lights_all_alike() {
        let radiance = vec![Vec3::splat(0.3); COUNT];
        let mut with = row(&radiance, Some(2.0));
        let columns = with.lit.transport.columns;
        with.lit.transport.cells.chunks_mut(columns).for_each(|row| row[columns - 1] = 0.1);
        assert_eq!(saved(&with, &row(&radiance, None), 0.05), [0.0]);
        assert!(saved(&row(&radiance, None), &row(&radiance, None), 0.05).is_empty());
    }
}
