//! What is told about lobes and parts.

use super::find::LEAST_GAIN;
use crate::appearance::{FoundMaterials, Kind, PartMaterial};
use crate::report::{Term, numbers};
use crate::state::Illumination;
use motes_scene::ScaleAnchor;

/// Whether there are highlights and metals, and why.
pub fn lobe_terms(found: &FoundMaterials) -> [Term; 2] {
    let total: usize = found.parts.iter().map(|p| p.samples).sum();
    let share = |kind: Kind| {
        let of: usize = found.parts.iter().filter(|p| p.kind == kind).map(|p| p.samples).sum();
        of as f64 / total.max(1) as f64
    };
    let mean = |k: usize| {
        let sum: f64 = found.parts.iter().map(|p| f64::from(p.costs[k]) * p.samples as f64).sum();
        Some(sum / total.max(1) as f64)
    };
    let (glossy, metal) = (1.0 - share(Kind::Matte), share(Kind::Metal));
    let specular = Term {
        name: "specular".into(),
        kept: found.reflects(),
        evidence: if found.reflects() {
            format!("views differ as highlights do on {:.0} % of the points", 100.0 * glossy)
        } else {
            format!(
                "highlights explain the views better by {:.1} % only, less than the {:.0} % that a lobe must be worth",
                100.0 * found.specular_gain,
                100.0 * LEAST_GAIN
            )
        },
        numbers: numbers([("cost", mean(0)), ("cost_without", mean(1)), ("share", Some(glossy))]),
    };
    let metallic = Term {
        name: "metallic".into(),
        kept: metal > 0.0,
        evidence: if metal > 0.0 {
            let percent = 100.0 * metal;
            format!(
                "{percent:.1} % of the points are explained better without a diffuse lobe, or mirror what no material explains"
            )
        } else if found.is_metal_untold {
            format!(
                "even the best material of every point leaves {:.2} of the squared error that counts as noise: metal cannot be told from errors of surface and light; --metallic on allows it",
                found.misfit
            )
        } else {
            "no part is explained better without a diffuse lobe".into()
        },
        numbers: numbers([
            ("share", Some(metal)),
            ("misfit", Some(f64::from(found.misfit))),
            ("cost_best_dielectric", mean(2)),
            ("cost_best_metal", mean(3)),
        ]),
    };
    [specular, metallic]
}

/// Every part with its material.
pub fn part_terms(found: &FoundMaterials) -> Vec<Term> {
    found.parts.iter().enumerate().map(part_term).collect()
}

fn part_term((k, part): (usize, &PartMaterial)) -> Term {
    let kind = match part.kind {
        Kind::Matte => "matte",
        Kind::Dielectric => "dielectric",
        Kind::Metal => "metal",
    };
    let [cost, matte, dielectric, metal] = part.costs.map(|cost| Some(f64::from(cost)));
    Term {
        name: format!("part {k}"),
        kept: true,
        evidence: format!("{kind}, roughness {:.2}, {} points", part.roughness, part.samples),
        numbers: numbers([
            ("roughness", Some(f64::from(part.roughness))),
            ("points", Some(part.samples as f64)),
            ("cost", cost),
            ("cost_matte", matte),
            ("cost_dielectric", dielectric),
            ("cost_metal", metal),
        ]),
    }
}

/// What the scale of light against base color rests on, in a sentence.
pub fn scale_explanation(light: &Illumination) -> String {
    let evidence = &light.materials.scale;
    match light.anchor {
        ScaleAnchor::Environment => "the light was given".into(),
        ScaleAnchor::AlbedoAnchor => "base colors were given at points of the surface".into(),
        ScaleAnchor::Specular => {
            let spread = 100.0 * (evidence.log_spread.exp() - 1.0);
            format!(
                "highlights of {} points, whose coat reflects 4 % of the light whatever their base color, within {spread:.0} %, with what base colors usually are",
                evidence.samples
            )
        }
        ScaleAnchor::Sky => "photos show the sky, which is part of the light and, where they clip it, may be brighter".into(),
        ScaleAnchor::Prior => "nothing in the photos tells the scale: base colors were taken to be what they usually are; give --environment or --albedo-anchor to set it".into(),
    }
}
