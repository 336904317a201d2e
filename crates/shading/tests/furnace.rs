//! Energy and reciprocity of every BRDF in the list.

use glam::DVec3;
use motes_shading::brdf::reference::Material;
use motes_shading::brdf::{Brdf, LOBES, Lobes, Model, WithModel, with_model};

const ROUGHNESSES: [f64; 8] = [0.0, 0.02, 0.07, 0.2, 0.45, 0.63, 0.85, 1.0];
const COSINES: [f64; 6] = [0.004, 0.03, 0.13, 0.4, 0.77, 1.0];

fn viewer(mu: f64) -> DVec3 {
    DVec3::new((1.0 - mu * mu).sqrt() * 0.6, (1.0 - mu * mu).sqrt() * 0.8, mu)
}

fn material(base: f64, roughness: f64, metallic: f64) -> Material {
    let base_color_linear = DVec3::splat(base);
    Material { base_color_linear, roughness, metallic, lobes: Lobes::Principled }
}

/// `∫ f_r μ_i dw_i` over Roberts's R3 sequence (the three-dimensional golden ratio). Half of the
/// points follow the material's sampler, half crowd at the horizon (`μ = u⁴`), where the
/// compensation of narrow lobes sits.
fn albedo(m: &Material, mu: f64, n: u32) -> DVec3 {
    let w_o = viewer(mu);
    let mut sum = DVec3::ZERO;
    for i in 0..n {
        let t = f64::from(i / 2) + 0.5;
        let u = [0.819_172_513_396_164, 0.671_043_606_703_789, 0.549_700_477_901_970_5]
            .map(|g: f64| (t * g).fract());
        let w_i = if i % 2 == 0 {
            m.sample(DVec3::Z, w_o, u)
        } else {
            let (mu, phi) = (u[1].powi(4), std::f64::consts::TAU * u[2]);
            let r = (1.0 - mu * mu).sqrt();
            Some(DVec3::new(r * phi.cos(), r * phi.sin(), mu))
        };
        if let Some(w_i) = w_i.filter(|w| w.z > 0.0) {
            let horizon = 0.25 * w_i.z.powf(-0.75) / std::f64::consts::TAU;
            let pdf = 0.5 * (m.pdf(DVec3::Z, w_i, w_o) + horizon);
            sum += m.eval(DVec3::Z, w_i, w_o).total() * w_i.z / pdf;
        }
    }
    sum / f64::from(n)
}

/// What a model promises of the white furnace.
struct FurnaceError;

impl WithModel for FurnaceError {
    type Output = f64;

    fn run<M: Model>(self) -> f64 {
        M::FURNACE_ERROR
    }
}

#[test]
fn a_white_furnace_stays_white() {
    for &lobes in LOBES {
        let allowed = with_model(lobes, FurnaceError);
        let mut worst: f64 = 0.0;
        for metallic in [0.0, 1.0] {
            for roughness in ROUGHNESSES {
                for mu in COSINES {
                    let m = Material { lobes, ..material(1.0, roughness, metallic) };
                    let albedo = albedo(&m, mu, 60_000).x;
                    assert!(albedo.is_finite() && albedo > 0.0, "{lobes:?}: {albedo}");
                    worst = worst.max((albedo - 1.0).abs());
                }
            }
        }
        println!("{lobes:?}: largest furnace error {worst:.5}");
        assert!(worst < allowed, "{lobes:?}: furnace off by {worst}");
    }
}

#[test]
fn without_compensation_a_rough_metal_would_lose_light() {
    // The bad case that the furnace would show: single scattering alone.
    let e = motes_shading::brdf::albedo_table().at(0.77, 1.0)[0];
    assert!(e < 0.7, "{e}");
}

#[test]
fn lambert_reflects_its_base_color() {
    let m = Material { lobes: Lobes::Lambert, ..material(1.0, 0.3, 0.0) };
    for mu in COSINES {
        assert!((albedo(&m, mu, 20_000).x - 1.0).abs() < 1e-3);
    }
}

#[test]
fn burleys_diffuse_lobe_has_its_own_albedo() {
    // 1.011 and 0.996 by quadrature of the published formula; the difference of two materials
    // leaves out the coat.
    for (roughness, mu, expected) in [(0.6, 0.7, 1.011), (0.35, 0.7, 0.996), (0.9, 0.4, 1.075)] {
        let of = |base| Material { lobes: Lobes::Burley, ..material(base, roughness, 0.0) };
        let diffuse = albedo(&of(1.0), mu, 60_000).x - albedo(&of(0.0), mu, 60_000).x;
        assert!((diffuse - expected).abs() < 4e-3, "{roughness} {mu}: {diffuse}");
    }
}

#[test]
fn no_material_reflects_more_than_it_gets() {
    let conserving = LOBES.iter().filter(|lobes| with_model(**lobes, FurnaceError) < 0.02);
    for &lobes in conserving {
        for (base, metallic) in
            [(0.0, 0.0), (0.0, 1.0), (0.5, 0.5), (1.0, 0.5), (0.8, 0.0), (0.9, 1.0)]
        {
            for roughness in ROUGHNESSES {
                for mu in COSINES {
                    let m = Material { lobes, ..material(base, roughness, metallic) };
                    let a = albedo(&m, mu, 8_000).x;
                    assert!((0.0..1.02).contains(&a), "{m:?} {mu}: {a}");
                }
            }
        }
    }
}

/// `decompose` solves for base color in closed form.
#[test]
fn the_diffuse_part_is_proportional_to_base_color_and_the_coat_does_not_know_it() {
    for &lobes in LOBES {
        for i in 0..40 {
            let (a, b) = (direction(2 * i), direction(2 * i + 1));
            let of = |base| {
                let m = Material { lobes, ..material(base, 0.4, 0.0) };
                m.eval(DVec3::Z, a, b)
            };
            let (dark, half, white) = (of(0.0), of(0.5), of(1.0));
            assert_eq!(dark.diffuse, DVec3::ZERO, "{lobes:?}");
            assert!((2.0 * half.diffuse - white.diffuse).abs().max_element() < 1e-12, "{lobes:?}");
            assert_eq!(dark.specular, white.specular, "{lobes:?}");
        }
    }
}

#[test]
fn light_and_viewer_may_swap() {
    let n = DVec3::new(0.36, -0.48, 0.8);
    for roughness in ROUGHNESSES {
        for metallic in [0.0, 0.4, 1.0] {
            for &lobes in LOBES {
                let m = Material { lobes, ..material(0.7, roughness, metallic) };
                for i in 0..50 {
                    let (a, b) = (direction(2 * i), direction(2 * i + 1));
                    let there = m.eval(n, a, b).total().x;
                    let back = m.eval(n, b, a).total().x;
                    assert!((there - back).abs() <= 1e-9 * there, "{lobes:?}: {there} {back}");
                }
            }
        }
    }
}

/// Directions spread over the whole sphere.
fn direction(i: u32) -> DVec3 {
    let t = f64::from(i) + 0.5;
    let z = 1.0 - 2.0 * (t * 0.754_877_666_246_693).fract();
    let phi = std::f64::consts::TAU * (t * 0.569_840_290_998_053).fract();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * phi.cos(), r * phi.sin(), z)
}

#[test]
fn the_fast_path_agrees_with_the_reference() {
    let n = DVec3::new(0.36, -0.48, 0.8).as_vec3().normalize();
    let n64 = n.as_dvec3().normalize();
    for &lobes in LOBES {
        for roughness in [0.1, 0.3, 0.6, 1.0] {
            for metallic in [0.0, 0.5, 1.0] {
                let m = motes_shading::brdf::Material {
                    lobes,
                    ..motes_shading::brdf::Material::principled(
                        glam::Vec3::new(0.9, 0.5, 0.1),
                        roughness,
                        metallic,
                    )
                };
                for i in 0..200 {
                    let (a, b) = (direction(2 * i).as_vec3(), direction(2 * i + 1).as_vec3());
                    let fast = Brdf::new(&m, n, b);
                    let (value, pdf) = fast.eval_pdf(a);
                    let slow = Material::from(m);
                    let (a64, b64) = (a.as_dvec3(), b.as_dvec3());
                    let expected = slow.eval(n64, a64, b64).total() * n64.dot(a64).max(0.0);
                    let difference = (value.total().as_dvec3() - expected).abs().max_element();
                    assert!(
                        difference < 3e-4 * expected.max_element() + 1e-6,
                        "{lobes:?} roughness {roughness}: {} {expected}",
                        value.total()
                    );
                    let expected = slow.pdf(n64, a64, b64);
                    assert!((f64::from(pdf) - expected).abs() < 3e-4 * expected + 1e-6);
                }
            }
        }
    }
}

#[test]
fn extremes_are_finite_and_not_negative() {
    for roughness in [0.0, 1.0, f32::NAN] {
        for metallic in [0.0, 1.0] {
            for base in [0.0, 1.0, -3.0, f32::INFINITY] {
                for &lobes in LOBES {
                    let m = motes_shading::brdf::Material::principled(
                        glam::Vec3::splat(base),
                        roughness,
                        metallic,
                    );
                    extremes(&motes_shading::brdf::Material { lobes, ..m });
                }
            }
        }
    }
}

fn extremes(m: &motes_shading::brdf::Material) {
    let tiny = 1e-6f32;
    for mu_o in [0.0, tiny, 0.5, 1.0] {
        for mu_i in [0.0, tiny, 0.5, 1.0] {
            for side in [1.0, -1.0] {
                let at = |mu: f32, s: f32| {
                    glam::Vec3::new(s * (1.0 - mu * mu).sqrt(), 0.0, mu).normalize()
                };
                let (w_o, w_i) = (at(mu_o, 1.0), at(mu_i, side));
                let brdf = Brdf::new(m, glam::Vec3::Z, w_o);
                let (value, pdf) = brdf.eval_pdf(w_i);
                let all = [value.diffuse, value.specular];
                assert!(all.iter().all(|v| v.is_finite() && v.min_element() >= 0.0));
                assert!(pdf.is_finite() && pdf >= 0.0);
                for u in [0.0, 0.3, 0.999_999_94] {
                    if let Some(w) = brdf.sample([u, u, u]) {
                        assert!((w.length() - 1.0).abs() < 1e-5);
                    }
                }
            }
        }
    }
}

#[test]
fn a_normal_that_faces_away_reflects_nothing() {
    let m = motes_shading::brdf::Material::principled(glam::Vec3::ONE, 0.5, 0.0);
    let brdf = Brdf::new(&m, -glam::Vec3::Z, glam::Vec3::Z);
    assert!(brdf.faces_away() && brdf.sample([0.2, 0.5, 0.5]).is_none());
    assert_eq!(brdf.eval_pdf(-glam::Vec3::Z).0.total(), glam::Vec3::ZERO);
}

/// Materials of three base colors and metallics, evaluated together and one by one.
struct Alike(f32);

impl WithModel for Alike {
    type Output = ();

    fn run<M: Model>(self) {
        let narrow = |v: DVec3| v.as_vec3().normalize();
        for mu_o in COSINES.into_iter().chain([-0.2]) {
            let models = [(1.0, 0.0), (0.3, 0.4), (0.0, 1.0)].map(|(base, metallic)| {
                let base = glam::Vec3::new(base, 0.5 * base, base * base);
                let m = motes_shading::brdf::Material::principled(base, self.0, metallic);
                M::new(&m, glam::Vec3::Z, narrow(viewer(mu_o)))
            });
            for mu_i in COSINES.into_iter().chain([-0.2]) {
                let w = narrow(DVec3::new(-1.0, 0.3, 1.0) * viewer(mu_i));
                let together = M::eval_alike(&models, w);
                for (model, value) in models.iter().zip(together) {
                    let alone = model.eval_pdf(w).0;
                    assert_eq!([alone.diffuse, alone.specular], [value.diffuse, value.specular]);
                }
            }
        }
    }
}

#[test]
fn materials_evaluated_together_are_those_evaluated_alone() {
    for roughness in ROUGHNESSES {
        for &lobes in LOBES {
            with_model(lobes, Alike(roughness as f32));
        }
    }
}
