//! Light, materials and the scale between the two, found in turn.

use glam::Vec3;
use motes_shading::environment::{Environment, Orientation};

use crate::decompose::{Anchor, Known};
use crate::evidence::anchored;
use crate::light::cells::CellLight;
use crate::light::find::{LightProblem, RAY_BIAS};
use crate::materials::find::{FoundMaterials, environment, find_materials};
use crate::materials::profile::Kind;
use crate::observed::Observed;
use crate::options::DecomposeOptions;

/// Spread of the scale, log units, up to which highlights count as an anchor.
const TELLING_SPREAD: f32 = 0.35;
/// Least error of what highlights tell about the scale, log units: normals and the shape of the light bend them all alike, so
/// more points do not make them surer.
const SYSTEMATIC: f32 = 0.2;
/// The same under a light that was fitted to what is reflected.
const SYSTEMATIC_FITTED: f32 = 0.1;
/// Share of the materials' cost that a light fitted to reflections has to save: it fits errors of normals too.
const LEAST_SAVING: f32 = 0.08;

/// What stays the same while light and materials are found.
pub(crate) struct Finder<'a> {
    pub known: &'a Known,
    pub options: &'a DecomposeOptions,
    pub orientation: Orientation,
    pub light_count: usize,
    /// Median distance between cameras and points, world units.
    pub distance: f32,
    /// Per sample of the first surface: logarithm of a predicted base colour.
    pub priors: Option<Vec<Vec3>>,
    pub seed: u64,
}

impl Finder<'_> {
    pub(crate) fn ray_bias(&self) -> f32 {
        RAY_BIAS * self.distance
    }

    pub(crate) fn materials(&self, seen: &Observed<'_>, lights: &[Environment]) -> FoundMaterials {
        let Observed { scene, samples, vertex_radiance, .. } = seen;
        let bias = self.ray_bias();
        find_materials(scene, samples, lights, vertex_radiance, bias, self.options, self.seed)
    }

    /// The search for the light on the first surface.
    pub(crate) fn problem<'a>(&'a self, seen: &'a Observed<'_>) -> LightProblem<'a> {
        LightProblem {
            scene: &seen.scene,
            samples: &seen.samples,
            vertex_radiance: &seen.vertex_radiance,
            lights: self.light_count,
            distance: self.distance,
            orientation: self.orientation,
            prior_log_base: self.priors.as_deref(),
        }
    }
}

/// What came of fitting the light to what is reflected.
#[derive(Clone, Copy, Debug)]
pub struct ReflectedLight {
    /// Cost of the materials, before and after.
    pub cost: [f64; 2],
    /// Whether that is enough to take it.
    pub kept: bool,
}

/// A light with the materials that go with it.
pub(crate) struct Illumination {
    /// Empty when the light is known.
    pub cells: Vec<CellLight>,
    pub lights: Vec<Environment>,
    pub materials: FoundMaterials,
    /// Factor that was put on base colours.
    pub factor: Vec3,
    pub anchor: Anchor,
    is_fitted: bool,
}

impl Illumination {
    pub(crate) fn new(
        finder: &Finder<'_>,
        seen: &Observed<'_>,
        cells: Vec<CellLight>,
        lights: Vec<Environment>,
    ) -> Self {
        let materials = finder.materials(seen, &lights);
        let anchor = Anchor::Environment;
        Self { cells, lights, materials, factor: Vec3::ONE, anchor, is_fitted: false }
    }

    /// Takes the light to the scale that known base colours, else highlights and what is usual tell, and finds materials anew: the scale
    /// moves what is a highlight and what is not.
    pub(crate) fn rescale(&mut self, finder: &Finder<'_>, seen: &Observed<'_>) {
        let systematic = if self.is_fitted { SYSTEMATIC_FITTED } else { SYSTEMATIC };
        let scale = &self.materials.scale;
        let by_base = anchored(&seen.samples, &self.materials, &finder.known.anchors);
        self.anchor = match by_base {
            Some(_) => Anchor::BaseColor,
            None if scale.log_spread < TELLING_SPREAD => Anchor::Specular,
            None => Anchor::Prior,
        };
        let on_light = by_base.unwrap_or_else(|| scale.factor(systematic));
        self.factor /= on_light;
        for light in &mut self.cells {
            light.radiance.iter_mut().for_each(|e| *e *= on_light);
        }
        self.lights = self.cells.iter().map(environment).collect();
        self.materials = finder.materials(seen, &self.lights);
    }

    fn reflects(&self) -> bool {
        self.materials.parts.iter().any(|p| p.kind != Kind::Matte)
    }

    /// Fits the light to what glossy parts and metals reflect, with materials and scale in turn, and says what came of it. None when nothing
    /// reflects, or it is not to count.
    pub(crate) fn by_reflections(
        &self,
        finder: &Finder<'_>,
        seen: &Observed<'_>,
        rounds: u32,
    ) -> Option<(Self, ReflectedLight)> {
        if !(finder.options.weight_reflected_light > 0.0) {
            return None;
        }
        let mut fitted: Option<Self> = None;
        for _ in 0..rounds {
            // Materials that were found under a light too soft may be other ones under this.
            let now = fitted.as_ref().unwrap_or(self);
            if !now.reflects() {
                break;
            }
            let mut cells = now.cells.clone();
            let problem = finder.problem(seen);
            problem.fit_to_reflections(&mut cells, &now.materials, finder.options, finder.seed);
            let lights: Vec<Environment> = cells.iter().map(environment).collect();
            let mut next = Self {
                materials: finder.materials(seen, &lights),
                factor: now.factor,
                anchor: now.anchor,
                is_fitted: true,
                cells,
                lights,
            };
            next.rescale(finder, seen);
            fitted = Some(next);
        }
        let fitted = fitted?;
        let cost = [self.materials.cost(), fitted.materials.cost()];
        let kept = cost[1] < f64::from(1.0 - LEAST_SAVING) * cost[0];
        Some((fitted, ReflectedLight { cost, kept }))
    }
}
