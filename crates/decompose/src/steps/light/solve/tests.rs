use std::sync::Arc;

use glam::BVec3;
use motes_shading::environment::{Convention, Orientation};

use super::super::glossy::{GlossyPoint, GlossyView};
use super::*;
use crate::illumination::seen_sky::SkyPixel;

/// A ring of five cells, the last of which is a lamp.
fn sources() -> Sources {
    Sources {
        lamps: 1,
        neighbors: vec![(0, 1), (1, 2), (2, 3), (3, 4), (4, 0)],
        heights: vec![-0.8, 0.1, 0.5, 0.9],
        expected: vec![Some(Vec3::ZERO), None, Some(Vec3::ONE), Some(Vec3::new(-0.5, 0.2, 0.4))],
        sky_is_clipped: false,
    }
}

fn noise(i: usize) -> f32 {
    (i as f32 * 12.9898).sin() * 0.5 + 0.5
}

/// Seven points under each of two lights of five cells.
fn lit_points() -> Vec<LitPoints> {
    let (points, columns) = (7, 5);
    [0, 500]
        .into_iter()
        .map(|k| LitPoints {
            transport: Transport {
                cells: (0..points * columns).map(|i| 0.02 + 0.2 * noise(k + i)).collect(),
                bounce: (0..points).map(|i| Vec3::splat(0.05 * noise(k + 90 + i))).collect(),
                columns,
            },
            radiance: (0..points)
                .map(|i| {
                    Vec3::new(0.1 + noise(k + i), 0.2 + noise(k + i + 30), 0.3 + noise(k + i + 60))
                })
                .collect(),
        })
        .collect()
}

fn options() -> SolveOptions {
    SolveOptions {
        smooth: 0.3,
        white: 0.2,
        scale: 0.5,
        glossy: 1.0,
        above: 0.3,
        clear_sky: 0.2,
        color: 0.7,
        typical_base_color: 0.3,
        sigma: 0.2,
        steps: 1,
        rate: 0.1,
        sky: Arc::default(),
        others: vec![("even-light", 0.4)],
    }
}

/// Compares a gradient with difference quotients of its cost.
fn check(at: impl Fn(&[f32]) -> (f64, Vec<f32>)) -> Result<(), String> {
    let theta: Vec<f32> = (0..30).map(|i| noise(i + 200) - 0.4).collect();
    let (_, gradient) = at(&theta);
    let mut largest = 0.0f64;
    for i in 0..theta.len() {
        let moved = |d: f32| {
            let mut t = theta.clone();
            t[i] += d;
            at(&t).0
        };
        let step = 5e-3;
        let numeric = (moved(step) - moved(-step)) / (2.0 * f64::from(step));
        let analytic = f64::from(gradient[i]);
        largest = largest.max(numeric.abs());
        if (numeric - analytic).abs() >= 2e-3 * analytic.abs() + 2e-5 {
            return Err(format!("{i}: {numeric} {analytic}"));
        }
    }
    if largest > 1e-3 { Ok(()) } else { Err("it has no slope".into()) }
}

#[test]
fn the_gradient_of_every_prior_is_that_of_its_cost() {
    let (lit, options) = (lit_points(), options());
    for prior in LIGHT_PRIORS {
        let at = |theta: &[f32]| {
            cost_and_gradient(theta, &lit, &[], &sources(), &[], &options, &[(*prior, 0.7)])
        };
        check(at).unwrap_or_else(|error| panic!("{}: {error}", prior.name()));
    }
}

#[test]
fn cells_keep_to_the_sky_that_photos_show() {
    let orientation = Orientation::new(Convention::Blender);
    let mut lights = [CellLight::uniform(4, 2, Vec3::ONE, orientation)];
    let shown = Vec3::new(0.1, 0.2, 0.4);
    // All over the cell.
    let places = (0..900).map(|i| ((i % 30) as f32 / 30.0, (i / 30) as f32 / 30.0));
    let pixels: Vec<SkyPixel> = places
        .map(|(s, t)| SkyPixel {
            direction: lights[0].cells[1].direction(s, t, &orientation),
            radiance: shown,
            is_clipped: BVec3::FALSE,
        })
        .collect();
    let sky = Arc::new(SeenSky::new(&pixels, None, &orientation));
    let transport = Transport {
        cells: (0..56).map(|i| 0.02 + 0.2 * noise(i)).collect(),
        bounce: vec![Vec3::ZERO; 7],
        columns: 8,
    };
    let lit = [LitPoints { transport, radiance: vec![Vec3::ONE; 7] }];
    let pairs: Vec<Pair> = (0..7).map(|a| Pair { a, b: (a + 3) % 7, weight: 1.0 }).collect();
    solve(&mut lights, &lit, &pairs, &mut [], &SolveOptions { steps: 50, sky, ..options() });
    let found = lights[0].radiance[1];
    assert!(((found / shown).map(f32::ln)).abs().max_element() < 0.11, "{found}");
    assert!(lights[0].radiance[6].x > 0.3, "{}", lights[0].radiance[6]);
}

#[test]
fn the_gradient_is_that_of_the_cost() {
    let (points, columns) = (7, 5);
    let (lit, options) = (lit_points(), options());
    let pairs: Vec<Pair> = (0..30)
        .map(|i| Pair { a: (i % 14) as u32, b: ((i * 3 + 1) % 14) as u32, weight: 0.2 + noise(i) })
        .collect();
    // A point of each kind under each light, seen three times.
    let glossy: Vec<Glossy> = [0, 700]
        .into_iter()
        .map(|k| {
            let view = |p: usize, v: usize| GlossyView {
                lobe: (0..3)
                    .map(|j| {
                        let cell = (p + v + 2 * j) % columns;
                        (cell as u32, Vec3::new(0.2, 0.3, 0.4) * noise(k + 7 * p + 3 * v + j))
                    })
                    .collect(),
                bounce: Vec3::splat(0.1 * noise(k + p + v)),
                radiance: Vec3::splat(0.2 + noise(k + 50 + 5 * p + v)),
                weight: 0.1 + 0.1 * noise(k + v),
            };
            let point = |p: usize| GlossyPoint {
                row: (2 * p + 1) as u32,
                is_dielectric: p != 1,
                unit: 0.3 + noise(k + p),
                views: (0..3).map(|v| view(p, v)).collect(),
            };
            Glossy::new((0..3).map(point).collect(), &vec![Vec3::new(0.3, 0.5, 0.7); points])
        })
        .collect();
    let priors = weighted(&options);
    let lower = |expected: &Option<Vec3>| expected.map(|log| log - 2.0);
    let clipped = Sources {
        expected: sources().expected.iter().map(lower).collect(),
        sky_is_clipped: true,
        ..sources()
    };
    for sources in [sources(), clipped] {
        let at = |theta: &[f32]| {
            cost_and_gradient(theta, &lit, &pairs, &sources, &glossy, &options, &priors)
        };
        check(at).unwrap();
    }
}
