//! The JSON documents of a work folder.

use crate::steps::surface::GeometryReport;
use crate::{Cell, Pipeline, StepRecord, Term};
use motes_formats::documents::Document;
use motes_scene::ScaleAnchor;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// `step.json`: a step that has run, and the numbers of the state after it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub(super) struct StepDocument {
    pub format: String,
    pub version: String,
    pub made_by: String,
    /// Name of the step.
    pub step: String,
    /// SHA-256 of the `step.json` of the step before.
    pub previous: Option<String>,
    /// The files that the run was given.
    pub inputs: Vec<InputDocument>,
    /// Number of photos that the run looked at; 0 before version 1.1.
    #[serde(default)]
    pub photos: usize,
    /// Elapsed seconds.
    pub seconds: f64,
    /// What the step modeled or left out, and why.
    #[schemars(with = "Value")]
    pub terms: Vec<Term>,
    /// How the surface was extracted, of the first step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Value")]
    pub geometry: Option<GeometryReport>,
    /// Unit vector away from the ground.
    pub up_in_world: [f32; 3],
    /// Median distance between cameras and points of the first surface, world units.
    pub camera_distance: f32,
    /// About how many points of the surface were asked for.
    pub wanted_samples: usize,
    /// Observations that were kept of each at most; 0 for all.
    #[serde(default)]
    pub wanted_observations: usize,
    /// Lights of which one bounce belongs to the model.
    pub indirect_lights: usize,
    /// Cells of the light after every round.
    pub light_cells: Vec<usize>,
}

impl Document for StepDocument {
    const FORMAT: &'static str = "motes/decompose-step";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 1;
}

/// A file that a run was given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub(in crate::files) struct InputDocument {
    /// The word of the flag.
    pub role: String,
    pub sha256: String,
}

impl StepDocument {
    /// Of the last step that has run.
    pub(super) fn of(
        pipeline: &Pipeline<'_>,
        inputs: Vec<InputDocument>,
        previous: Option<String>,
        made_by: &str,
    ) -> Self {
        let (state, report) = (&pipeline.state, &pipeline.report);
        let record = report.steps.last().cloned();
        let StepRecord { name, seconds, terms } = record.unwrap_or_default();
        Self {
            format: Self::FORMAT.into(),
            version: Self::version(),
            made_by: made_by.into(),
            step: name,
            previous,
            inputs,
            photos: state.inputs.photos.len(),
            seconds,
            terms,
            geometry: (report.steps.len() == 1).then(|| report.geometry.clone()),
            up_in_world: state.up_in_world.to_array(),
            camera_distance: state.camera_distance,
            wanted_samples: state.observed.wanted.points,
            wanted_observations: state.observed.wanted.observations,
            indirect_lights: state.observed.vertex_radiance.len(),
            light_cells: state.light_cells.clone(),
        }
    }

    pub(super) fn record(&self) -> StepRecord {
        let (name, terms) = (self.step.clone(), self.terms.clone());
        StepRecord { name, seconds: self.seconds, terms }
    }
}

/// `light.json`: the light of every capture as cells of a lat-long map, and the scale that it was brought to.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub(super) struct LightDocument {
    pub format: String,
    pub version: String,
    pub made_by: String,
    /// What the scale of light against base color rests on.
    pub anchor: ScaleAnchor,
    /// Factor that the anchor put on base colors, linear RGB.
    pub base_color_factor: [f32; 3],
    /// The cells, which all captures share; none when the light is known.
    pub cells: Vec<CellDocument>,
    /// Per capture and cell: linear RGB radiance, photo units.
    pub radiance: Vec<Vec<[f32; 3]>>,
    /// Pieces of the surface that shine.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lamps: Vec<LampDocument>,
    /// What the light at infinity does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub local_light: Option<LocalLightDocument>,
}

/// A factor on the irradiance that varies smoothly over the scene.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub(super) struct LocalLightDocument {
    /// Distance over which it changes, world units.
    pub reach: f32,
    /// Where it is known.
    pub anchors: Vec<LightAnchorDocument>,
}

/// The factor at a place.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
pub(super) struct LightAnchorDocument {
    /// World.
    pub position: [f32; 3],
    /// Unit normal of the surface there.
    pub normal: [f32; 3],
    /// Natural logarithm of the factor on the irradiance, linear RGB.
    pub log_factor: [f32; 3],
}

/// A piece of the surface that shines.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub(super) struct LampDocument {
    /// Linear RGB radiance, photo units.
    pub radiance: [f32; 3],
    /// What the photos show of it before they clip, photo units.
    pub seen: [f32; 3],
    /// Its vertices, as rows of `surface.ply`.
    pub vertices: Vec<u32>,
}

impl Document for LightDocument {
    const FORMAT: &'static str = "motes/decompose-light";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 2;
}

/// A rectangle of the map in `u` and `v`, 0 to 1 from its upper left corner.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
pub(super) struct CellDocument {
    pub u: f32,
    pub v: f32,
    pub du: f32,
    pub dv: f32,
    /// How often it was divided.
    pub level: u32,
}

impl From<Cell> for CellDocument {
    fn from(Cell { u, v, du, dv, level }: Cell) -> Self {
        Self { u, v, du, dv, level }
    }
}

impl From<CellDocument> for Cell {
    fn from(CellDocument { u, v, du, dv, level }: CellDocument) -> Self {
        Self { u, v, du, dv, level }
    }
}
