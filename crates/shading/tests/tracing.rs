//! Rays against meshes: every triangle as oracle, analytic shapes as truth.

mod shapes;

use glam::{DVec3, Vec3};
use motes_math::rng::keyed_rng;
use motes_shading::tracing::{
    BuildQuality, Empty, MeshError, MeshTracer, Plane, Ray, Shapes, Sphere, Tracer, TriangleMesh,
    offset_origin,
};
use rand::RngExt;
use shapes::{floor, joined, sphere};

const QUALITIES: [BuildQuality; 3] =
    [BuildQuality::Fast, BuildQuality::Balanced, BuildQuality::High];

fn random_direction(rng: &mut impl RngExt) -> Vec3 {
    loop {
        let v = Vec3::from(rng.random::<[f32; 3]>()) * 2.0 - Vec3::ONE;
        if (0.01..1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// Möller–Trumbore in f64 over all triangles; also how close a miss or hit was to an edge.
fn brute_force(mesh: &TriangleMesh, ray: &Ray) -> (Option<(f64, u32)>, f64) {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (mut nearest, mut margin) = (None, f64::INFINITY);
    for (i, t) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = t.map(|k| mesh.vertices[k as usize].as_dvec3());
        let (e1, e2) = (b - a, c - a);
        let p = d.cross(e2);
        let det = e1.dot(p);
        let s = o - a;
        let u = s.dot(p) / det;
        let q = s.cross(e1);
        let (v, t) = (d.dot(q) / det, e2.dot(q) / det);
        let inside = u.min(v).min(1.0 - u - v);
        if inside.is_finite() && (f64::from(ray.t_min)..f64::from(ray.t_max)).contains(&t) {
            margin = margin.min(inside.abs());
            if inside >= 0.0 && nearest.is_none_or(|(n, _)| t < n) {
                nearest = Some((t, i as u32));
            }
        }
    }
    (nearest, margin)
}

#[test]
fn the_tree_agrees_with_every_triangle_at_any_scale() {
    for (scale, center) in [(1.0, 0.0), (1e-3, 0.0), (1e4, 0.0), (1.0, 300.0)] {
        let mut rng = keyed_rng(1, 2, 3);
        let mut mesh = TriangleMesh::default();
        for i in 0..400u32 {
            let p = Vec3::from(rng.random::<[f32; 3]>());
            for _ in 0..3 {
                let corner = p + 0.15 * random_direction(&mut rng);
                mesh.vertices.push((corner + Vec3::splat(center)) * scale);
            }
            mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        for quality in QUALITIES {
            let tracer = MeshTracer::new(&mesh, quality).unwrap();
            let (mut hits, mut unclear) = (0, 0);
            for _ in 0..2000 {
                let p = Vec3::from(rng.random::<[f32; 3]>()) + Vec3::splat(center);
                let t_max = if rng.random() { f32::INFINITY } else { 0.3 * scale };
                let ray = Ray { t_max, ..Ray::new(p * scale, random_direction(&mut rng)) };
                let (expected, margin) = brute_force(&mesh, &ray);
                // Within rounding of an edge either answer is right.
                if margin < 1e-4 {
                    unclear += 1;
                    continue;
                }
                let hit = tracer.closest_hit(&ray);
                assert_eq!(hit.map(|h| h.primitive), expected.map(|e| e.1), "{quality:?} {ray:?}");
                assert_eq!(tracer.occluded(&ray), expected.is_some());
                if let (Some(hit), Some((t, _))) = (hit, expected) {
                    hits += 1;
                    let tolerance = 1e-4 * f64::from(scale) * (1.0 + f64::from(center) / 10.0);
                    assert!((f64::from(hit.distance) - t).abs() < tolerance, "{t} {hit:?}");
                }
            }
            assert!(hits > 300 && unclear < 60, "{hits} hits, {unclear} unclear");
        }
    }
}

#[test]
fn a_fine_sphere_and_a_plane_agree_with_their_formulas() {
    let mesh = joined(sphere(Vec3::new(0.1, 0.2, 1.0), 0.5, 200), &floor(5000.0, 0.0));
    let tracer = MeshTracer::new(&mesh, BuildQuality::Balanced).unwrap();
    let exact = Shapes {
        spheres: vec![Sphere { center: DVec3::new(0.1, 0.2, 1.0), radius: 0.5 }],
        planes: vec![Plane { point: DVec3::ZERO, normal: DVec3::Z }],
    };
    let mut rng = keyed_rng(4, 5, 6);
    let (mut disagree, rays) = (0, 20_000);
    for _ in 0..rays {
        let origin = Vec3::new(0.0, -3.0, 1.5) + random_direction(&mut rng) * 0.5;
        let target = Vec3::new(0.1, 0.2, 0.8) + random_direction(&mut rng) * 0.8;
        let ray = Ray::new(origin, (target - origin).normalize());
        let (a, b) = (tracer.closest_hit(&ray), exact.closest_hit(&ray));
        assert_eq!(tracer.occluded(&ray), a.is_some());
        // 400 x 200 facets: sagitta 0.0001, times the slope of grazing rays.
        let close = |a: f32, b: f32| (a - b).abs() < 0.02 + 1e-3 * a;
        let same = match (a, b) {
            (Some(a), Some(b)) => {
                close(a.distance, b.distance)
                    && (a.distance > 5.0 || a.geometric_normal.dot(b.geometric_normal) > 0.99)
            }
            (None, None) => true,
            _ => false,
        };
        disagree += u32::from(!same);
    }
    // The polyhedron is a little smaller than its sphere: only silhouettes may differ.
    println!("{disagree} of {rays} rays differ");
    assert!(f64::from(disagree) < 0.003 * f64::from(rays), "{disagree}");
}

#[test]
fn no_light_leaks_out_of_a_closed_mesh_through_edges_and_corners() {
    let mesh = sphere(Vec3::new(5.0, -3.0, 2.0), 1.0, 40);
    let tracer = MeshTracer::new(&mesh, BuildQuality::Balanced).unwrap();
    let center = Vec3::new(5.01, -3.02, 2.005);
    let mut aimed = 0;
    for t in &mesh.triangles {
        let corners = t.map(|i| mesh.vertices[i as usize]);
        for (i, a) in corners.into_iter().enumerate() {
            let b = corners[(i + 1) % 3];
            for target in [a, 0.5 * (a + b), a + 0.3 * (b - a)] {
                let ray = Ray::new(center, (target - center).normalize());
                let met = tracer.occluded(&ray) && tracer.closest_hit(&ray).is_some();
                assert!(met, "{ray:?} toward {target}, corners {corners:?}");
                aimed += 1;
            }
        }
    }
    assert!(aimed > 20_000, "{aimed}");
}

#[test]
fn a_point_on_a_convex_mesh_does_not_shadow_itself() {
    for (scale, offset) in
        [(1.0, Vec3::ZERO), (0.01, Vec3::ZERO), (100.0, Vec3::new(1e3, 0.0, 0.0))]
    {
        let mesh = sphere(offset, scale, 60);
        let tracer = MeshTracer::new(&mesh, BuildQuality::Balanced).unwrap();
        let mut rng = keyed_rng(7, 8, 9);
        let mut shadowed = 0;
        for _ in 0..5000 {
            let from = offset + random_direction(&mut rng) * (3.0 * scale);
            let Some(hit) = tracer.closest_hit(&Ray::new(from, (offset - from).normalize())) else {
                panic!("the sphere was missed");
            };
            let ray = Ray::new(from, (offset - from).normalize());
            let n = hit.geometric_normal;
            assert!(n.dot(ray.direction) < 0.0, "normals point out");
            let mut out = random_direction(&mut rng);
            if out.dot(n) < 0.0 {
                out = -out;
            }
            // The step is 256 roundings; a mesh far from the origin needs its own bias.
            let bias = 2e-6 * (offset.length() + scale);
            let origin = offset_origin(ray.at(hit.distance), n, out, bias);
            shadowed += u32::from(tracer.occluded(&Ray::new(origin, out)));
        }
        assert_eq!(shadowed, 0, "scale {scale} offset {offset}");
    }
}

#[test]
fn triangles_left_out_let_rays_pass_and_the_others_keep_their_numbers() {
    let mut mesh = floor(1.0, 0.0);
    let lower = floor(1.0, -1.0);
    let n = mesh.vertices.len() as u32;
    mesh.vertices.extend(lower.vertices);
    mesh.triangles.extend(lower.triangles.iter().map(|t| t.map(|v| v + n)));
    let upper = lower.triangles.len() as u32;
    let tracer = MeshTracer::of_some(&mesh, BuildQuality::Balanced, |t| t >= upper).unwrap();
    let whole = MeshTracer::new(&mesh, BuildQuality::Balanced).unwrap();
    let down = Ray::new(Vec3::new(0.3, -0.4, 1.0), -Vec3::Z);
    let (met, first) = (tracer.closest_hit(&down).unwrap(), whole.closest_hit(&down).unwrap());
    assert!(first.primitive < upper && (first.distance - 1.0).abs() < 1e-5);
    assert!(met.primitive >= upper && (met.distance - 2.0).abs() < 1e-5);
    assert_eq!(tracer.geometric_normal(0), Vec3::Z);
}

#[test]
fn strange_meshes_and_rays_are_survived() {
    let empty = MeshTracer::new(&TriangleMesh::default(), BuildQuality::Balanced).unwrap();
    assert!(
        !empty.occluded(&Ray::new(Vec3::ZERO, Vec3::X))
            && !Empty.occluded(&Ray::new(Vec3::ZERO, Vec3::X))
    );
    assert!(empty.closest_hit(&Ray::new(Vec3::ZERO, Vec3::X)).is_none());

    let mut mesh = floor(1.0, 0.0);
    mesh.vertices.push(Vec3::new(f32::NAN, 0.0, 0.0));
    mesh.vertices.push(Vec3::new(f32::INFINITY, 0.0, 0.0));
    mesh.triangles.extend([[0, 1, 4], [0, 5, 1], [2, 2, 3], [0, 0, 0]]);
    let tracer = MeshTracer::new(&mesh, BuildQuality::Balanced).unwrap();
    assert_eq!(tracer.skipped(), 4);
    let few = MeshTracer::of_some(&mesh, BuildQuality::Balanced, |t| t > 3).unwrap();
    assert_eq!(few.skipped(), 2);
    let down = Ray::new(Vec3::new(0.3, -0.4, 1.0), -Vec3::Z);
    assert!(few.closest_hit(&down).is_none());
    let hit = tracer.closest_hit(&down).unwrap();
    assert!((hit.distance - 1.0).abs() < 1e-5 && hit.geometric_normal == Vec3::Z);
    for ray in [
        Ray::new(Vec3::NAN, -Vec3::Z),
        Ray::new(Vec3::ZERO, Vec3::NAN),
        Ray { t_max: f32::NAN, ..down },
        Ray { t_min: 2.0, ..down },
        Ray { t_max: 0.5, ..down },
    ] {
        assert!(!tracer.occluded(&ray) && tracer.closest_hit(&ray).is_none(), "{ray:?}");
    }
    // In the plane of the triangles: no answer is wrong, none may panic.
    tracer.occluded(&Ray::new(Vec3::new(-3.0, 0.0, 0.0), Vec3::X));

    mesh.triangles.push([0, 1, 77]);
    let error = MeshTracer::new(&mesh, BuildQuality::Fast).unwrap_err();
    assert_eq!(error, MeshError::Index { triangle: 6, vertex: 77, vertices: 6 });
}

#[test]
fn a_back_close_before_the_origin_lets_rays_pass_and_nothing_else_does() {
    for scale in [1e-3, 1.0, 1e3] {
        // One floor over the other, 0.1 apart; both face up.
        let mut mesh = joined(floor(1.0, 0.0), &floor(1.0, 0.1));
        mesh.vertices.iter_mut().for_each(|v| *v *= scale);
        let tracer = MeshTracer::new(&mesh, BuildQuality::Balanced).unwrap();
        let up = Ray::new(Vec3::new(0.1, 0.2, 1e-3) * scale, Vec3::new(0.6, 0.0, 0.8));
        let down = Ray::new(Vec3::new(0.1, 0.2, 0.15) * scale, -Vec3::Z);
        let below = Ray::new(Vec3::new(0.1, 0.2, -1.0) * scale, Vec3::Z);
        for (within, passes) in [(0.0, false), (0.05, false), (0.12, true)] {
            let tracer = tracer.clone().one_sided_within(within * scale);
            assert_eq!(tracer.occluded(&up), !passes, "{within} at {scale}");
            assert_eq!(tracer.closest_hit(&up).is_none(), passes, "{within} at {scale}");
            // Fronts count however near, and backs farther away.
            assert!(tracer.occluded(&down) && tracer.occluded(&below), "{within} at {scale}");
            let distance = tracer.closest_hit(&down).map_or(0.0, |hit| hit.distance);
            assert!((distance / scale - 0.05).abs() < 1e-3, "{distance}");
        }
    }
}
