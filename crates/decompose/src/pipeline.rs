//! The list of the steps, and how it is run: whole, from a step on, or up to one.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::error::DecomposeError;
use crate::options::DecomposeOptions;
use crate::progress::Tick;
use crate::report::Term;
use crate::state::{Inputs, State};
use crate::steps::surface::GeometryReport;
use crate::steps::{
    appearance_residual, attributes, base_color, evaluation, light, materials, refinement,
    reflected_light, samples, shading, shape_from_reflection, shape_from_shading, surface,
};

/// A step of the pipeline.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Its name in flags and files.
    pub name: &'static str,
    /// What it does, for the line of progress.
    pub doing: &'static str,
    /// Its usual share of the time of all.
    share: f32,
    run: Run,
}

type Run = fn(
    &mut State<'_>,
    &DecomposeOptions,
    &mut Report,
    &mut Tick<'_>,
) -> Result<Vec<Term>, DecomposeError>;

/// The steps, in their order.
pub const STEPS: [Step; 13] = [
    Step {
        name: "surface",
        doing: "extracting the surface",
        share: 0.4,
        run: |state, options, report, tick| {
            report.geometry = surface::run(state, &options.surface, tick)?;
            Ok(Vec::new())
        },
    },
    Step {
        name: "samples",
        doing: "choosing samples",
        share: 0.02,
        run: |state, options, _, _| {
            samples::run(state, &options.samples)?;
            Ok(Vec::new())
        },
    },
    Step {
        name: "light",
        doing: "fitting light",
        share: 0.13,
        run: |state, options, _, _| Ok(light::run(state, &options.light)),
    },
    Step {
        name: "materials",
        doing: "finding materials",
        share: 0.09,
        run: |state, options, _, tick| {
            materials::run(state, &options.materials, tick)?;
            Ok(Vec::new())
        },
    },
    Step {
        name: "reflected-light",
        doing: "fitting light to reflections",
        share: 0.01,
        run: |state, options, _, _| {
            let DecomposeOptions { reflected_light, light, materials, .. } = options;
            let term = reflected_light::run(state, reflected_light, light, materials)?;
            Ok(term.into_iter().collect())
        },
    },
    Step {
        name: "shape-from-shading",
        doing: "computing shape from shading",
        share: 0.025,
        run: |state, options, _, _| {
            let DecomposeOptions { shape_from_shading, materials, .. } = options;
            let term = shape_from_shading::run(state, shape_from_shading, materials)?;
            Ok(term.into_iter().collect())
        },
    },
    Step {
        name: "shape-from-reflection",
        doing: "computing shape from reflection",
        share: 0.025,
        run: |state, options, _, tick| {
            let DecomposeOptions { shape_from_reflection, materials, .. } = options;
            let term = shape_from_reflection::run(state, shape_from_reflection, materials, tick)?;
            Ok(term.into_iter().collect())
        },
    },
    Step {
        name: "shading",
        doing: "integrating shading",
        share: 0.025,
        run: |state, options, _, tick| {
            shading::run(state, &options.shading, tick)?;
            Ok(Vec::new())
        },
    },
    Step {
        name: "base-color",
        doing: "fitting base colors",
        share: 0.025,
        run: |state, options, _, _| {
            base_color::run(state, &options.base_color);
            Ok(Vec::new())
        },
    },
    Step {
        name: "refinement",
        doing: "refining Gaussians",
        share: 0.125,
        run: |state, options, _, tick| {
            refinement::run(state, &options.refinement, tick)?;
            Ok(Vec::new())
        },
    },
    Step {
        name: "attributes",
        doing: "attaching materials to Gaussians",
        share: 0.02,
        run: |state, _, _, _| {
            attributes::run(state);
            Ok(Vec::new())
        },
    },
    Step {
        name: "appearance-residual",
        doing: "fitting the appearance residual",
        share: 0.1,
        run: |state, options, _, tick| {
            let term = appearance_residual::run(state, &options.appearance_residual, tick)?;
            Ok(term.into_iter().collect())
        },
    },
    Step {
        name: "evaluation",
        doing: "rendering views",
        share: 0.005,
        run: |state, _, _, _| Ok(evaluation::run(state).to_vec()),
    },
];

/// Index of the step of this name.
pub fn step_named(name: &str) -> Option<usize> {
    STEPS.iter().position(|step| step.name == name)
}

/// What a step told, and how long it took.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// Name of the step.
    pub name: String,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// What was modeled or left out, and why.
    pub terms: Vec<Term>,
}

/// What the steps told.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// What the camera did to the photos.
    #[serde(default)]
    pub photometry: Vec<Term>,
    /// How the surface was extracted.
    pub geometry: GeometryReport,
    /// The steps that have run.
    pub steps: Vec<StepRecord>,
}

impl Report {
    /// What was modeled or left out in the end, and why: the camera, lobes, the terms of the steps, the parts of the surface, the
    /// appearance residual.
    pub fn terms(&self, state: &State<'_>) -> Vec<Term> {
        let found = &state.illumination.materials;
        let last = |step: &&StepRecord| step.name == "appearance-residual";
        let of = |wanted: bool| {
            let steps = self.steps.iter().filter(move |step| last(step) == wanted);
            steps.flat_map(|step| step.terms.iter().cloned())
        };
        let lobes = materials::lobe_terms(found).into_iter();
        let camera = self.photometry.iter().cloned();
        camera
            .chain(lobes)
            .chain(of(false))
            .chain(materials::part_terms(found))
            .chain(of(true))
            .collect()
    }
}

/// Where a run is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// What the step does.
    pub doing: &'static str,
    /// Number of the step, from 1.
    pub step: usize,
    /// Number of all steps.
    pub of: usize,
    /// Share of the work of all steps that is done, 0 to 1.
    pub done: f32,
}

/// A decomposition on its way.
#[derive(Debug)]
pub struct Pipeline<'a> {
    /// What the steps work on.
    pub state: State<'a>,
    /// What they told so far.
    pub report: Report,
}

impl<'a> Pipeline<'a> {
    /// Before the first step.
    ///
    /// # Errors
    /// As [`State::new`].
    pub fn new(inputs: &'a Inputs<'a>) -> Result<Self, DecomposeError> {
        Ok(Self { state: State::new(inputs)?, report: Report::default() })
    }

    /// Runs all steps.
    ///
    /// # Errors
    /// What a step or the observer says.
    pub fn run_all(
        &mut self,
        options: &DecomposeOptions,
        observer: &mut dyn FnMut(Progress) -> Result<(), DecomposeError>,
    ) -> Result<(), DecomposeError> {
        (0..STEPS.len()).try_for_each(|step| self.run(step, options, observer))
    }

    /// Runs one step.
    ///
    /// # Errors
    /// What the step or the observer says.
    pub fn run(
        &mut self,
        index: usize,
        options: &DecomposeOptions,
        observer: &mut dyn FnMut(Progress) -> Result<(), DecomposeError>,
    ) -> Result<(), DecomposeError> {
        let step = &STEPS[index];
        let before: f32 = STEPS[..index].iter().map(|s| s.share).sum();
        let mut tick = |done: f32| {
            let done = before + step.share * done;
            observer(Progress { doing: step.doing, step: index + 1, of: STEPS.len(), done })
        };
        tick(0.0)?;
        let start = Instant::now();
        let terms = (step.run)(&mut self.state, options, &mut self.report, &mut tick)?;
        let seconds = start.elapsed().as_secs_f64();
        self.report.steps.push(StepRecord { name: step.name.into(), seconds, terms });
        Ok(())
    }
}
