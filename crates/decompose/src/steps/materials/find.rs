//! Parts, their materials, and the scale of the light that highlights tell.

use glam::Vec3;
use motes_scene::{ScaleAnchor, Switch};
use motes_shading::integrate::IntegrationOptions;

use super::borders::find_regions;
use super::contrast::contrast_roughness;
use super::mirrors;
use super::options::Options;
use super::profile::{Label, Profile};
use super::regions::{Claim, RegionOptions, Regions, beside};
use super::scale::{Surroundings, weigh_scale};
use super::telling::{Shown, without_weak_highlights};
use crate::appearance::basis::Basis;
use crate::appearance::{
    BasisScene, FoundMaterials, Kind, ModelOptions, PartMaterial, ScaleEvidence,
};
use crate::observation::{Observed, Sample};
use crate::parabola::least_of_parabola;
use crate::state::{Illumination, State};

/// Values of roughness that are compared; between them a parabola decides.
pub(super) const ROUGHNESS: [f32; 10] = [0.05, 0.1, 0.15, 0.2, 0.28, 0.36, 0.45, 0.6, 0.75, 0.9];

/// Finds parts and their materials under this light, which need not be that of the state.
pub(crate) fn find_materials(
    state: &State<'_>,
    light: &Illumination,
    options: &Options,
) -> FoundMaterials {
    let Observed { scene, samples, vertex_radiance, .. } = &state.observed;
    let model = state.inputs.model;
    let brdf_samples = (options.material_rays / 3).max(1);
    let emitters = light.emitters(scene);
    let basis_scene = BasisScene {
        scene,
        lights: &light.lights,
        emitters: emitters.as_ref(),
        vertex_radiance,
        lobes: model.lobes,
        options: IntegrationOptions {
            light_samples: (options.material_rays - brdf_samples.min(options.material_rays)).max(1),
            brdf_samples,
            ray_bias: state.ray_bias(),
            seed: state.inputs.seed,
            ..IntegrationOptions::default()
        },
    };
    let basis = basis_scene.integrate(samples, &ROUGHNESS);
    let mut profile = Profile::new(samples, &basis, &|label| price(label, model, options));
    let misfit = profile.misfit(samples);
    let is_metal_untold = model.metallic == Switch::Auto && misfit > WORST_FIT;
    if is_metal_untold {
        profile.forbid(|label| label.kind == Kind::Metal);
    }
    let region_options = RegionOptions {
        pieces: 200,
        price: options.weight_smooth_roughness,
        evidence: 0.2,
        border: 0.3,
        neighbors: &beside(samples),
    };
    let mut claims = vec![Claim::None; samples.len()];
    let mut regions = match model.metallic {
        Switch::Auto => {
            let shown = Shown::of(samples);
            let regions =
                believable_regions(samples, &profile, &shown, &region_options, &mut claims);
            let metal_part = |p: usize| {
                let is_metal = regions.kind(p, &profile) == Kind::Metal;
                is_metal.then_some(regions.of_sample[p])
            };
            let has_claimed = !is_metal_untold
                && mirrors::claim(samples, &profile, &shown, &basis, &metal_part, &mut claims);
            match has_claimed {
                true => find_regions(samples, &profile, &region_options, &claims),
                false => regions,
            }
        }
        _ => find_regions(samples, &profile, &region_options, &claims),
    };
    if model.specular == Switch::Auto {
        without_weak_highlights(&profile, &mut regions, &ROUGHNESS);
    }
    let specular_gain = gain(&profile, &regions);
    if model.specular == Switch::Auto && specular_gain < LEAST_GAIN {
        profile.forbid(|label| label.kind == Kind::Dielectric);
        claims.iter_mut().filter(|c| **c == Claim::None).for_each(|c| *c = Claim::NoMetal);
        regions = find_regions(samples, &profile, &region_options, &claims);
    }
    let surroundings =
        Surroundings { has_lamps: emitters.is_some(), has_sky: light.anchor == ScaleAnchor::Sky };
    let scale = weigh_scale(samples, &basis, &profile, &regions, model, surroundings);
    FoundMaterials {
        specular_gain,
        misfit,
        is_metal_untold,
        ..collect(&basis, &profile, regions, samples, scale, model.uniform_metal)
    }
}

/// Times that parts are found without the metals that were doubted before; then there are none.
const DOUBTS: usize = 3;

/// Parts of which those that are called metal move with the viewer as metals do; what does not is claimed to be none.
fn believable_regions(
    samples: &[Sample],
    profile: &Profile,
    shown: &Shown,
    options: &RegionOptions<'_>,
    claims: &mut [Claim],
) -> Regions {
    for _ in 0..DOUBTS {
        let regions = find_regions(samples, profile, options, claims);
        let doubted = shown.doubtful_metals(samples, profile, &regions, &ROUGHNESS);
        if !doubted.contains(&true) {
            return regions;
        }
        for (claim, _) in claims.iter_mut().zip(doubted).filter(|(_, doubted)| *doubted) {
            *claim = Claim::NoMetal;
        }
    }
    claims.fill(Claim::NoMetal);
    find_regions(samples, profile, options, claims)
}

/// What a specular lobe costs a part, in units of the profile's cost: a free roughness always explains a little.
const COAT_PRICE: f32 = 6.0;
/// A scene whose views are explained better by highlights by less than this share has none.
pub(super) const LEAST_GAIN: f32 = 0.08;

/// Misfit from which no metal is told. A scene whose photos even the best material of every point explains this badly has errors
/// of surface and light that are alike in all photos of a point; a metal, which shows what is around it, fits some of them better.
const WORST_FIT: f32 = 1.6;

/// From here on a metal is not told from a dielectric under a coat by a handful of views, and rare.
const ROUGHEST_METAL: f32 = 0.75;

/// Cost of a kind per part; infinite where it is not allowed.
fn price(label: &Label, model: &ModelOptions, options: &Options) -> f32 {
    let coat = match model.specular {
        Switch::Off => f32::INFINITY,
        Switch::On => 0.0,
        Switch::Auto => COAT_PRICE,
    };
    let is_rough = ROUGHNESS[label.roughness] >= ROUGHEST_METAL;
    match (label.kind, model.specular, model.metallic) {
        (Kind::Matte, Switch::On, _) => f32::INFINITY,
        (Kind::Matte, ..) => 0.0,
        (Kind::Dielectric, ..) => coat,
        (Kind::Metal, _, Switch::Off) => f32::INFINITY,
        (Kind::Metal, _, Switch::Auto) if is_rough => f32::INFINITY,
        (Kind::Metal, ..) => coat + options.weight_sparse_metal,
    }
}

/// Share of the cost without highlights that the labels of the parts save.
fn gain(profile: &Profile, regions: &Regions) -> f32 {
    let matte = profile.labels.iter().position(|l| l.kind == Kind::Matte).unwrap_or(0);
    let (with, without) = regions
        .label
        .iter()
        .zip(&regions.costs)
        .fold((0.0, 0.0), |(a, b), (&label, costs)| (a + costs[label], b + costs[matte]));
    if without > 0.0 { 1.0 - with / without } else { 0.0 }
}

fn collect(
    basis: &Basis,
    profile: &Profile,
    regions: Regions,
    samples: &[Sample],
    scale: ScaleEvidence,
    uniform_metal: bool,
) -> FoundMaterials {
    let mut counts = vec![0usize; regions.label.len()];
    regions.of_sample.iter().for_each(|&part| counts[part as usize] += 1);
    let parts: Vec<PartMaterial> = regions
        .label
        .iter()
        .zip(&regions.costs)
        .zip(counts)
        .enumerate()
        .map(|(part, ((&label, costs), count))| {
            let of = |kind: Kind| {
                let costs = profile.labels.iter().zip(costs).filter(|(l, _)| l.kind == kind);
                costs.map(|(_, c)| *c).fold(f32::INFINITY, f32::min) / count.max(1) as f32
            };
            let Label { kind, roughness } = profile.labels[label];
            let metal = (kind == Kind::Metal)
                .then(|| metal_color(basis, samples, &regions.of_sample, part, roughness));
            PartMaterial {
                kind,
                metal_color_linear: metal.filter(|_| uniform_metal),
                roughness: match metal {
                    Some(color) => {
                        let fitted = refined(profile, costs, kind, roughness, &basis.roughness);
                        let of_contrast =
                            contrast_roughness(basis, samples, &regions.of_sample, part, color);
                        // One errs upwards with the normals, the other downwards where the light found is too soft.
                        (fitted * of_contrast.min(fitted)).sqrt()
                    }
                    None => refined(profile, costs, kind, roughness, &basis.roughness),
                },
                samples: count,
                costs: [
                    costs[label] / count.max(1) as f32,
                    of(Kind::Matte),
                    of(Kind::Dielectric),
                    of(Kind::Metal),
                ],
            }
        })
        .collect();
    let base = |p: usize| {
        if let Some(color) = parts[regions.of_sample[p] as usize].metal_color_linear {
            return color;
        }
        let label = regions.label[regions.of_sample[p] as usize];
        profile.base_color_linear[p * profile.labels.len() + label]
    };
    FoundMaterials {
        base_color_linear: (0..samples.len()).map(base).collect(),
        of_sample: regions.of_sample,
        parts,
        specular_gain: 0.0,
        misfit: 0.0,
        is_metal_untold: false,
        scale,
    }
}

/// Index of the roughness that metal colors are read off with at most: a wide lobe would spread the sun over all views,
/// where the cut cannot remove it.
pub(super) const NARROW: usize = 3;

/// `Σ (L - B) / Σ A` over all that is seen of a part, per channel, both cut at their 90th percentile: wrong normals
/// move reflections about but keep their sum, and a sun that one of the two misses must not rule it.
pub(super) fn metal_color(
    basis: &Basis,
    samples: &[Sample],
    of_sample: &[u32],
    part: usize,
    roughness: usize,
) -> Vec3 {
    let mut seen: [[Vec<f32>; 2]; 3] = Default::default();
    for (p, sample) in samples.iter().enumerate().filter(|(p, _)| of_sample[*p] as usize == part) {
        for (k, o) in sample.observations.iter().enumerate() {
            let terms = basis.at(p, k, roughness.min(NARROW));
            for (c, [light, slope]) in seen.iter_mut().enumerate() {
                light.push((o.radiance[c] - terms.metal_offset[c]).max(0.0));
                slope.push(terms.metal_slope[c]);
            }
        }
    }
    let cut_sum = |mut values: Vec<f32>| {
        values.sort_by(f32::total_cmp);
        let high = values.get(values.len() * 9 / 10).copied().unwrap_or(0.0);
        values.iter().map(|v| v.min(high)).sum::<f32>()
    };
    let ratio =
        |[light, slope]: [Vec<f32>; 2]| (cut_sum(light) / cut_sum(slope).max(1e-6)).min(1.0);
    Vec3::from(seen.map(ratio))
}

/// Minimum of the parabola through the costs of a roughness and its neighbors of the same kind.
fn refined(profile: &Profile, costs: &[f32], kind: Kind, at: usize, grid: &[f32]) -> f32 {
    if kind == Kind::Matte {
        return 1.0;
    }
    let cost = |roughness: usize| {
        let label = profile.labels.iter().position(|l| *l == Label { kind, roughness });
        label.map_or(f64::INFINITY, |l| f64::from(costs[l]))
    };
    let curve: Vec<f64> = (0..grid.len()).map(cost).collect();
    least_of_parabola(grid, &curve, at)
}
