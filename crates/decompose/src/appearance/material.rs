//! Materials of the parts of a surface, and what they tell about the brightness of the light.

use glam::Vec3;
use motes_math::median::upper_median;
use motes_scene::Surface;

use crate::observation::Sample;

/// What a material may be, apart from roughness.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Kind {
    /// No specular lobe.
    Matte,
    /// Diffuse under a coat.
    Dielectric,
    /// Specular only, colored.
    Metal,
}

/// Material of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartMaterial {
    /// Its kind.
    pub kind: Kind,
    /// Perceptual.
    pub roughness: f32,
    /// Base color of the whole part, for a metal: what it reflects errs with its normals far more than metals are
    /// textured.
    pub metal_color_linear: Option<Vec3>,
    /// Number of samples.
    pub samples: usize,
    /// Cost per sample of the label that was taken, of the best without a specular lobe, of the best dielectric
    /// and of the best metal.
    pub costs: [f32; 4],
}

/// Materials of all parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FoundMaterials {
    /// Part of every sample.
    pub of_sample: Vec<u32>,
    /// The parts.
    pub parts: Vec<PartMaterial>,
    /// Base color of every sample under the material of its part.
    pub base_color_linear: Vec<Vec3>,
    /// Share of the cost without highlights that highlights save.
    pub specular_gain: f32,
    /// Mean squared error that the best material of every point leaves, over that which is taken for noise; outliers count less.
    pub misfit: f32,
    /// Whether that is too much for metal to be told from errors of the surface and the light.
    pub is_metal_untold: bool,
    /// What highlights say about the brightness of the light.
    pub scale: ScaleEvidence,
}

impl FoundMaterials {
    /// Cost of all parts under their materials.
    pub(crate) fn cost(&self) -> f64 {
        self.parts.iter().map(|p| f64::from(p.costs[0]) * p.samples as f64).sum()
    }

    /// Whether any part has a specular lobe.
    pub fn reflects(&self) -> bool {
        self.parts.iter().any(|p| p.kind != Kind::Matte)
    }

    /// Metals take over the roughness that was found together with their normals: the median over the points of a part.
    pub(crate) fn take_roughness(
        &mut self,
        samples: &[Sample],
        surface: &Surface,
        of_vertex: &[Option<f32>],
    ) {
        let mut all: Vec<Vec<f32>> = vec![Vec::new(); self.parts.len()];
        for (sample, &part) in samples.iter().zip(&self.of_sample) {
            let corners = surface.triangles[sample.triangle as usize];
            all[part as usize].extend(corners.iter().filter_map(|&v| of_vertex[v as usize]));
        }
        for (part, values) in self.parts.iter_mut().zip(&mut all) {
            if part.kind == Kind::Metal
                && let Some(roughness) = upper_median(values, f32::total_cmp)
            {
                part.roughness = roughness;
            }
        }
    }
}

/// Points of a part that count at most: what is wrong about it is wrong for all of it.
pub(crate) const PART_SAMPLES: f32 = 150.0;

/// How much of a difference between channels is believed: light is nearly white.
const CHANNEL_TRUST: f32 = 0.5;

/// What was weighed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScaleEvidence {
    /// Logarithm of the factor on the light under which highlights are explained best; 0 without highlights.
    pub highlights: f32,
    /// Logarithm of the factor on the light that makes base colors what they usually are.
    pub usual: f32,
    /// Certainty of what is usual: inverse square of log units.
    pub usual_trust: f32,
    /// Least logarithm of the factor: no surface reflects more than it receives.
    pub least: f32,
    /// What highlights say of the channels beside that, as far as parts agree.
    pub tint: Vec3,
    /// Half width of the interval in which highlights alone are satisfied to half a unit of evidence, in log
    /// units; infinite without highlights.
    pub log_spread: f32,
    /// Samples whose highlights counted.
    pub samples: usize,
}

impl ScaleEvidence {
    /// Factor on the light, per channel, when highlights err by `systematic` at least (log units).
    pub fn factor(&self, systematic: f32) -> Vec3 {
        // First one factor for all channels; then each on its own, held near the common one.
        let trust = self.log_spread.max(systematic).powi(-2);
        let common = (self.highlights * trust + self.usual * self.usual_trust)
            / (trust + self.usual_trust).max(1e-6);
        // What no surface can be, a base color above 1, is stronger than either.
        (Vec3::splat(common.max(self.least)) + self.tint * CHANNEL_TRUST).map(f32::exp)
    }
}
