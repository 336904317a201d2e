//! The surface: extracted from the Gaussians and the photos, or given.

mod burnt_out;
mod contour;
mod creases;
mod depth_prior;
mod extract;
mod flatness;
mod integrate;
mod options;
mod outlines;
mod patches;
mod planar_faces;
mod planes;
mod raised;
mod refine;
mod regions;
mod report;
mod rims;
mod room;
mod seams;
mod sheet;
mod silhouettes;
mod simd;
mod smooth;
mod splat_depth;
mod surface_nets;
mod tsdf;
mod view;
mod walls;

use crate::error::DecomposeError;
use crate::observation::{Observed, Photo, TracedSurface, up_in_world};
use crate::progress::Tick;
use crate::state::{Illumination, State};

pub use options::Options;
pub use report::{GeometryReport, StepTime};

/// Sets the surface, and which way is up on it.
///
/// # Errors
/// When there is no surface, its mesh is broken, or `tick` says so.
pub fn run(
    state: &mut State<'_>,
    options: &Options,
    tick: &mut Tick<'_>,
) -> Result<GeometryReport, DecomposeError> {
    let inputs = state.inputs;
    let (surface, report) = match &inputs.known.surface {
        Some(surface) => (surface.clone(), GeometryReport::default()),
        None => {
            // The Gaussians were fitted to the photos of the first capture.
            let photos: Vec<&Photo> = inputs.photos.iter().filter(|p| p.light == 0).collect();
            extract::extract(inputs.gaussians, &photos, options, tick)?
        }
    };
    if surface.triangles.is_empty() {
        return Err(DecomposeError::NoSurface);
    }
    state.up_in_world = up_in_world(&surface, inputs.photos);
    state.illumination = Illumination::known(state.known_lights());
    state.observed = Observed::unseen(TracedSurface::new(surface)?);
    Ok(report)
}
