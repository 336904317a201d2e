//! New matter where an object stood: the plane goes on, with the colours of its surroundings.
//!
//! Colours are continued without their light: the captured radiance of a Gaussian over the irradiance that
//! the model puts on it. New Gaussians are lit anew, so that no shadow is continued.

use glam::{Mat3, Quat, Vec3};
use motes_math::median::median;
use motes_math::sigmoid::{logit, sigmoid};
use motes_scene::{Gaussians, Materials, Surface};

use super::grid::pull_push;
use super::hole::Hole;

/// Gaussians that are fainter have no say.
const LEAST_OPACITY: f32 = 0.3;
/// Standard deviation of a new Gaussian over its distance to the next: neighbours overlap to an even cover.
const SPREAD: f32 = 0.7;
/// Standard deviation across the plane over that along it.
const FLATNESS: f32 = 0.1;
/// Share of the brightest light from which a colour is known.
const KNOWN_LIGHT: f32 = 0.5;
/// No cell is brighter, unlit, than this share of those in such light.
const BRIGHT: f32 = 0.9;
/// Opacity of a new Gaussian.
const OPACITY: f32 = 0.95;

/// Unlit color, base color, roughness, metallic.
pub(super) type Look = [f32; 8];

/// What fills a hole.
#[derive(Debug, Default)]
pub(super) struct Filling {
    /// Of degree 0, without colour yet.
    pub(super) gaussians: Gaussians,
    pub(super) materials: Materials,
    /// Radiance over the radiance of a white matte surface, linear.
    pub(super) unlit: Vec<Vec3>,
}

/// A Gaussian of the surroundings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Neighbour {
    pub(super) row: u32,
    /// Radiance along its normal, linear.
    pub(super) radiance: Vec3,
    /// Radiance of white matte matter in its place.
    pub(super) white_radiance: Vec3,
}

impl Neighbour {
    fn unlit(&self, brightest: f32) -> Vec3 {
        self.radiance / self.white_radiance.max(Vec3::splat(1e-3 * brightest))
    }
}

/// The lid of a hole with the materials around.
pub(super) fn dressed_lid(hole: &Hole, looks: &[Look]) -> Surface {
    let grid = &hole.grid;
    let mut lid = hole.lid();
    for vertex in &lid.vertices {
        let cell = grid.cell(grid.plane.flat(Vec3::from(*vertex)));
        let look = cell.map_or([0.0; 8], |cell| looks[cell]);
        lid.base_color_linear.push(base(&look));
        lid.roughness.push(unit(look[6]));
        lid.metallic.push(unit(look[7]));
    }
    lid
}

fn base(look: &Look) -> [f32; 3] {
    [look[3], look[4], look[5]].map(unit)
}

fn unit(v: f32) -> f32 {
    // `max` first: it turns NaN into 0.
    v.max(0.0).clamp(0.0, 1.0)
}

/// Closes a hole by its plane.
pub(super) fn fill_with_plane(
    hole: &Hole,
    gaussians: &Gaussians,
    neighbours: &[Neighbour],
    looks: &[Look],
) -> Filling {
    let grid = &hole.grid;
    let mut filling = Filling::default();
    let spacing = spacing(hole, gaussians, neighbours);
    let sigma = SPREAD * spacing;
    let across = (grid.size[0] as f32 * grid.pitch / spacing).ceil() as usize;
    let along = (grid.size[1] as f32 * grid.pitch / spacing).ceil() as usize;
    for place in 0..across * along {
        let step = spacing / grid.pitch;
        let at = [(place % across) as f32 + 0.5, (place / across) as f32 + 0.5].map(|v| v * step);
        let flat = grid.corner_at(at);
        let Some(cell) = grid.cell(flat).filter(|c| hole.open[*c]) else { continue };
        let (look, g, m) = (&looks[cell], &mut filling.gaussians, &mut filling.materials);
        let normal = grid.normal(flat);
        let along = (grid.plane.axes[0] - normal * normal.dot(grid.plane.axes[0])).normalize();
        let rotation = Quat::from_mat3(&Mat3::from_cols(along, normal.cross(along), normal));
        g.means.push(grid.point(flat).to_array());
        g.rotations.push([rotation.w, rotation.x, rotation.y, rotation.z]);
        g.log_scales.push([sigma.ln(), sigma.ln(), (FLATNESS * sigma).ln()]);
        g.opacity_logits.push(logit(OPACITY));
        g.sh.extend([0.0; 3]);
        m.normals.push(normal.to_array());
        m.base_color_linear.push(base(look));
        m.roughness.push(unit(look[6]));
        m.metallic.push(unit(look[7]));
        m.visibility.push(1.0);
        m.observations.push(0);
        filling.unlit.push(Vec3::new(look[0], look[1], look[2]).max(Vec3::ZERO));
    }
    filling
}

/// The look of every cell of a hole: the mean of the Gaussians over it, continued where there is none.
pub(super) fn continued_looks(
    hole: &Hole,
    gaussians: &Gaussians,
    materials: &Materials,
    neighbours: &[Neighbour],
) -> Vec<Look> {
    let grid = &hole.grid;
    let brightest =
        neighbours.iter().map(|n| n.white_radiance.max_element()).fold(0.0f32, f32::max);
    let bound = brightest_unlit(gaussians, neighbours, brightest);
    let mut sums = vec![[0.0f32; 8]; grid.cells()];
    let mut weights = vec![0.0f32; grid.cells()];
    for n in neighbours {
        let i = n.row as usize;
        let opacity = sigmoid(gaussians.opacity_logits[i]);
        let Some(cell) = grid.cell(grid.plane.flat(Vec3::from(gaussians.means[i]))) else {
            continue;
        };
        // Colours are best known in the light: least squares weigh by its square.
        let light = n.white_radiance / brightest.max(f32::MIN_POSITIVE);
        let weight = opacity * light.element_sum().powi(2);
        if hole.blurred[cell] || opacity < LEAST_OPACITY || !(weight > 1e-6) {
            continue;
        }
        let unlit = n.unlit(brightest).min(bound);
        let base = materials.base_color_linear[i];
        let look = [
            unlit.x,
            unlit.y,
            unlit.z,
            base[0],
            base[1],
            base[2],
            materials.roughness[i],
            materials.metallic[i],
        ];
        sums[cell].iter_mut().zip(look).for_each(|(s, v)| *s += weight * v);
        weights[cell] += weight;
    }
    let known: Vec<bool> = weights.iter().map(|w| *w > 0.0).collect();
    // Cells in deep shadow, where an object touched the plane, know little about its colour.
    let usual = median(weights.iter().filter(|w| **w > 0.0).map(|w| f64::from(*w)));
    let usual = usual.unwrap_or(1.0) as f32;
    for (sum, weight) in sums.iter_mut().zip(&mut weights).filter(|(_, w)| **w > 0.0) {
        let trust = (*weight / usual).min(1.0);
        sum.iter_mut().for_each(|v| *v *= trust / *weight);
        *weight = trust;
    }
    let mut looks = pull_push(grid.size, sums, weights);
    grid.smooth(&mut looks, &known);
    looks
}

/// How bright, per channel, the surroundings are without their light, where there is much of it. Where the model has too little
/// light, division by it makes colours that are nowhere.
fn brightest_unlit(gaussians: &Gaussians, neighbours: &[Neighbour], brightest: f32) -> Vec3 {
    let known = |n: &&Neighbour| {
        let light = n.white_radiance.element_sum() / 3.0;
        let opacity = sigmoid(gaussians.opacity_logits[n.row as usize]);
        opacity >= LEAST_OPACITY && light >= KNOWN_LIGHT * brightest
    };
    let of = |c: usize| {
        let mut all: Vec<f32> =
            neighbours.iter().filter(known).map(|n| n.unlit(brightest)[c]).collect();
        let at = (all.len().saturating_sub(1) as f32 * BRIGHT) as usize;
        if all.is_empty() {
            f32::INFINITY
        } else {
            *all.select_nth_unstable_by(at, f32::total_cmp).1
        }
    };
    Vec3::from_array([0, 1, 2].map(of))
}

/// Distance of new Gaussians: as dense as those around.
fn spacing(hole: &Hole, gaussians: &Gaussians, neighbours: &[Neighbour]) -> f32 {
    let grid = &hole.grid;
    let near = grid.grown(&hole.open, 12);
    let counted = |c: usize| near[c] && hole.covered[c] && !hole.open[c];
    let area = (0..grid.cells()).filter(|c| counted(*c)).count() as f32 * grid.pitch.powi(2);
    let opaque = |n: &&Neighbour| {
        let i = n.row as usize;
        let cell = grid.cell(grid.plane.flat(Vec3::from(gaussians.means[i])));
        sigmoid(gaussians.opacity_logits[i]) >= LEAST_OPACITY && cell.is_some_and(counted)
    };
    let count = neighbours.iter().filter(opaque).count() as f32;
    let opening = (hole.open_cells() as f32).sqrt() * grid.pitch;
    let dense = (area / count.max(1.0)).sqrt();
    let finest = (0.5 * grid.pitch).max(opening / 256.0);
    if dense > 0.0 { dense.clamp(finest, (opening / 6.0).max(finest)) } else { grid.pitch }
}
