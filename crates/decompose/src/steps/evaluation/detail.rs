//! Whether the photos show the detail of the mesh.
//!
//! A bump changes the shading `S`, so a photo `P` of a true one changes with it; the base color of one that is not there undoes the
//! shading instead. Over pairs of pixels of one piece of surface, `p = Δ log P` follows `s = Δ log S` with the slope
//!
//! ```text
//! b = (⟨p s⟩ + τ) / (⟨s²⟩ + τ)        τ = 0.1 ⟨p²⟩ + σ²
//! ```
//!
//! 1 for detail that the photos show and for what texture or an even light hide, 0 for what they deny. With the turn `Δn` of the normals,
//! `(1 - b) sqrt ⟨|Δn|²⟩` is the denied part of it.

use glam::Vec3;
use motes_math::luminance::luminance;
use rayon::prelude::*;

use super::confidence::{BLACK, averaged, metallic_at};
use crate::appearance::PixelShading;
use crate::observation::SeenView;
use crate::state::State;

/// Pixels from one to the other of a pair.
const APART: usize = 3;
/// Half the side of the window that pairs are averaged over, pixels.
const WINDOW: usize = 7;
/// Half the side of the window that noise is averaged over first, pixels.
const NOISE_WINDOW: usize = 1;
/// Depths of one piece of surface differ by less than this share.
const ONE_PIECE: f32 = 0.03;
/// Share of the photo's squared differences that shading has to reach to say something.
const TEXTURE: f32 = 0.1;
/// Squared difference of log radiance that is noise.
const NOISE: f32 = 0.003;
/// Shading below which a surface is black.
const DARK: f32 = 1e-3;

/// Sums over pairs: products `p s`, squares of `s`, of `p` and of the turn of the normal, and their number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Detail([f32; 5]);

impl Detail {
    pub(super) fn add(&mut self, other: &Self) {
        self.0.iter_mut().zip(other.0).for_each(|(sum, v)| *sum += v);
    }

    /// Turn of the normals that the photos deny, radians; 0 where there are no pairs.
    pub(super) fn denied_rad(&self) -> f32 {
        let [ps, ss, pp, nn, count] = self.0;
        if count <= 0.0 {
            return 0.0;
        }
        let doubt = TEXTURE * pp + NOISE * count;
        let slope = (ps + doubt) / (ss + doubt);
        (1.0 - slope.clamp(0.0, 1.0)) * (nn / count).max(0.0).sqrt()
    }
}

/// The sums around every pixel of a view.
pub(super) fn around(
    state: &State<'_>,
    view: &SeenView<'_>,
    shading: &PixelShading,
) -> Vec<Detail> {
    let (w, h) = (view.photo.camera.width, view.photo.camera.height);
    let log = |v: Vec3, floor: f32| (luminance(v).max(0.0) + floor).ln();
    let photo: Vec<f32> = view.photo.radiance_linear.pixels().map(|v| log(v, BLACK)).collect();
    let shade: Vec<f32> = (0..w * h).map(|i| log(shading.slope(i), DARK)).collect();
    let [photo, shade] = [photo, shade].map(|v| averaged(&v, w, h, NOISE_WINDOW));
    // A mirror shows the detail of what it reflects.
    let normal = |i: usize| {
        let hit = &view.hits[i];
        let is_told = hit.is_hit() && view.photo.usable[i];
        let to_viewer = -view.rays.direction((i % w) as f32 + 0.5, (i / w) as f32 + 0.5);
        (is_told && metallic_at(state.surface(), hit) < 0.5)
            .then(|| state.observed.scene.frame(hit, to_viewer).1)
    };
    let normals: Vec<Option<Vec3>> =
        (0..w * h).into_par_iter().with_min_len(1024).map(normal).collect();
    let pair = |i: usize, k: usize| {
        let (Some(n), Some(m)) = (normals[i], normals[k]) else { return [0.0; 5] };
        let (near, far) = (view.hits[i].depth, view.hits[k].depth);
        if (near - far).abs() > ONE_PIECE * near {
            return [0.0; 5];
        }
        let (s, p) = (shade[i] - shade[k], photo[i] - photo[k]);
        [p * s, s * s, p * p, (n - m).length_squared(), 1.0]
    };
    let of = |i: usize| {
        let across = if i % w + APART < w { pair(i, i + APART) } else { [0.0; 5] };
        let down = if i / w + APART < h { pair(i, i + APART * w) } else { [0.0; 5] };
        [0, 1, 2, 3, 4].map(|k| across[k] + down[k])
    };
    let pairs: Vec<[f32; 5]> = (0..w * h).into_par_iter().with_min_len(1024).map(of).collect();
    let sums = [0, 1, 2, 3, 4].map(|k| {
        let values: Vec<f32> = pairs.iter().map(|pair| pair[k]).collect();
        averaged(&values, w, h, WINDOW)
    });
    (0..w * h).map(|i| Detail([0, 1, 2, 3, 4].map(|k| sums[k][i]))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums over pairs whose photo follows the shading with a slope, besides texture.
    fn detail(slope: f32, texture: f32, turn: f32) -> Detail {
        let mut sum = Detail::default();
        for i in 0..1000u16 {
            let s = 0.3 * (f32::from(i) * 0.7).sin();
            let p = slope * s + texture * (f32::from(i) * 2.9 + 1.0).sin();
            sum.add(&Detail([p * s, s * s, p * p, turn * turn, 1.0]));
        }
        sum
    }

    #[test]
    fn only_detail_that_smooth_photos_miss_is_denied() {
        let turn = 0.4;
        assert!(detail(1.0, 0.0, turn).denied_rad() < 0.01);
        assert!(detail(0.0, 0.0, turn).denied_rad() > 0.9 * turn);
        // Texture ten times as strong as the shading would be hides it.
        assert!(detail(0.0, 3.0, turn).denied_rad() < 0.15 * turn);
        // A surface without detail has none to deny, and no pairs say nothing.
        assert_eq!(detail(0.0, 0.0, 0.0).denied_rad(), 0.0);
        assert_eq!(Detail::default().denied_rad(), 0.0);
    }
}
