//! Colors by the ratio of light after to light before.

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use motes_math::sigmoid::sigmoid;
use motes_scene::{Materials, Residual, Surface};
use rayon::prelude::*;
use relight::{BakeOptions, Probe, Question, RelightScene, Relighter};

use super::calibrate::Calibration;
use super::colors::{DIRECTIONS, Projection};
use super::hole::Hole;
use super::learned::{Correction, learned};
use super::{ReshadeError, ReshadeOptions};
use crate::{EditState, Origin, SCENE};

/// Ratios beyond these say more about noise than about light.
const RATIO: [f32; 2] = [0.02, 20.0];
/// Light below this share of the scene's brightest counts as this: nothing is divided by darkness.
const DARKNESS: f32 = 2e-3;
/// From here on a Gaussian is a metal: it shows its surroundings, not its light.
pub(super) const METAL: f32 = 0.5;
/// Roughness and metallic that differ by less are the same.
const SAME: f32 = 1e-4;
/// Viewers below this cosine learn nothing about a Gaussian.
const GRAZING: f32 = 0.1;
/// Gaussians that are fainter do not lend their material to the surface.
const LEAST_OPACITY: f32 = 0.1;

/// Present rows by what happens to their colors.
#[derive(Debug, Default)]
pub(super) struct Rows {
    /// Row, where its light was before, where it is now.
    pub(super) scaled: Vec<(u32, Probe, Probe)>,
    /// Rows that the light of the scene shades.
    pub(super) anew: Vec<u32>,
}

/// Materials of the Gaussians as they are.
///
/// # Errors
/// When a column is missing.
pub(super) fn materials_of(state: &EditState) -> Result<Materials, ReshadeError> {
    Ok(Materials::of(&state.gaussians).map_err(relight::SceneError::Column)?)
}

/// Sorts the rows of an edited scene; rows from `first_filled` on fill holes and are neither.
pub(super) fn sort(
    state: &EditState,
    before: &RelightScene,
    after: &RelightScene,
    first_filled: usize,
) -> Rows {
    let mut rows = Rows::default();
    for (i, origin) in state.origins.iter().enumerate().take(first_filled) {
        if origin.source != SCENE {
            if is_known(&after.materials, i) {
                rows.anew.push(i as u32);
            }
            continue;
        }
        let from_scene = origin.row != Origin::NEW_ROW;
        if state.material_changed[i] && from_scene && !same_lobe(before, after, origin.row, i) {
            rows.anew.push(i as u32);
            continue;
        }
        let item = u64::from(if from_scene { origin.row } else { i as u32 });
        let now = after.probe(i, item);
        let then = if from_scene {
            before.probe(origin.row as usize, item)
        } else {
            let back = state.motions[origin.motion as usize].inverse();
            Probe {
                position: back.point(now.position.as_dvec3()).as_vec3(),
                normal: back.direction(now.normal.as_dvec3()).as_vec3(),
                item,
            }
        };
        rows.scaled.push((i as u32, then, now));
    }
    rows
}

/// Whether a Gaussian has a material: without a normal nothing shades it.
pub(super) fn is_known(materials: &Materials, i: usize) -> bool {
    Vec3::from(materials.normals[i]).length_squared() > 0.25
}

fn same_lobe(before: &RelightScene, after: &RelightScene, row: u32, i: usize) -> bool {
    let (a, b) = (&before.materials, &after.materials);
    let row = row as usize;
    (a.roughness[row] - b.roughness[i]).abs() < SAME
        && (a.metallic[row] - b.metallic[i]).abs() < SAME
}

/// A scene and its light.
pub(super) type Lit<'a> = (&'a RelightScene, &'a Relighter<'a>);

/// A scene before and after an edit, under its light, and how closely its light is looked at.
#[derive(Clone, Copy)]
pub(super) struct Change<'a> {
    pub(super) before: Lit<'a>,
    pub(super) after: Lit<'a>,
    pub(super) projection: &'a Projection,
    pub(super) options: &'a ReshadeOptions,
}

/// Scales the colors whose light changed; returns how many, and what was learned at each hole.
pub(super) fn scale(
    state: &mut EditState,
    rows: &Rows,
    light: &Change<'_>,
    holes: &[&Hole],
) -> (usize, Vec<Option<Calibration>>) {
    let Change { before, after, projection, options } = *light;
    let white = White::new(rows, before, after, options.samples);
    let (corrections, calibrations) = learned(state, rows, &white, light, holes);
    let even: Vec<Vec3> = (0..rows.scaled.len())
        .map(|k| {
            let Correction { exponent, shift } = corrections[k];
            let change = exponent * (white.log_now[k] - white.log_then[k]) - shift;
            bounded(change.map(f32::exp)) * tint(state, before.0, after.0, rows.scaled[k].0)
        })
        .collect();
    let is_changed = |k: &usize| (even[*k] - Vec3::ONE).abs().max_element() > options.tolerance;
    let changed: Vec<usize> = (0..rows.scaled.len()).filter(is_changed).collect();
    // Metals once more, per viewer and with all lobes.
    let is_metal = |k: &usize| after.0.materials.metallic[rows.scaled[*k].0 as usize] >= METAL;
    let metals: Vec<usize> = changed.iter().copied().filter(is_metal).collect();
    let mirrored = mirrored(state, rows, &metals, light, &white);

    let k3 = 3 * state.gaussians.sh_coefficients();
    let mut colors: Vec<(u32, Vec<f32>)> = changed
        .iter()
        .map(|&k| (rows.scaled[k].0, state.gaussians.sh_of(rows.scaled[k].0 as usize).to_vec()))
        .collect();
    colors.par_iter_mut().zip(&changed).with_min_len(32).for_each(|((_, sh), &k)| {
        match metals.binary_search(&k) {
            Ok(m) => projection.scale(sh, |d| mirrored[m][d].unwrap_or(even[k])),
            Err(_) => projection.scale(sh, |_| even[k]),
        }
    });
    for (i, sh) in &colors {
        state.gaussians.sh[*i as usize * k3..][..k3].copy_from_slice(sh);
    }
    (colors.len(), calibrations)
}

fn bounded(ratio: Vec3) -> Vec3 {
    ratio.clamp(Vec3::splat(RATIO[0]), Vec3::splat(RATIO[1]))
}

/// Base color after over that before.
fn tint(state: &EditState, before: &RelightScene, after: &RelightScene, i: u32) -> Vec3 {
    let row = state.origins[i as usize].row;
    if !state.material_changed[i as usize] || row == Origin::NEW_ROW {
        return Vec3::ONE;
    }
    let of = |scene: &RelightScene, k: usize| {
        Vec3::from(scene.materials.base_color_linear[k]).max(Vec3::splat(0.01))
    };
    of(after, i as usize) / of(before, row as usize)
}

/// Logarithms of the radiance of white matte matter in the place of every row that is scaled.
pub(super) struct White {
    pub(super) log_then: Vec<Vec3>,
    pub(super) log_now: Vec<Vec3>,
    /// Added to radiances before they are divided.
    darkness: Vec3,
}

impl White {
    fn new(rows: &Rows, before: Lit<'_>, after: Lit<'_>, samples: u32) -> Self {
        let then: Vec<Probe> = rows.scaled.iter().map(|(_, then, _)| *then).collect();
        let now: Vec<Probe> = rows.scaled.iter().map(|(.., now)| *now).collect();
        let then = before.1.white_radiance(&then, samples);
        let now = after.1.white_radiance(&now, samples);
        let brightest = then.iter().map(|w| w.max_element()).fold(0.0f32, f32::max);
        let darkness = Vec3::splat((DARKNESS * brightest).max(f32::MIN_POSITIVE));
        let mut white = Self { log_then: Vec::new(), log_now: Vec::new(), darkness };
        (white.log_then, white.log_now) = (white.log(&then), white.log(&now));
        white
    }

    pub(super) fn log(&self, radiance: &[Vec3]) -> Vec<Vec3> {
        radiance.iter().map(|w| (*w + self.darkness).map(f32::ln)).collect()
    }
}

/// Ratios per viewer of [`DIRECTIONS`] for the rows `metals`; none for viewers that learn nothing.
fn mirrored(
    state: &EditState,
    rows: &Rows,
    metals: &[usize],
    light: &Change<'_>,
    white: &White,
) -> Vec<[Option<Vec3>; DIRECTIONS]> {
    let Change { before, after, projection, options } = *light;
    let seen = |normal: Vec3| {
        (0..DIRECTIONS).filter(move |d| projection.to_viewer[*d].dot(normal) > GRAZING)
    };
    let questions = |scene: &RelightScene, past: bool| -> Vec<Question> {
        let question = |k: &usize| {
            let (i, then, now) = &rows.scaled[*k];
            let origin = &state.origins[*i as usize];
            let back = state.motions[origin.motion as usize].rotation.conjugate();
            let row = if past && origin.row != Origin::NEW_ROW { origin.row } else { *i } as usize;
            let m = &scene.materials;
            let turned = |d: usize| {
                let v = projection.to_viewer[d];
                if past { (back * v.as_dvec3()).as_vec3() } else { v }
            };
            Question {
                probe: if past { *then } else { *now },
                base_color_linear: Vec3::from(m.base_color_linear[row]),
                roughness: m.roughness[row],
                metallic: m.metallic[row],
                to_viewer: seen(now.normal).map(turned).collect(),
            }
        };
        metals.iter().map(question).collect()
    };
    let samples = options.samples.div_ceil(2);
    let then = before.1.radiance(&questions(before.0, true), samples);
    let now = after.1.radiance(&questions(after.0, false), samples);
    let of_metal = |(m, k): (usize, &usize)| {
        let mut ratios = [None; DIRECTIONS];
        for (at, d) in seen(rows.scaled[*k].2.normal).enumerate() {
            let ratio = (now[m][at] + white.darkness) / (then[m][at] + white.darkness);
            ratios[d] = Some(bounded(ratio));
        }
        ratios
    };
    metals.iter().enumerate().map(of_metal).collect()
}

/// Lights what fills holes: its unlit color times the light that is there now, and toward each viewer the `sheen` of its hole.
pub(super) fn light_filling<'a>(
    state: &mut EditState,
    first_filled: usize,
    unlit: &[Vec3],
    sheen: impl Fn(usize) -> &'a [Vec3; DIRECTIONS],
    light: &Change<'_>,
) {
    let Change { after, projection, options, .. } = *light;
    let rows = first_filled..first_filled + unlit.len();
    let probes: Vec<Probe> = rows.clone().map(|i| after.0.probe(i, i as u64)).collect();
    let white = after.1.white_radiance(&probes, options.samples);
    let k3 = 3 * state.gaussians.sh_coefficients();
    for (k, ((i, unlit), white)) in rows.zip(unlit).zip(white).enumerate() {
        let sh = &mut state.gaussians.sh[i * k3..][..k3];
        projection.set_even(sh, *unlit * white);
        let sheen = sheen(k);
        projection.scale(sh, |d| sheen[d]);
    }
}

/// Shades rows by the light of the scene alone; returns how many.
pub(super) fn shade_anew(
    state: &mut EditState,
    rows: &[u32],
    after: &Relighter<'_>,
    options: &ReshadeOptions,
) -> usize {
    let sh_degree = state.gaussians.sh_degree.min(3);
    let bake = BakeOptions { sh_degree, bake_directions: options.bake_directions };
    let baked = after.bake_rows(rows, &bake);
    let from = 3 * motes_math::sh::sh_coefficients(sh_degree);
    let to = 3 * state.gaussians.sh_coefficients();
    for (i, sh) in rows.iter().zip(baked.chunks_exact(from)) {
        let out = &mut state.gaussians.sh[*i as usize * to..][..to];
        out.fill(0.0);
        out[..from].copy_from_slice(sh);
    }
    if let Ok(Some(mut residual)) = Residual::of(&state.gaussians) {
        // So much of it was baked.
        residual.scale(rows.iter().map(|i| *i as usize), after.residual_share());
        residual.attach(&mut state.gaussians);
    }
    rows.len()
}

/// The surface with the materials of the Gaussians that were given another one.
pub(super) fn with_materials_of(
    state: &EditState,
    materials: &Materials,
    surface: &Surface,
) -> Surface {
    let mut surface = surface.clone();
    let seen: Vec<usize> = (0..state.len())
        .filter(|&i| {
            sigmoid(state.gaussians.opacity_logits[i]) >= LEAST_OPACITY
                && Vec3::from(state.gaussians.means[i]).is_finite()
        })
        .collect();
    if !state.material_changed.contains(&true) || seen.is_empty() || !surface.has_materials() {
        return surface;
    }
    let points: Vec<[f32; 3]> = seen.iter().map(|&i| state.gaussians.means[i]).collect();
    let Ok(tree) = ImmutableKdTree::<f32, 3>::new_from_slice(&points) else {
        return surface;
    };
    let lender = |vertex: &[f32; 3]| -> Option<usize> {
        if !Vec3::from(*vertex).is_finite() {
            return None;
        }
        let nearest = tree
            .query(vertex)
            .nearest_n::<SquaredEuclidean<f32>>(std::num::NonZero::<usize>::MIN)
            .execute();
        nearest.first().map(|n| seen[n.item as usize]).filter(|&i| state.material_changed[i])
    };
    let lenders: Vec<Option<usize>> = surface.vertices.par_iter().map(lender).collect();
    for (v, lender) in lenders.into_iter().enumerate() {
        if let Some(i) = lender {
            surface.base_color_linear[v] = materials.base_color_linear[i];
            surface.roughness[v] = materials.roughness[i];
            surface.metallic[v] = materials.metallic[i];
        }
    }
    surface
}
