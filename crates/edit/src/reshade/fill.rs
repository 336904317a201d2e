//! New matter where an object stood: the plane goes on, with the colors of its surroundings.
//!
//! Colors are continued without their light ([`super::looks`]), and their texture by example ([`super::texture`]). New Gaussians are lit anew, so that no shadow is continued.

use glam::{Mat3, Quat, Vec3};
use motes_math::sigmoid::{logit, sigmoid};
use motes_scene::{Gaussians, Materials, Surface};

use super::hole::Hole;
use super::looks::{LEAST_OPACITY, Look};
use super::texture::Texture;

/// Standard deviation of a new Gaussian over its distance to the next: neighbors overlap to an even cover.
const SPREAD: f32 = 0.7;
/// Standard deviation across the plane over that along it.
const FLATNESS: f32 = 0.1;
/// Opacity of a new Gaussian.
const OPACITY: f32 = 0.95;

/// A hole is at least so many Gaussians wide, however sparse the ground around.
const COARSEST: f32 = 16.0;

/// Texture makes base colors brighter or darker by no more than this.
const LARGEST_RATIO: f32 = 3.3;

/// What fills a hole.
#[derive(Debug, Default)]
pub(super) struct Filling {
    /// Of degree 0, without color yet.
    pub(super) gaussians: Gaussians,
    pub(super) materials: Materials,
    /// Radiance over the radiance of a white matte surface, linear.
    pub(super) unlit: Vec<Vec3>,
    /// Whether that was copied from other ground.
    pub(super) by_example: Vec<bool>,
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

/// Closes a hole by its plane, with the texture of the ground where there is one.
pub(super) fn fill_with_plane(
    hole: &Hole,
    gaussians: &Gaussians,
    rows: &[u32],
    looks: &[Look],
    texture: Option<&Texture>,
) -> Filling {
    let grid = &hole.grid;
    let mut filling = Filling::default();
    let finest = texture.map_or(f32::INFINITY, Texture::pitch);
    let spacing = spacing(hole, gaussians, rows).min(finest);
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
        let smooth = Vec3::new(look[0], look[1], look[2]).max(Vec3::ZERO);
        let copied = texture.and_then(|texture| texture.unlit_at(flat));
        let ratio = copied.map_or(Vec3::ONE, |copied| copied / smooth.max(Vec3::splat(1e-6)));
        let ratio = ratio.clamp(Vec3::splat(LARGEST_RATIO.recip()), Vec3::splat(LARGEST_RATIO));
        m.base_color_linear.push((Vec3::from(base(look)) * ratio).to_array().map(unit));
        m.roughness.push(unit(look[6]));
        m.metallic.push(unit(look[7]));
        m.visibility.push(1.0);
        m.observations.push(0);
        filling.unlit.push(copied.unwrap_or(smooth));
        filling.by_example.push(copied.is_some());
    }
    filling
}

/// Distance of new Gaussians: as dense as those around.
fn spacing(hole: &Hole, gaussians: &Gaussians, rows: &[u32]) -> f32 {
    let grid = &hole.grid;
    let near = grid.grown(&hole.open, 12);
    let counted = |c: usize| near[c] && hole.covered[c] && !hole.open[c];
    let area = (0..grid.cells()).filter(|c| counted(*c)).count() as f32 * grid.pitch.powi(2);
    let opaque = |row: &&u32| {
        let i = **row as usize;
        let cell = grid.cell(grid.plane.flat(Vec3::from(gaussians.means[i])));
        sigmoid(gaussians.opacity_logits[i]) >= LEAST_OPACITY && cell.is_some_and(counted)
    };
    let count = rows.iter().filter(opaque).count() as f32;
    let opening = (hole.open_cells() as f32).sqrt() * grid.pitch;
    let dense = (area / count.max(1.0)).sqrt();
    let finest = (0.5 * grid.pitch).max(opening / 256.0);
    if dense > 0.0 { dense.clamp(finest, (opening / COARSEST).max(finest)) } else { grid.pitch }
}
