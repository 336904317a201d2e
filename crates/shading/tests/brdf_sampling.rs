//! Every BRDF sampler draws from the density that it claims.

use glam::DVec3;
use motes_math::rng::keyed_rng;
use motes_shading::brdf::microfacet::{alpha, reflection_pdf, sample_visible_normal};
use motes_shading::brdf::{Brdf, LOBES, Material, reference};
use motes_testkit::chi_square_z;
use rand::RngExt;

const RINGS: usize = 24;
const SECTORS: usize = 12;
const SAMPLES: usize = 100_000;

/// z-score of `draw`, which claims the density `pdf` per steradian of `w_i`.
///
/// Bins lie in the half vector, where lobes of any width are round about the normal even at
/// grazing angles: rings at logarithmic angles times sectors. `dw_i = 4 (w_o · h) dw_h`.
fn z_score(
    w_o: DVec3,
    mut draw: impl FnMut(usize) -> Option<DVec3>,
    pdf: impl Fn(DVec3) -> f64,
) -> f64 {
    let (low, high) = (1e-5f64.ln(), std::f64::consts::FRAC_PI_2.ln());
    let tau = std::f64::consts::TAU;
    // The last bin counts what no direction carries.
    let mut observed = vec![0u64; RINGS * SECTORS + 1];
    for i in 0..SAMPLES {
        let Some(w) = draw(i) else {
            observed[RINGS * SECTORS] += 1;
            continue;
        };
        let l = (w + w_o).normalize();
        let angle = l.x.hypot(l.y).atan2(l.z).max(1.001e-5);
        let ring = ((angle.ln() - low) / (high - low) * RINGS as f64) as usize;
        let sector = (l.y.atan2(l.x).rem_euclid(tau) / tau * SECTORS as f64) as usize;
        observed[ring.min(RINGS - 1) * SECTORS + sector.min(SECTORS - 1)] += 1;
    }
    let fine = 60;
    let mut expected = Vec::new();
    for ring in 0..RINGS {
        for sector in 0..SECTORS {
            let mut mass = 0.0;
            for i in 0..fine {
                let step = (high - low) / (RINGS * fine) as f64;
                let angle = (low + (ring * fine + i) as f64 * step + 0.5 * step).exp();
                for j in 0..fine {
                    let phi = tau * ((sector * fine + j) as f64 + 0.5) / (SECTORS * fine) as f64;
                    let local =
                        DVec3::new(angle.sin() * phi.cos(), angle.sin() * phi.sin(), angle.cos());
                    let area = angle.sin() * angle * step * tau / (SECTORS * fine) as f64;
                    let cos = w_o.dot(local).max(0.0);
                    mass += pdf(2.0 * cos * local - w_o) * 4.0 * cos * area;
                }
            }
            // The horizon may cut a sliver off a bin that no quadrature point falls into.
            expected.push((mass * SAMPLES as f64).max(1e-6));
        }
    }
    let total: f64 = expected.iter().sum();
    assert!(total < 1.004 * SAMPLES as f64, "the density integrates to {}", total / SAMPLES as f64);
    expected.push((SAMPLES as f64 - total).max(0.0));
    if expected[RINGS * SECTORS] < 0.004 * SAMPLES as f64 {
        // A remainder that small is quadrature error: leave it out of the test.
        observed.pop();
        expected.pop();
    }
    chi_square_z(&observed, &expected)
}

fn viewer(mu: f64) -> DVec3 {
    DVec3::new((1.0 - mu * mu).sqrt() * 0.6, -(1.0 - mu * mu).sqrt() * 0.8, mu)
}

#[test]
fn visible_normals_have_their_density() {
    for roughness in [0.0, 0.3, 0.7, 1.0] {
        for mu in [0.01, 0.2, 0.9, 1.0] {
            let (a, w_o) = (alpha(roughness), viewer(mu));
            let mut rng = keyed_rng(1, 2, (roughness * 100.0 + mu * 1e6) as u64);
            let draw = |_| {
                let h = sample_visible_normal(a, w_o, [rng.random(), rng.random()]);
                Some(2.0 * w_o.dot(h) * h - w_o)
            };
            let z = z_score(w_o, draw, |w_i| reflection_pdf(a, w_i, w_o));
            assert!(z < 4.0, "roughness {roughness} mu {mu}: z {z}");
        }
    }
}

#[test]
fn a_wrong_density_is_found() {
    let (a, w_o) = (alpha(0.5), viewer(0.4));
    let mut rng = keyed_rng(1, 2, 3);
    let draw = |_| {
        let h = sample_visible_normal(a * 1.05, w_o, [rng.random(), rng.random()]);
        Some(2.0 * w_o.dot(h) * h - w_o)
    };
    assert!(z_score(w_o, draw, |w_i| 0.99 * reflection_pdf(a, w_i, w_o)) > 4.0);
}

#[test]
fn materials_are_sampled_with_their_density_in_both_precisions() {
    for &lobes in LOBES {
        for (roughness, metallic) in [(0.0, 1.0), (0.25, 0.0), (0.6, 0.5), (1.0, 0.0)] {
            for mu in [0.02, 0.3, 0.95] {
                let material =
                    Material::principled(glam::Vec3::new(0.8, 0.5, 0.3), roughness, metallic);
                check_sampling(&Material { lobes, ..material }, mu);
            }
        }
    }
}

fn check_sampling(material: &Material, mu: f64) {
    let slow = reference::Material::from(*material);
    let w_o = viewer(mu);
    let pdf = |w_i| slow.pdf(DVec3::Z, w_i, w_o);
    let mut rng = keyed_rng(4, 5, (mu * 1e6) as u64);
    let draw = |_| slow.sample(DVec3::Z, w_o, rng.random());
    let z = z_score(w_o, draw, pdf);
    assert!(z < 4.0, "f64 {material:?} mu {mu}: z {z}");
    let fast = Brdf::new(material, glam::Vec3::Z, w_o.as_vec3().normalize());
    let draw = |_| fast.sample(rng.random()).map(|w| w.as_dvec3());
    let z = z_score(w_o, draw, pdf);
    assert!(z < 4.0, "f32 {material:?} mu {mu}: z {z}");
}

#[test]
fn lambert_is_sampled_by_its_cosine() {
    let material = Material::lambert(glam::Vec3::ONE);
    let slow = reference::Material::from(material);
    let w_o = viewer(0.5);
    let mut rng = keyed_rng(6, 7, 8);
    let draw = |_| slow.sample(DVec3::Z, w_o, rng.random());
    let z = z_score(w_o, draw, |w_i| w_i.z.max(0.0) / std::f64::consts::PI);
    assert!(z < 4.0, "z {z}");
}
