//! What a prior of the light is given and what it adds.

use std::f32::consts::PI;

use glam::Vec3;

use crate::illumination::CellLight;
use crate::illumination::seen_sky::SeenSky;
use crate::steps::light::cost::SolveOptions;

/// A prior of the light: a file in this folder, named in [`super::LIGHT_PRIORS`]. It acts on what points receive and on the
/// base colors that follow, or on the cells, or on both.
pub trait LightPrior: Sync {
    /// Its name in `--light-prior NAME=WEIGHT`.
    fn name(&self) -> &'static str;

    /// A line for the help.
    fn about(&self) -> &'static str;

    /// The flag of its own that weighs it, in place of `--light-prior`.
    fn flag(&self) -> Option<&'static str> {
        None
    }

    /// Its weight in a solve where `--light-prior` says nothing.
    fn usual_weight(&self, _options: &SolveOptions) -> f32 {
        0.0
    }

    /// Its weight in a solve: what `--light-prior` said.
    fn weight(&self, options: &SolveOptions) -> f32 {
        let own = options.others.iter().filter(|(name, _)| *name == self.name());
        let said = own.map(|(_, weight)| *weight).reduce(|a, b| a + b);
        said.unwrap_or_else(|| self.usual_weight(options))
    }

    /// Adds its cost and slopes by what points receive and by their base colors.
    fn add_points(&self, _light: &Lighting<'_>, _weight: f32, _sum: &mut PointSum) {}

    /// Adds its cost and slopes by the cells.
    fn add_cells(&self, _light: &Lighting<'_>, _weight: f32, _sum: &mut CellSum) {}
}

/// What is known of the cells and lamps of a light, whatever they send.
pub struct Sources {
    /// Number of lamps, whose radiances follow those of the cells of each light.
    pub lamps: usize,
    /// Cells of one light that touch.
    pub neighbors: Vec<(u32, u32)>,
    /// Sine of the elevation of every cell.
    pub heights: Vec<f32>,
    /// Logarithm of the radiance that is expected of every cell, where photos show a sky.
    pub expected: Vec<Option<Vec3>>,
    /// Whether the sky may be brighter than is expected, by one factor per channel: photos show it clipped.
    pub sky_is_clipped: bool,
}

impl Sources {
    /// Those of a light under a sky.
    pub(in crate::steps::light) fn of(light: &CellLight, sky: &SeenSky) -> Self {
        Self {
            lamps: light.lamps.len(),
            neighbors: light.neighbors(),
            heights: light.cells.iter().map(|cell| (PI * (cell.v + 0.5 * cell.dv)).cos()).collect(),
            expected: light.cells.iter().map(|cell| sky.expected(cell)).collect(),
            sky_is_clipped: sky.is_clipped(),
        }
    }
}

/// A light while it is solved for.
pub struct Lighting<'a> {
    /// Log radiance of every cell, photo units; channels interleaved, one light after the other.
    pub theta: &'a [f32],
    /// Number of lights, which have the same cells.
    pub lights: usize,
    /// The cells and lamps of each light.
    pub sources: &'a Sources,
    /// Irradiance over π of every point, photo units.
    pub shading: &'a [Vec3],
    /// Logarithm of the base color that follows, of every point.
    pub log_base: &'a [Vec3],
    /// Weights and schedule.
    pub options: &'a SolveOptions,
}

impl Lighting<'_> {
    /// Values of [`Self::theta`] that belong to one light.
    pub(in crate::steps::light) fn per_light(&self) -> usize {
        (self.theta.len() / self.lights.max(1)).max(1)
    }

    /// The first of them that are cells.
    pub(in crate::steps::light) fn of_cells(&self) -> usize {
        self.per_light() - (3 * self.sources.lamps).min(self.per_light())
    }
}

/// Slopes by a logarithm, of every point.
pub enum Slopes {
    /// The same for all.
    Even(Vec3),
    /// One per point.
    Each(Vec<Vec3>),
}

impl Slopes {
    fn at(&self, p: usize) -> Vec3 {
        match self {
            Self::Even(slope) => *slope,
            Self::Each(slopes) => slopes[p],
        }
    }
}

/// Cost, and its slopes by the logarithms of irradiance and of base color. Summed in the order in which they are added: the
/// bits depend on it.
#[derive(Default)]
pub struct PointSum {
    /// The cost.
    pub cost: f64,
    /// By `log S`, base colors held.
    pub by_log_shading: Vec<Slopes>,
    /// By `log b`.
    pub by_log_base: Vec<Slopes>,
}

impl PointSum {
    /// `(∂F/∂log S - ∂F/∂log b) / S`: the slope by irradiance over π of point `p`.
    pub(in crate::steps::light) fn by_shading(&self, p: usize, shading: Vec3) -> Vec3 {
        let direct = self.by_log_shading.iter().fold(Vec3::ZERO, |sum, slopes| sum + slopes.at(p));
        let both = self.by_log_base.iter().fold(direct, |sum, slopes| sum - slopes.at(p));
        both / shading
    }
}

/// Cost, and its gradient by `θ`, in the order of [`Lighting::theta`].
pub struct CellSum {
    /// The cost.
    pub cost: f64,
    /// The gradient.
    pub gradient: Vec<f32>,
}
