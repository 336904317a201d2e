//! What `decompose` says when it is done.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use crate::Decomposition;
use crate::geometry::GeometryReport;
use crate::materials::profile::Kind;
use motes_formats::decomposition::{DecompositionDocument, TermDocument};
use serde::Serialize;

/// What was found, and how.
#[derive(Clone, Debug, Serialize)]
pub struct DecomposeReport {
    /// The scene folder.
    pub output: PathBuf,
    /// The document that was written.
    pub decomposition: DecompositionDocument,
    /// How the surface was found.
    pub geometry: GeometryReport,
    /// Points that light and material were fitted to.
    pub samples: usize,
    /// Cells of the light after every round.
    pub light_cells: Vec<usize>,
    /// CPU seconds of all threads; null where the system does not tell.
    pub cpu_seconds: Option<f64>,
    /// Mean PSNR of the training views under the light that was found, dB.
    pub train_psnr_db: Option<f64>,
    /// The same for held-out views.
    pub test_psnr_db: Option<f64>,
}

impl fmt::Display for DecomposeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let d = &self.decomposition;
        let db = |v: Option<f64>| v.map_or("none".into(), |v| format!("{v:.2} dB"));
        writeln!(
            f,
            "{} triangles, light of {} cells; re-rendered: train {}, test {}",
            d.counts.triangles,
            self.light_cells.last().copied().unwrap_or(0),
            db(self.train_psnr_db),
            db(self.test_psnr_db)
        )?;
        writeln!(f, "scale: {}", d.scale_anchor.explanation)?;
        for term in &d.terms {
            writeln!(
                f,
                "{} {}: {}",
                if term.kept { "kept" } else { "left out" },
                term.name,
                term.evidence
            )?;
        }
        writeln!(f, "scene: {}", self.output.display())
    }
}

/// What was modelled or left out, and why.
pub(crate) fn terms(result: &Decomposition) -> Vec<TermDocument> {
    let total: usize = result.parts.iter().map(|p| p.samples).sum();
    let share = |kind: Kind| {
        let of: usize = result.parts.iter().filter(|p| p.kind == kind).map(|p| p.samples).sum();
        of as f64 / total.max(1) as f64
    };
    let mean = |k: usize| {
        let sum: f64 = result.parts.iter().map(|p| f64::from(p.costs[k]) * p.samples as f64).sum();
        Some(sum / total.max(1) as f64).filter(|v| v.is_finite())
    };
    let metal = share(Kind::Metal);
    let mut all = vec![
        TermDocument {
            name: "specular".into(),
            kept: result.specular,
            evidence: if result.specular {
                format!(
                    "views differ as highlights do on {:.0} % of the points",
                    100.0 * (1.0 - share(Kind::Matte))
                )
            } else {
                format!(
                    "highlights explain the views better by {:.1} % only, less than the 8 % that a lobe must be worth",
                    100.0 * result.specular_gain
                )
            },
            numbers: numbers([
                ("cost", mean(0)),
                ("cost_without", mean(1)),
                ("share", Some(1.0 - share(Kind::Matte))),
            ]),
        },
        TermDocument {
            name: "metallic".into(),
            kept: metal > 0.0,
            evidence: if metal > 0.0 {
                format!(
                    "{:.1} % of the points are explained better without a diffuse lobe",
                    100.0 * metal
                )
            } else {
                "no part is explained better without a diffuse lobe".into()
            },
            numbers: numbers([
                ("share", Some(metal)),
                ("cost_best_dielectric", mean(2)),
                ("cost_best_metal", mean(3)),
            ]),
        },
        TermDocument {
            name: "indirect".into(),
            kept: result.indirect,
            evidence: format!(
                "{:.1} % of the irradiance comes from the surface itself",
                100.0 * result.indirect_share
            ),
            numbers: numbers([("share_of_irradiance", Some(f64::from(result.indirect_share)))]),
        },
    ];
    if let (Some(first), Some(last)) = (result.light_rounds.first(), result.light_rounds.last()) {
        all.push(TermDocument {
            name: "sharp light".into(),
            kept: last.0 > first.0,
            evidence: if last.0 > first.0 {
                format!(
                    "{} cells after dividing those that give more than 3 % of the light",
                    last.0
                )
            } else {
                "no cell of 11 degrees gives more than 3 % of the light".into()
            },
            numbers: numbers([("cost_smooth", Some(first.2)), ("cost", Some(last.2))]),
        });
    }
    if let Some(light) = &result.reflected_light {
        let change = 100.0 * (light.cost[1] / light.cost[0].max(f64::MIN_POSITIVE) - 1.0);
        all.push(TermDocument {
            name: "light by reflections".into(),
            kept: light.kept,
            evidence: format!(
                "the cost of the materials changes by {change:+.1} % under a light that is fitted to what is reflected{}",
                if light.kept { "" } else { ", and has to fall by 8 %" }
            ),
            numbers: numbers([
                ("cost_before", Some(light.cost[0])),
                ("cost", Some(light.cost[1])),
            ]),
        });
    }
    if let Some(relief) = &result.relief {
        all.push(TermDocument {
            name: "relief by shading".into(),
            kept: true,
            evidence: format!(
                "normals of {} vertices turned by {:.1} degrees on average, so that neighbours have one base color",
                relief.vertices, relief.turn_degrees
            ),
            numbers: numbers([
                ("cost_before", Some(relief.cost[0])),
                ("cost", Some(relief.cost[1])),
            ]),
        });
    }
    if let (Some(first), Some(last)) = (result.mirror_rounds.first(), result.mirror_rounds.last()) {
        all.push(TermDocument {
            name: "shape of metals by reflection".into(),
            kept: true,
            evidence: format!(
                "normals of {} points turned by {:.1} degrees on average to what they mirror",
                last.points, first.turn_degrees
            ),
            numbers: numbers([
                ("cost_before", Some(f64::from(first.cost[0]))),
                ("cost", Some(f64::from(last.cost[1]))),
                ("rounds", Some(result.mirror_rounds.len() as f64)),
            ]),
        });
    }
    for (k, part) in result.parts.iter().enumerate() {
        all.push(TermDocument {
            name: format!("part {k}"),
            kept: true,
            evidence: format!(
                "{}, roughness {:.2}, {} points",
                match part.kind {
                    Kind::Matte => "matte",
                    Kind::Dielectric => "dielectric",
                    Kind::Metal => "metal",
                },
                part.roughness,
                part.samples
            ),
            numbers: numbers([
                ("roughness", Some(f64::from(part.roughness))),
                ("points", Some(part.samples as f64)),
                ("cost", Some(f64::from(part.costs[0]))),
                ("cost_matte", Some(f64::from(part.costs[1]))),
                ("cost_dielectric", Some(f64::from(part.costs[2]))),
                ("cost_metal", Some(f64::from(part.costs[3]))),
            ]),
        });
    }
    all
}

pub(super) fn numbers<const N: usize>(
    pairs: [(&str, Option<f64>); N],
) -> BTreeMap<String, Option<f64>> {
    pairs.into_iter().map(|(k, v)| (k.to_owned(), v.filter(|v| v.is_finite()))).collect()
}
