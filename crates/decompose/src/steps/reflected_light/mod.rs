//! Light fitted to what is reflected, with materials and scale in turn.

mod fit;
mod options;

use crate::appearance::FoundMaterials;
use crate::error::DecomposeError;
use crate::illumination::environment;
use crate::report::{Term, numbers};
use crate::state::{Illumination, State};
use crate::steps::light::problem::LightProblem;
use crate::steps::light::transport::TracedCells;
use crate::steps::{light, materials};
use fit::fit_to_reflections;

pub use options::Options;

/// Least error of what highlights tell about the scale under a light that was fitted to them, log units.
const SYSTEMATIC: f32 = 0.1;
/// Share of the materials' cost that such a light has to save: it fits errors of normals too.
const LEAST_SAVING: f32 = 0.08;
/// Share of that which a round has to save for another one to follow.
const WORTH_ANOTHER: f32 = 0.5;

/// Fits the light to what glossy parts and metals reflect, and keeps it when materials then explain the photos better. Nothing is
/// done, and told, where the light is known or nothing reflects.
///
/// # Errors
/// When a pixel whose base color is given shows no surface.
pub fn run(
    state: &mut State<'_>,
    options: &Options,
    by_shading: &light::Options,
    of_materials: &materials::Options,
) -> Result<Option<Term>, DecomposeError> {
    let mut traced = TracedCells::default();
    let is_told = !state.inputs.known.lights.is_empty();
    let reflects = state.illumination.materials.reflects();
    if !(options.weight_reflected_light > 0.0) || is_told || !reflects {
        return Ok(None);
    }
    let problem = LightProblem::of(state, by_shading);
    let mut fitted: Option<Illumination> = None;
    for _ in 0..options.reflected_light_rounds {
        // Materials that were found under a light too soft may be other ones under this.
        let now = fitted.as_ref().unwrap_or(&state.illumination);
        if !now.materials.reflects() {
            break;
        }
        let mut cells = now.cells.clone();
        let weight = options.weight_reflected_light;
        fit_to_reflections(&problem, &mut cells, &now.materials, weight, &mut traced);
        let lights: Vec<_> = cells.iter().map(environment).collect();
        let mut next = Illumination {
            materials: FoundMaterials::default(),
            base_color_factor: now.base_color_factor,
            anchor: now.anchor,
            lamp_of_vertex: now.lamp_of_vertex.clone(),
            cells,
            lights,
        };
        next.materials = materials::find_materials(state, &next, of_materials);
        materials::rescale(state, &mut next, SYSTEMATIC, of_materials)?;
        let saved = 1.0 - next.materials.cost() / state.illumination.materials.cost();
        fitted = Some(next);
        if saved < f64::from(WORTH_ANOTHER * LEAST_SAVING) {
            break;
        }
    }
    let Some(fitted) = fitted else { return Ok(None) };
    let cost = [state.illumination.materials.cost(), fitted.materials.cost()];
    let kept = cost[1] < f64::from(1.0 - LEAST_SAVING) * cost[0];
    if kept {
        state.illumination = fitted;
    }
    Ok(Some(term(cost, kept)))
}

fn term(cost: [f64; 2], kept: bool) -> Term {
    let change = 100.0 * (cost[1] / cost[0].max(f64::MIN_POSITIVE) - 1.0);
    let but = if kept {
        String::new()
    } else {
        format!(", and has to fall by {:.0} %", 100.0 * LEAST_SAVING)
    };
    Term {
        name: "light by reflections".into(),
        kept,
        evidence: format!(
            "the cost of the materials changes by {change:+.1} % under a light that is fitted to what is reflected{but}"
        ),
        numbers: numbers([("cost_before", Some(cost[0])), ("cost", Some(cost[1]))]),
    }
}
