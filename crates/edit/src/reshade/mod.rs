//! Light that follows an edit: old shadows go, new ones land, what was covered is closed.
//!
//! The colors that a splat was trained to hold more than any model of material and light explains, so
//! they are kept and only *scaled*, after Debevec 1998 (Rendering Synthetic Objects into Real Scenes):
//!
//! ```text
//! color after = color before * L_after / L_before
//! ```
//!
//! `L` is what the decomposed scene says about the surface point of a Gaussian: the radiance of white matte matter there,
//! direct light with traced visibility and one bounce, in the scene before and in the scene after the edit, along the same
//! random directions. Metals take the ratio per viewing direction, of all lobes. A Gaussian whose light changes by less than
//! a tolerance keeps its bytes. Gaussians that are new here, or have another roughness or metallic, are shaded anew
//! by the light of the scene; after a change of environment all are.
//!
//! The surface that rays meet follows the Gaussians: each vertex shares the fate of those that absorb most at its place. Where an
//! object left a hole in the plane that it stood on, the plane goes on with its texture ([`crate::Fill`]).

mod absorption;
mod around;
mod bordered;
mod calibrate;
mod closing;
mod colors;
mod cover;
mod examples;
mod exemplar;
mod fates;
mod fill;
mod foretold;
mod grid;
mod height_field;
mod hole;
mod images;
mod learned;
mod leftovers;
mod looks;
mod patch;
mod pieces;
mod plane_picture;
mod ratio;
mod scene_after;
mod sheen;
mod support;
mod surface;
mod texture;

use motes_scene::Surface;
use relight::{Exposure, LightError, LightSource, Place, Quality, SceneError};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::EditState;
use crate::refit::Fills;

/// How light follows an edit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReshadeOptions {
    /// Directions toward the light per Gaussian.
    pub samples: u32,
    /// Directions that newly shaded Gaussians are seen from.
    pub bake_directions: u32,
    /// Relative change of light that is too small to follow.
    pub tolerance: f32,
    /// Of the light that surfaces send on, and of what is shaded anew.
    #[serde(skip)]
    pub quality: Quality,
    /// Key of all random numbers.
    pub seed: u64,
}

impl Default for ReshadeOptions {
    fn default() -> Self {
        Self {
            samples: 64,
            bake_directions: 32,
            tolerance: 5e-3,
            quality: Quality::Standard,
            seed: 0,
        }
    }
}

/// What light did.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ReshadeReport {
    /// Gaussians whose colors were scaled.
    pub scaled: usize,
    /// Gaussians that were shaded anew.
    pub shaded: usize,
    /// Gaussians that fill what was uncovered.
    pub filled: usize,
    /// Holes whose ground has a texture, which goes on.
    pub textured: usize,
    /// Gaussians that were hidden in an object that left, and were removed.
    pub leftovers: usize,
    /// κ of each shadow that went: by how much deeper the photos show it than the model, per channel.
    pub shadow_exponents: Vec<[f32; 3]>,
    /// Holes on ground that is not a plane.
    pub uneven: usize,
    /// Why places that were left stay open.
    pub unfilled: Vec<String>,
    /// Triangles of the surface before and after.
    pub triangles: [usize; 2],
    /// What could not be done, and why.
    pub warnings: Vec<String>,
    /// Rows that fill holes and rows around them, for a fit that may follow.
    #[serde(skip)]
    pub fills: Fills,
}

/// Why light could not follow.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ReshadeError {
    /// The plan was not started on a decomposed scene.
    #[error("the light of a splat without decomposition is not known")]
    NoScene,
    /// The scene cannot be lit.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The environment cannot be used.
    #[error(transparent)]
    Light(#[from] LightError),
}

/// What a plan left, after light had its turn.
#[derive(Clone, Debug, Default)]
pub struct Settled {
    /// The surface as it is now.
    pub surface: Surface,
    /// What light did; `None` when there was nothing to follow.
    pub report: Option<ReshadeReport>,
    /// Whether something changed that light was not asked to follow.
    pub stayed: bool,
}

/// Ends a plan: light follows when the scene changed and is asked for samples, as [`reshade`] says.
///
/// # Errors
/// As [`reshade`].
pub fn settle(state: &mut EditState, options: &ReshadeOptions) -> Result<Settled, ReshadeError> {
    if state.parts.is_none() || state.change().is_empty() {
        let surface = state.sources.first().and_then(|s| s.surface.as_deref()).cloned();
        return Ok(Settled { surface: surface.unwrap_or_default(), ..Settled::default() });
    }
    if options.samples == 0 {
        return Ok(Settled { surface: moved_surface(state), report: None, stayed: true });
    }
    let (surface, report) = reshade(state, options)?;
    Ok(Settled { surface, report: Some(report), stayed: false })
}

/// Makes colors, surface and filling of an edited scene right; returns the new surface.
///
/// # Errors
/// When the scene before or after cannot be lit.
pub fn reshade(
    state: &mut EditState,
    options: &ReshadeOptions,
) -> Result<(Surface, ReshadeReport), ReshadeError> {
    scene_after::reshade(state, options)
}

/// The surface of an edited scene, when light is not asked to follow: it goes where its Gaussians went. Nothing fills the holes.
pub fn moved_surface(state: &EditState) -> Surface {
    scene_after::moved_surface(state)
}

fn light_of(state: &EditState) -> Result<motes_shading::environment::Environment, ReshadeError> {
    let parts = state.parts.as_ref().ok_or(ReshadeError::NoScene)?;
    let source = LightSource::Map { image: parts.environment.clone(), axes: parts.axes };
    let up = state.up_in_world.as_vec3();
    Ok(source.light(0.0, Exposure::Factor(1.0), &Place::with_up(up), &|| None)?.environment)
}
