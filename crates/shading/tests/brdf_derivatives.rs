//! Derivatives of the f32 BRDF against central differences of the f64 reference.

use glam::{DVec3, Vec3};
use motes_shading::brdf::{Brdf, Lobes, Material, reference};
use motes_testkit::check_gradient;

/// `f_r (n · w_i)` per channel as a function of (base color, roughness, metallic, normal).
fn value(p: &[f64; 8], lobes: Lobes, w_i: DVec3, w_o: DVec3) -> DVec3 {
    let m = reference::Material {
        base_color_linear: DVec3::new(p[0], p[1], p[2]),
        roughness: p[3],
        metallic: p[4],
        lobes,
    };
    let n = DVec3::new(p[5], p[6], p[7]);
    m.eval(n, w_i, w_o).total() * n.dot(w_i)
}

#[test]
fn derivatives_match_finite_differences() {
    // Off the nodes of the albedo table: between them it is linear, at them it has kinks.
    for (roughness, metallic) in [(0.11, 0.0), (0.27, 1.0), (0.45, 0.3), (0.7, 0.05), (0.96, 0.8)] {
        for lobes in [Lobes::Principled, Lobes::Burley, Lobes::Lambert] {
            let normal = DVec3::new(0.1, 0.2, 1.0).normalize();
            for (to_light, to_viewer) in [
                (DVec3::new(0.5, 0.1, 0.8), DVec3::new(-0.3, 0.2, 0.9)),
                (DVec3::new(-0.7, 0.5, 0.31), DVec3::new(0.8, -0.2, 0.22)),
                (DVec3::new(0.05, 0.12, 0.9), DVec3::new(0.1, 0.2, 1.05)),
            ] {
                let (w_i, w_o) = (to_light.normalize(), to_viewer.normalize());
                let p = [0.8, 0.45, 0.2, roughness, metallic, normal.x, normal.y, normal.z];
                let material = Material {
                    lobes,
                    ..Material::principled(
                        Vec3::new(0.8, 0.45, 0.2),
                        roughness as f32,
                        metallic as f32,
                    )
                };
                let brdf = Brdf::new(&material, normal.as_vec3(), w_o.as_vec3());
                let d = brdf.eval_with_derivatives(w_i.as_vec3());
                let expected = value(&p, lobes, w_i, w_o);
                let error = (d.value.total().as_dvec3() - expected).abs().max_element();
                assert!(error < 1e-4 * expected.max_element());
                for k in 0..3 {
                    let n = normal.as_vec3();
                    // Only the part of ∂/∂n along the sphere is seen by unit normals.
                    let along = d.by_normal[k] - n * n.dot(d.by_normal[k]);
                    let mut analytic = [0.0; 8];
                    analytic[k] = f64::from(d.by_base_color[k]);
                    analytic[3] = f64::from(d.by_roughness[k]);
                    analytic[4] = f64::from(d.by_metallic[k]);
                    for axis in 0..3 {
                        analytic[5 + axis] = f64::from(along[axis]);
                    }
                    let numeric: Vec<f64> = (0..8)
                        .map(|i| {
                            let h = 1e-5;
                            let at = |s: f64| {
                                let mut q = p;
                                q[i] += s;
                                let n = DVec3::new(q[5], q[6], q[7]).normalize();
                                (q[5], q[6], q[7]) = (n.x, n.y, n.z);
                                value(&q, lobes, w_i, w_o)[k]
                            };
                            (at(h) - at(-h)) / (2.0 * h)
                        })
                        .collect();
                    let check = check_gradient(&analytic, &numeric);
                    assert!(
                        check.relative_error < 2e-3,
                        "{lobes:?} r {roughness} m {metallic} channel {k}: {check:?}\n{analytic:?}\n{numeric:?}"
                    );
                    for (i, (a, n)) in analytic.iter().zip(&numeric).enumerate() {
                        let scale =
                            n.abs().max(0.02 * numeric.iter().fold(0.0, |m, v| v.abs().max(m)));
                        assert!((a - n).abs() < 0.01 * scale + 1e-4, "parameter {i}: {a} and {n}");
                    }
                }
            }
        }
    }
}
