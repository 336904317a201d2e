//! Holes closed: a lid on the surface, and Gaussians that go on with the ground around.

use glam::Vec3;
use motes_scene::{ExtraColumn, Surface};

use super::colors::{DIRECTIONS, Projection};
use super::fill::{Filling, dressed_lid, fill_with_plane};
use super::hole::{GROUNDED, Hole};
use super::looks::{Look, Seen, continued_looks, window};
use super::patch::best_shift;
use super::plane_picture::plane_picture;
use super::ratio::{Lit, materials_of};
use super::sheen::sheen;
use super::texture::Texture;
use super::{ReshadeError, ReshadeOptions, ReshadeReport, surface};
use crate::refit::Fills;
use crate::{EditState, Fill, Origin, SCENE, Similarity};

/// What holes are closed by.
#[derive(Clone, Copy)]
pub(super) struct Closing<'a> {
    /// The scene before the edit, under its light.
    pub(super) before: Lit<'a>,
    pub(super) projection: &'a Projection,
    pub(super) options: &'a ReshadeOptions,
}

/// The ground around a hole as it goes on.
pub(super) struct Ground {
    looks: Vec<Look>,
    /// Rows that lie on it.
    rows: Vec<u32>,
    texture: Option<Texture>,
    /// How it changes with the direction of view.
    pub(super) sheen: [Vec3; DIRECTIONS],
}

/// Gaussians that fill holes with the planes around, still without color.
#[derive(Default)]
pub(super) struct Filled {
    /// Their first row.
    pub(super) first: usize,
    /// Their colors without light.
    pub(super) unlit: Vec<Vec3>,
    /// Whether those were copied from other ground.
    pub(super) by_example: Vec<bool>,
    /// Numbers of their holes.
    pub(super) hole: Vec<usize>,
}

impl Closing<'_> {
    /// Puts a lid on every hole, and copies the ground into those that ask for a patch. One that finds none becomes a plane.
    ///
    /// # Errors
    /// When the Gaussians have no materials.
    pub(super) fn close(
        &self,
        state: &mut EditState,
        holes: &mut [(Hole, Fill)],
        mesh: &mut Surface,
        report: &mut ReshadeReport,
    ) -> Result<Vec<Ground>, ReshadeError> {
        let mut grounds = Vec::with_capacity(holes.len());
        for (hole, fill) in holes {
            let seen = self.seen(state, hole);
            let materials = materials_of(state)?;
            let looks_within =
                |cells| continued_looks(hole, &state.gaussians, &materials, &seen, cells);
            let of_hole = looks_within(window(&hole.grid, hole.object_size));
            if *fill == Fill::Patch {
                match best_shift(hole, &looks_within(0)) {
                    Some(shift) => report.filled += copy_patch(state, hole, shift),
                    None => {
                        *fill = Fill::Texture;
                        report.warnings.push(
                            "no piece of the surroundings fits a hole: its plane goes on instead"
                                .to_owned(),
                        );
                    }
                }
            }
            surface::append(mesh, &dressed_lid(hole, &of_hole));
            let antialias = self.before.0.antialias;
            let texture = (*fill == Fill::Texture)
                .then(|| Texture::new(hole, &state.gaussians, &seen, self.projection, antialias));
            let texture = texture.flatten();
            report.textured += usize::from(texture.is_some());
            let sheen = if goes_on(*fill) {
                sheen(hole, &state.gaussians, &seen, self.projection, antialias)
            } else {
                [Vec3::ONE; DIRECTIONS]
            };
            grounds.push(Ground { looks: of_hole, rows: seen.rows, texture, sheen });
        }
        Ok(grounds)
    }

    /// The ground around a hole as the Gaussians show it that lie on it, and its light before the edit.
    fn seen(&self, state: &EditState, hole: &Hole) -> Seen {
        let Self { before: (before, lit_before), projection, options } = *self;
        let grid = &hole.grid;
        let stays = |i: &u32| {
            let origin = &state.origins[*i as usize];
            let p = Vec3::from(state.gaussians.means[*i as usize]);
            origin.source == SCENE
                && origin.row != Origin::NEW_ROW
                && state.motions[origin.motion as usize].is_identity()
                && hole.is_low(p)
                && grid.cell(grid.plane.flat(p)).is_some()
        };
        // Seen from above, whatever the ground is made of: its Gaussians scatter more than the surface.
        let low: Vec<u32> = (0..state.len() as u32).filter(stays).collect();
        let picture = plane_picture(grid, &state.gaussians, &low, projection, before.antialias);
        let lies = |i: &u32| {
            let row = state.origins[*i as usize].row as usize;
            hole.on_plane(Vec3::from(state.gaussians.means[*i as usize]))
                && Vec3::from(before.materials.normals[row]).dot(grid.plane.normal) > GROUNDED
        };
        let rows = low.iter().copied().filter(lies).collect();
        Seen::new(hole, [rows, low], picture, lit_before, options.samples)
    }
}

/// Whether new Gaussians go on with the plane.
fn goes_on(fill: Fill) -> bool {
    matches!(fill, Fill::Plane | Fill::Texture)
}

/// Fills the holes that ask for their plane.
pub(super) fn fill_planes(
    state: &mut EditState,
    holes: &[(Hole, Fill)],
    grounds: &[Ground],
    report: &mut ReshadeReport,
) -> Filled {
    let mut filled = Filled { first: state.len(), ..Filled::default() };
    for (number, (hole, _)) in holes.iter().enumerate().filter(|(_, (_, f))| goes_on(*f)) {
        let Ground { looks, rows, texture, .. } = &grounds[number];
        let filling = fill_with_plane(hole, &state.gaussians, rows, looks, texture.as_ref());
        report.filled += filling.gaussians.len();
        filled.unlit.extend_from_slice(&filling.unlit);
        filled.by_example.extend_from_slice(&filling.by_example);
        filled.hole.resize(filled.unlit.len(), number);
        append_filling(state, filling);
    }
    filled
}

/// What fills the holes, from a row on, and what was there around them.
pub(super) fn fills_of(state: &EditState, holes: &[(Hole, Fill)], first_new: usize) -> Fills {
    let rims: Vec<Vec<bool>> = holes.iter().map(|(hole, _)| hole.rim()).collect();
    let around = |i: &u32| {
        let origin = &state.origins[*i as usize];
        let p = Vec3::from(state.gaussians.means[*i as usize]);
        origin.source == SCENE
            && state.motions[origin.motion as usize].is_identity()
            && holes.iter().zip(&rims).any(|((hole, _), rim)| hole.on_rim(rim, p))
    };
    Fills {
        filled: (first_new as u32..state.len() as u32).collect(),
        rim: (0..first_new as u32).filter(around).collect(),
    }
}

/// Copies the Gaussians of the plane that are `shift` away from the open cells; returns how many.
fn copy_patch(state: &mut EditState, hole: &Hole, shift: [f32; 2]) -> usize {
    let plane = hole.grid.plane;
    let offset = plane.axes[0] * shift[0] + plane.axes[1] * shift[1];
    let back = Similarity::translation(-offset.as_dvec3());
    let fits = |i: &u32| {
        let origin = &state.origins[*i as usize];
        let p = Vec3::from(state.gaussians.means[*i as usize]);
        let at_home = origin.source == SCENE && state.motions[origin.motion as usize].is_identity();
        at_home
            && hole.on_plane(p)
            && hole.grid.cell(plane.flat(p - offset)).is_some_and(|c| hole.open[c])
    };
    let rows: Vec<u32> = (0..state.len() as u32).filter(fits).collect();
    let mut copies = state.gaussians.clone();
    copies.gather(&rows);
    for mean in &mut copies.means {
        let (from, to) = (Vec3::from(*mean), Vec3::from(*mean) - offset);
        let field = |p: Vec3| hole.grid.field_at(plane.flat(p));
        *mean = (to + plane.normal * (field(to) - field(from))).to_array();
    }
    let origins = rows.iter().map(|&i| state.origins[i as usize]).collect();
    let first = state.len() as u32;
    state.append(copies, origins);
    let added: Vec<u32> = (first..state.len() as u32).collect();
    state.note_motion(&added, &back);
    rows.len()
}

/// Adds the Gaussians of a filling, still without color.
fn append_filling(state: &mut EditState, filling: Filling) {
    let n = filling.gaussians.len();
    if n == 0 {
        return;
    }
    let mut gaussians = filling.gaussians.with_sh_degree(state.gaussians.sh_degree);
    filling.materials.attach(&mut gaussians);
    // Columns that only the scene knows are empty in what is new.
    gaussians.extra = state
        .gaussians
        .extra
        .iter()
        .map(|column| {
            let own = gaussians.extra.iter().find(|c| c.name == column.name).cloned();
            own.unwrap_or_else(|| {
                let values = column.values.zeros(n);
                ExtraColumn { name: column.name.clone(), values }
            })
        })
        .collect();
    let origin = Origin { source: SCENE, row: Origin::NEW_ROW, motion: crate::AT_REST };
    state.append(gaussians, vec![origin; n]);
}
