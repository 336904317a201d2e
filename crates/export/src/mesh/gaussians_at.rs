//! What the Gaussians show at a point of the surface, seen straight on.
//!
//! On the line `q + t n` a Gaussian with `M = diag(1/σ) Rᵀ` has the squared Mahalanobis distance
//! `|M (q - μ) + t M n|²`, least at `t* = -(M d · M n) / |M n|²`. Sorted by `t*`, outermost first, they blend
//! with `alpha = opacity exp(-Q(t*) / 2)`: the picture of an orthographic camera above the point. As in
//! the rasterizer, 0.3 texel² of variance keeps what is finer than a texel from aliasing.

use std::collections::BTreeMap;

use glam::{IVec3, Mat3, Quat, Vec3};
use motes_math::sigmoid::sigmoid;
use motes_raster::{ALPHA_MAX, ALPHA_MIN, BLUR_VARIANCE_PX2};
use motes_scene::{Gaussians, Materials};

/// Beyond this many standard deviations alpha is below 1/255.
const EXTENT: f32 = 3.33;
/// Less than this share of a texel covered: the surface's own material is the better guess.
const LEAST_COVERAGE: f32 = 0.05;
/// Thinner Gaussians are taken to be this share of their width thick: their inverse stays a number.
const LEAST_THICKNESS: f32 = 1e-3;

/// Material at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Matter {
    pub(super) base_color_linear: Vec3,
    pub(super) roughness: f32,
    pub(super) metallic: f32,
    pub(super) visibility: f32,
}

struct Blob {
    mean: Vec3,
    normal: Vec3,
    /// `diag(1/σ) Rᵀ`
    whitening: Mat3,
    opacity: f32,
    matter: Matter,
}

/// Gaussians, found by place: each is in all cells that its box touches on the level whose cells
/// are as large as the box.
pub(super) struct GaussiansAt {
    blobs: Vec<Blob>,
    /// Centers and half sizes of their boxes, apart: most candidates end here.
    boxes: Vec<(Vec3, Vec3)>,
    cells: BTreeMap<(i32, [i32; 3]), Vec<u32>>,
    levels: Vec<i32>,
    reach: f32,
}

impl GaussiansAt {
    /// `texel` and `reach`, how far off the surface its Gaussians may be, are in world units.
    pub(super) fn new(
        gaussians: &Gaussians,
        materials: &Materials,
        texel: f32,
        reach: f32,
    ) -> Self {
        let mut bad = vec![false; gaussians.len()];
        gaussians.invalid_rows().iter().for_each(|i| bad[*i as usize] = true);
        let mut found = Self {
            blobs: Vec::new(),
            boxes: Vec::new(),
            cells: BTreeMap::new(),
            levels: Vec::new(),
            reach,
        };
        for (i, bad) in bad.iter().enumerate() {
            let opacity = sigmoid(gaussians.opacity_logits[i]);
            // A Gaussian that no view saw has a guess for a material.
            if !bad && opacity > ALPHA_MIN && materials.observations[i] > 0 {
                found.insert(gaussians, materials, i, opacity, texel);
            }
        }
        found.levels = found.cells.keys().map(|(level, _)| *level).collect();
        found.levels.dedup();
        found
    }

    fn insert(
        &mut self,
        gaussians: &Gaussians,
        materials: &Materials,
        i: usize,
        opacity: f32,
        texel: f32,
    ) {
        let [w, x, y, z] = gaussians.rotations[i];
        let rotation = Mat3::from_quat(Quat::from_xyzw(x, y, z, w).normalize());
        let variance =
            (Vec3::from(gaussians.log_scales[i]) * 2.0).exp() + BLUR_VARIANCE_PX2 * texel * texel;
        let sigma = Vec3::from(variance.to_array().map(f32::sqrt));
        let sigma = sigma.max(Vec3::splat(sigma.max_element() * LEAST_THICKNESS));
        let normal = Vec3::from(materials.normals[i]);
        let mean = Vec3::from(gaussians.means[i]);
        let half =
            Vec3::from([0, 1, 2].map(|k| (rotation.row(k) * sigma).length())) * EXTENT + self.reach;
        if !(half.is_finite() && half.max_element() > 0.0 && normal.is_finite()) {
            return;
        }
        let level = half.max_element().log2().ceil() as i32;
        let (low, high) = (cell(mean - half, level), cell(mean + half, level));
        for cx in low.x..=high.x {
            for cy in low.y..=high.y {
                for cz in low.z..=high.z {
                    let bucket = self.cells.entry((level, [cx, cy, cz])).or_default();
                    bucket.push(self.blobs.len() as u32);
                }
            }
        }
        self.boxes.push((mean, half));
        self.blobs.push(Blob {
            mean,
            normal,
            whitening: Mat3::from_diagonal(sigma.recip()) * rotation.transpose(),
            opacity,
            matter: Matter {
                base_color_linear: Vec3::from(materials.base_color_linear[i]),
                roughness: materials.roughness[i],
                metallic: materials.metallic[i],
                visibility: materials.visibility[i],
            },
        });
    }

    /// The blended material at a point with a unit normal; `None` where nothing covers it. `layers` is
    /// scratch.
    pub(super) fn matter(
        &self,
        point: Vec3,
        normal: Vec3,
        layers: &mut Vec<(f32, f32, u32)>,
    ) -> Option<Matter> {
        layers.clear();
        for &level in &self.levels {
            let Some(bucket) = self.cells.get(&(level, cell(point, level).to_array())) else {
                continue;
            };
            for &b in bucket {
                let (center, half) = self.boxes[b as usize];
                if !(point - center).abs().cmple(half).all() {
                    continue;
                }
                let blob = &self.blobs[b as usize];
                // What faces away belongs to the other side of a thin part.
                if !(blob.normal.dot(normal) > 0.0) {
                    continue;
                }
                let d = blob.whitening * (point - blob.mean);
                let n = blob.whitening * normal;
                let t = -d.dot(n) / n.length_squared();
                let alpha = blob.opacity * (-0.5 * (d + n * t).length_squared()).exp();
                if t.abs() <= self.reach && alpha >= ALPHA_MIN {
                    layers.push((-t, alpha.min(ALPHA_MAX), b));
                }
            }
        }
        layers.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
        let (mut sum, mut through) = (Matter::default(), 1.0);
        for &(_, alpha, b) in layers.iter() {
            let (matter, weight) = (&self.blobs[b as usize].matter, through * alpha);
            sum.base_color_linear += matter.base_color_linear * weight;
            sum.roughness += matter.roughness * weight;
            sum.metallic += matter.metallic * weight;
            sum.visibility += matter.visibility * weight;
            through *= 1.0 - alpha;
        }
        let covered = 1.0 - through;
        let scaled = Matter {
            base_color_linear: sum.base_color_linear / covered,
            roughness: sum.roughness / covered,
            metallic: sum.metallic / covered,
            visibility: sum.visibility / covered,
        };
        (covered > LEAST_COVERAGE).then_some(scaled)
    }
}

fn cell(p: Vec3, level: i32) -> IVec3 {
    // Casting saturates.
    (p * (-level as f32).exp2()).floor().as_ivec3()
}
