//! Shape from reflection: metals turned to what they mirror.
//!
//! Photos never agree about a place on a mirror, so its surface is a guess between outlines. Once light and metals are known,
//! the photos tell its normals instead: what a point sends to each camera is what lies in the direction of reflection
//! (shape from specular reflection; Ikeuchi 1981, Oren & Nayar 1997; here of a rough metal under a known light). The normals
//! are searched on points spread over the metal, and the vertices are moved so that the surface has them.

mod mirrored;
mod mirrors;
mod normals;
mod options;
mod reshape;

use crate::appearance::Kind;
use crate::appearance::vertex_materials::vertex_materials;
use crate::error::DecomposeError;
use crate::progress::Tick;
use crate::report::{Term, numbers};
use crate::state::State;
use crate::steps::materials;
use mirrors::{MirrorRound, Mirrors, Reshaped};

pub use options::Options;

/// Turns the surface of metals, and finds the materials on it again. Nothing is told where there is no metal.
///
/// # Errors
/// When no point of the moved surface is seen by enough photos, or `tick` says so.
pub fn run(
    state: &mut State<'_>,
    options: &Options,
    of_materials: &materials::Options,
    tick: &mut Tick<'_>,
) -> Result<Option<Term>, DecomposeError> {
    let mut rounds = Vec::new();
    for round in 0..options.shape_from_reflection_rounds {
        let found = &state.illumination.materials;
        if found.parts.iter().all(|p| p.kind != Kind::Metal) {
            break;
        }
        tick(round as f32 / options.shape_from_reflection_rounds as f32)?;
        let Some(reshaped) = reshaped(state, options, round) else { break };
        let Reshaped { surface, roughness, round: report } = reshaped;
        rounds.push(report);
        state.observed.move_to(surface, state.inputs.photos)?;
        materials::find_again(state, of_materials);
        let seen = &state.observed;
        let found = &mut state.illumination.materials;
        found.take_roughness(&seen.samples, &seen.scene.surface, &roughness);
    }
    Ok(term(&rounds))
}

fn reshaped(state: &State<'_>, options: &Options, round: u32) -> Option<Reshaped> {
    let (seen, light) = (&state.observed, &state.illumination);
    let sent = state.sent_radiance();
    let mirrors = Mirrors {
        scene: &seen.scene,
        views: &seen.views,
        lights: &light.lights,
        vertex_radiance: &sent,
        materials: &vertex_materials(&seen.scene, &seen.samples, &light.materials),
        smoothness: options.weight_smooth_normals,
        ray_bias: state.ray_bias(),
    };
    mirrors.reshaped(state.inputs.seed.wrapping_add(u64::from(round)))
}

fn term(rounds: &[MirrorRound]) -> Option<Term> {
    let (first, last) = (rounds.first()?, rounds.last()?);
    Some(Term {
        name: "shape of metals by reflection".into(),
        kept: true,
        evidence: format!(
            "normals of {} points turned by {:.1} degrees on average to what they mirror",
            last.points, first.turn_degrees
        ),
        numbers: numbers([
            ("cost_before", Some(f64::from(first.cost[0]))),
            ("cost", Some(f64::from(last.cost[1]))),
            ("rounds", Some(rounds.len() as f64)),
        ]),
    })
}
