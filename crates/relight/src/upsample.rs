//! Light of every pixel from light of every `n`-th: joint bilateral upsampling (Kopf et al. 2007),
//! guided by position, normal and roughness.

use glam::Vec3;
use rayon::prelude::*;

use crate::deferred::{Lit, Parts};
use crate::denoise::{Grid, falloff};
use crate::g_buffer::{GBuffer, Sight};

/// Below this sum of weights no coarse pixel explains a fine one.
const LEAST_WEIGHT: f32 = 0.02;
const PLANE_SHARE: f32 = 0.002;

/// The coarse pixel's place in the fine picture.
pub(crate) fn fine_pixel(coarse: usize, coarse_width: usize, n: usize, fine: &GBuffer) -> usize {
    let at = |c: usize, size: usize| (c * n + n / 2).min(size - 1);
    at(coarse / coarse_width, fine.height) * fine.width + at(coarse % coarse_width, fine.width)
}

/// Demodulated light of all pixels; `None` where no coarse pixel is of the same surface.
pub(crate) fn upsample(grid: &Grid, n: usize, fine: &GBuffer) -> Vec<Option<Lit>> {
    (0..fine.sight.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| {
            let Some(sight) = &fine.sight[i] else { return Some(Lit::default()) };
            let (x, y) = (i % fine.width, i / fine.width);
            blend(grid, Place::new(x, n), Place::new(y, n), sight, fine.material[i].roughness)
        })
        .collect()
}

/// Where a fine pixel lies between two coarse ones, along one axis.
#[derive(Clone, Copy)]
struct Place {
    /// The lower one, -1 or more.
    low: i32,
    /// Weights of both.
    tent: [f32; 2],
}

impl Place {
    fn new(fine: usize, n: usize) -> Self {
        // From the middle of the coarse pixel before the picture.
        let from = fine + n - n / 2;
        let share = (from % n) as f32 / n as f32;
        Self { low: (from / n) as i32 - 1, tent: [1.0 - share, share] }
    }
}

fn blend(grid: &Grid, x: Place, y: Place, sight: &Sight, roughness: f32) -> Option<Lit> {
    let (mut sum, mut total) = (Lit::default(), 0.0f32);
    for dy in 0..2usize {
        for dx in 0..2usize {
            let (xx, yy) = (x.low + dx as i32, y.low + dy as i32);
            if xx < 0 || yy < 0 || xx >= grid.width as i32 || yy >= grid.height as i32 {
                continue;
            }
            let k = yy as usize * grid.width + xx as usize;
            let Some(other) = &grid.sight[k] else { continue };
            let tent = x.tent[dx] * y.tent[dy];
            let offset = (other.position - sight.position).dot(sight.normal).abs();
            let cosine = sight.normal.dot(other.normal).max(0.0);
            let apart = offset / (PLANE_SHARE * sight.depth).max(1e-12)
                + 30.0 * (1.0 - cosine)
                + 10.0 * (grid.roughness[k] - roughness).abs();
            let weight = (tent + 1e-3) * falloff(apart);
            let lit = &grid.lit[k];
            sum.parts = Parts {
                diffuse: sum.parts.diffuse + lit.parts.diffuse * weight,
                specular: sum.parts.specular + lit.parts.specular * weight,
                indirect: sum.parts.indirect + lit.parts.indirect * weight,
            };
            sum.visibility += lit.visibility * weight;
            sum.variance += lit.variance * weight;
            total += weight;
        }
    }
    if !(total > LEAST_WEIGHT) {
        return None;
    }
    let scale = |v: Vec3| v / total;
    let Parts { diffuse, specular, indirect } = sum.parts;
    Some(Lit {
        parts: Parts {
            diffuse: scale(diffuse),
            specular: scale(specular),
            indirect: scale(indirect),
        },
        visibility: sum.visibility / total,
        variance: sum.variance / total,
    })
}
