//! Shape from shading: the surface of what is not metal moved to where its shading is that of the photos.
//!
//! Photo-consistency loses what is finer than its patches. Shading shows it: where neighbors have one base color, what photos show
//! of them differs by what they receive, and so by their normals (shape from shading, Horn 1970; on a surface that is nearly right,
//! under a light that is known: Wu et al. 2011).

mod displace;
mod options;
mod received;
mod solve;
mod turns;

use crate::appearance::vertex_materials::vertex_materials;
use crate::error::DecomposeError;
use crate::report::{Term, numbers};
use crate::state::State;
use crate::steps::materials;
use displace::Displaced;
use received::Shaded;

pub use options::Options;

/// Moves the surface, and finds the materials on it again. Nothing is told where nothing moved.
///
/// # Errors
/// When no point of the moved surface is seen by enough photos.
pub fn run(
    state: &mut State<'_>,
    options: &Options,
    of_materials: &materials::Options,
) -> Result<Option<Term>, DecomposeError> {
    if options.shape_from_shading_rounds == 0 {
        return Ok(None);
    }
    let (seen, light) = (&state.observed, &state.illumination);
    let sent = state.sent_radiance();
    let shaded = Shaded {
        scene: &seen.scene,
        views: &seen.views,
        lights: &light.lights,
        vertex_radiance: &sent,
        materials: &vertex_materials(&seen.scene, &seen.samples, &light.materials),
        smoothness: options.weight_smooth_displacement,
        ray_bias: state.ray_bias(),
        seed: state.inputs.seed,
    };
    let Some((surface, moved)) = shaded.reshaped(options.shape_from_shading_rounds) else {
        return Ok(None);
    };
    state.observed.move_to(surface, state.inputs.photos)?;
    materials::find_again(state, of_materials);
    Ok(Some(term(&moved)))
}

fn term(moved: &Displaced) -> Term {
    Term {
        name: "shape from shading".into(),
        kept: true,
        evidence: format!(
            "normals of {} vertices turned by {:.1} degrees on average, so that neighbors have one base color",
            moved.vertices, moved.turn_degrees
        ),
        numbers: numbers([("cost_before", Some(moved.cost[0])), ("cost", Some(moved.cost[1]))]),
    }
}
