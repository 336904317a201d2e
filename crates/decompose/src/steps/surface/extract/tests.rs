//! Analytic shapes, degenerate captures, other worlds.

use glam::DQuat;
use motes_scene::{ImageF32, Pinhole, Pose};
use motes_shading::tracing::{Plane as TruthPlane, Ray, Shapes, Sphere, Tracer};

use super::*;

pub(in super::super) const RADIUS: f64 = 0.3;

/// The pictures are small and without noise: voxels of one pixel. They are of one color, so that all would be taken for a wall.
fn fine() -> Options {
    Options { voxel_pixels: 1.0, smooth_untextured: 0.0, ..Options::default() }
}

#[test]
fn small_photos_have_small_voxels() {
    // A voxel of two pixels at 480 pixels, of one in small photos; a finer one stays.
    for (wanted, side, edge) in [(2.0, 480, 2.0), (2.0, 240, 1.2), (2.0, 48, 1.0), (0.5, 48, 0.5)] {
        assert!((voxel_pixels(wanted, side) - edge).abs() < 1e-6, "{wanted} {side}");
    }
    assert!(voxel_pixels(f32::NAN, 480) > 0.0 && voxel_pixels(0.0, 0) > 0.0);
}

fn shapes() -> Shapes {
    Shapes {
        spheres: vec![Sphere { center: DVec3::new(0.0, 0.0, 0.25), radius: RADIUS }],
        planes: vec![TruthPlane { point: DVec3::ZERO, normal: DVec3::Z }],
    }
}

/// `n` photos on a ring that looks down onto the origin, in a world of another size and place.
pub(in super::super) fn photos(n: usize, scale: f64, shift: DVec3) -> Vec<Photo> {
    let (width, height) = (160, 120);
    let camera = Pinhole { fx: 170.0, fy: 170.0, cx: 80.0, cy: 60.0, width, height };
    let photo = |i: usize| {
        let angle = std::f64::consts::TAU * i as f64 / n as f64;
        let eye = DVec3::new(1.4 * angle.cos(), 1.4 * angle.sin(), 1.2);
        let pose = Pose::look_at(eye * scale + shift, shift, DVec3::Z).unwrap();
        Photo {
            gain: [1.0; 3],
            name: format!("{i}"),
            camera,
            camera_from_world: pose,
            radiance_linear: ImageF32::filled(width, height, 3, 0.5).into(),
            light: 0,
            usable: vec![true; width * height],
            clipped: Vec::new(),
        }
    };
    (0..n).map(photo).collect()
}

/// Twelve photos, in the unit world, and depth: per photo and pixel, the brightness and the depth that `seen` says.
pub(in super::super) fn pictures_of(
    seen: impl Fn(usize, &View, [usize; 2]) -> (f32, f32),
) -> (Vec<View>, Vec<DepthMap>) {
    let mut photos = photos(12, 1.0, DVec3::ZERO);
    let mut maps = Vec::new();
    for (i, photo) in photos.iter_mut().enumerate() {
        let view = View::new(photo, &UnitWorld::IDENTITY);
        let mut depth = Vec::new();
        for (k, pixel) in photo.radiance_linear.floats_mut().iter_mut().enumerate() {
            let (brightness, z) = seen(i, &view, view.at(k as u32));
            pixel.fill(brightness);
            depth.push(z);
        }
        maps.push(DepthMap { depth });
    }
    (photos.iter().map(|p| View::new(p, &UnitWorld::IDENTITY)).collect(), maps)
}

/// Twelve photos, in the unit world, of what rays meet at the depth `shown`, with a texture of waves, and maps of the depth `told`.
pub(in super::super) fn pictures(
    texture: f32,
    shown: &dyn Fn(&View, Vec3) -> f32,
    told: &dyn Fn(&View, Vec3) -> f32,
) -> (Vec<View>, Vec<DepthMap>) {
    pictures_of(|_, view, at| {
        let ray = view.pixel_ray(at);
        let p = view.center + ray * shown(view, ray);
        let wave = (21.0 * p.x).sin() + (17.0 * p.y + 1.0).sin() + (33.0 * (p.x + p.y)).cos();
        ((0.4 + texture * wave).powf(2.2), told(view, ray))
    })
}

/// Exact depths of the shapes plus a wave of the given height.
fn depths(views: &[View], unit: &UnitWorld, wave: f32) -> Vec<DepthMap> {
    let shapes = shapes();
    let of = |view: &View| {
        let depth = (0..view.width * view.height)
            .map(|i| {
                let (x, y) = ((i % view.width) as f32 + 0.5, (i / view.width) as f32 + 0.5);
                let ray = view.ray(x, y);
                let origin = unit.point_in_world(view.center.as_dvec3()).as_vec3();
                let hit = shapes.closest_hit(&Ray::new(origin, ray.normalize()));
                let z = hit.map_or(0.0, |h| h.distance / ray.length());
                z / unit.length as f32 + wave * ((0.7 * x).sin() + (0.9 * y).cos())
            })
            .collect();
        DepthMap { depth }
    };
    views.iter().map(of).collect()
}

fn from_depths(wave: f32, options: &Options) -> (Mesh, Vec<Vec3>, GeometryReport, UnitWorld) {
    of_maps(options, |views, unit| depths(views, unit, wave))
}

/// The surface that twelve views of these depths give.
fn of_maps(
    options: &Options,
    maps: impl Fn(&[View], &UnitWorld) -> Vec<DepthMap>,
) -> (Mesh, Vec<Vec3>, GeometryReport, UnitWorld) {
    let photos = photos(12, 1.0, DVec3::ZERO);
    let centers: Vec<DVec3> =
        photos.iter().map(|p| p.camera_from_world.center_in_world()).collect();
    let unit = UnitWorld::of(&centers, std::iter::empty());
    let views: Vec<View> = photos.iter().map(|p| View::new(p, &unit)).collect();
    let maps = maps(&views, &unit);
    let mut tick = |_: f32| Ok(());
    let mut parts = Parts { tick: &mut tick, times: Vec::new(), started: None };
    let (mesh, normals, report) =
        surface_of(&views, maps.clone(), maps, options, &mut parts).unwrap();
    (mesh, normals, report, unit)
}

#[test]
fn a_sphere_on_a_plane_comes_back() {
    // The wave is half a voxel high: the noise of a depth map.
    for (wave, degrees, distance) in [(0.0, 1.2, 0.1), (0.004, 4.0, 0.2)] {
        let (mesh, normals, report, unit) = from_depths(wave, &fine());
        assert_eq!(report.planes, 1, "{report:?}");
        let (mut worst, mut sum, mut angles, mut count) = (0.0f64, 0.0, 0.0f64, 0.0);
        for (x, n) in mesh.vertices.iter().zip(&normals) {
            let p = unit.point_in_world(x.as_dvec3());
            let radial = p - DVec3::new(0.0, 0.0, 0.25);
            let n = n.as_dvec3();
            let on_plane = p.z.abs() < 1e-3 && n.dot(DVec3::Z) > 0.99;
            // The crease between the two is as round as a voxel.
            if on_plane || p.z < 0.06 {
                continue;
            }
            let off = (radial.length() - RADIUS).abs() / (report.voxel * unit.length);
            worst = worst.max(off);
            sum += off;
            angles += n.angle_between(radial).to_degrees();
            count += 1.0;
        }
        println!("{wave}: mean {} worst {worst} voxels, {} degrees", sum / count, angles / count);
        assert!(count > 1000.0, "{count}");
        assert!(sum / count < distance, "{wave}: off by {} voxels", sum / count);
        // The rim where the sphere ends over the plane bends most.
        assert!(worst < 0.6, "{wave}: off by {worst} voxels");
        assert!(angles / count < degrees, "{wave}: normals off by {} degrees", angles / count);
        let on_plane =
            mesh.vertices.iter().filter(|v| unit.point_in_world(v.as_dvec3()).z.abs() < 5e-3);
        assert!(on_plane.count() > 500, "the plane is part of the surface");
    }
}

/// Far from the thing the Gaussians are fog, at another depth in every view: it stands out against no plane, and is no thing.
#[test]
fn fog_before_the_far_end_of_a_plane_is_no_thing() {
    let (mesh, _, report, unit) = of_maps(&fine(), |views, unit| {
        let mut maps = depths(views, unit, 0.0);
        for (k, (view, map)) in views.iter().zip(&mut maps).enumerate() {
            for (i, z) in map.depth.iter_mut().enumerate() {
                let at = unit
                    .point_in_world(view.place([i % view.width, i / view.width], *z).as_dvec3());
                if at.truncate().length() > 0.6 {
                    *z *= 0.3 + 0.05 * (k * 5 % 12) as f32;
                }
            }
        }
        maps
    });
    assert_eq!(report.planes, 1, "{report:?}");
    let is_fog = |v: &&Vec3| {
        let p = unit.point_in_world(v.as_dvec3());
        (p - DVec3::new(0.0, 0.0, 0.25)).length() > RADIUS + 0.05 && p.z > 0.05
    };
    let (fog, all) = (mesh.vertices.iter().filter(is_fog).count(), mesh.vertices.len());
    assert!(all > 3000 && fog * 100 < all, "{fog} of {all}");
}

#[test]
fn triangles_are_counter_clockwise_from_outside() {
    let (mesh, normals, _, unit) = from_depths(0.0, &fine());
    let turned = |t: &&[u32; 3]| mesh.area_normal(**t).dot(normals[t[0] as usize]) < 0.0;
    let count = mesh.triangles.iter().filter(turned).count();
    // A few fold over at the crease between sphere and plane.
    assert!(count * 500 < mesh.triangles.len(), "{count} of {}", mesh.triangles.len());
    let outwards = |v: &Vec3, n: &Vec3| {
        let radial = unit.point_in_world(v.as_dvec3()) - DVec3::new(0.0, 0.0, 0.25);
        radial.z < 0.0 || n.as_dvec3().dot(radial) > 0.0
    };
    assert!(mesh.vertices.iter().zip(&normals).all(|(v, n)| outwards(v, n)));
}

/// Gaussians on the sphere and on the plane, flat and opaque.
fn gaussians(scale: f64, shift: DVec3) -> Gaussians {
    let mut g = Gaussians::empty(0);
    let mut add = |p: DVec3, n: DVec3, size: f64| {
        let q = DQuat::from_rotation_arc(DVec3::Z, n);
        g.means.push((p * scale + shift).as_vec3().to_array());
        g.rotations.push([q.w as f32, q.x as f32, q.y as f32, q.z as f32]);
        let wide = (size * scale).ln() as f32;
        g.log_scales.push([wide, wide, wide - 3.0]);
        g.opacity_logits.push(4.0);
        g.sh.extend([0.1; 3]);
    };
    for i in 0..3000 {
        let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / 3000.0;
        let angle = f64::from(i) * 2.399_963;
        let n =
            DVec3::new((1.0 - z * z).sqrt() * angle.cos(), (1.0 - z * z).sqrt() * angle.sin(), z);
        add(DVec3::new(0.0, 0.0, 0.25) + n * RADIUS, n, 0.012);
    }
    for i in 0..70 {
        for j in 0..70 {
            add(DVec3::new(f64::from(i) - 34.5, f64::from(j) - 34.5, 0.0) * 0.03, DVec3::Z, 0.02);
        }
    }
    g
}

fn run(gaussians: &Gaussians, photos: &[Photo]) -> (Surface, GeometryReport) {
    let mut tick = |_: f32| Ok(());
    let options = Options { refine_rounds: 1, ..Options::default() };
    extract(gaussians, &photos.iter().collect::<Vec<_>>(), &options, &mut tick).unwrap()
}

#[test]
fn other_units_and_places_and_threads_give_the_same_surface() {
    let (reference, report) = run(&gaussians(1.0, DVec3::ZERO), &photos(12, 1.0, DVec3::ZERO));
    assert!(
        reference.is_consistent() && report.planes == 1 && report.triangles > 5000,
        "{report:?}"
    );
    for (scale, shift) in
        [(1e3, DVec3::ZERO), (1e-3, DVec3::ZERO), (1.0, DVec3::new(1e3, -2e3, 5e2))]
    {
        let (other, r) = run(&gaussians(scale, shift), &photos(12, scale, shift));
        assert!((r.voxel / scale / report.voxel - 1.0).abs() < 1e-2, "{scale} {shift}");
        let ratio = r.triangles as f64 / report.triangles as f64;
        assert!((ratio - 1.0).abs() < 0.03, "{scale} {shift}: {ratio}");
        let top = |s: &Surface| s.vertices.iter().map(|v| v[2]).fold(f32::MIN, f32::max);
        let (a, b) = (f64::from(top(&reference)), (f64::from(top(&other)) - shift.z) / scale);
        assert!((a - b).abs() < report.voxel * 0.5, "{scale} {shift}: {a} {b}");
    }
    let mut patterned = photos(6, 1.0, DVec3::ZERO);
    for photo in &mut patterned {
        let values = photo.radiance_linear.floats_mut().as_flattened_mut().iter_mut().enumerate();
        values.for_each(|(i, v)| *v = 0.5 + 0.3 * (i as f32 * 0.37).sin());
    }
    let [one, three] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&gaussians(1.0, DVec3::ZERO), &patterned).0)
    });
    assert!(one == three && one.triangles.len() > 1000);
}

#[test]
fn little_or_nothing_to_see_gives_little_or_nothing() {
    let all = gaussians(1.0, DVec3::ZERO);
    let (none, report) = run(&Gaussians::empty(0), &photos(3, 1.0, DVec3::ZERO));
    assert!(none.vertices.is_empty() && report.triangles == 0);
    assert!(run(&all, &[]).0.vertices.is_empty());
    let (one, _) = run(&all, &photos(1, 1.0, DVec3::ZERO));
    assert!(one.is_consistent());
    let mut broken = all;
    broken.means.iter_mut().step_by(3).for_each(|m| *m = [f32::NAN; 3]);
    broken.log_scales.iter_mut().step_by(7).for_each(|s| *s = [f32::INFINITY; 3]);
    let (surface, _) = run(&broken, &photos(12, 1.0, DVec3::ZERO));
    assert!(surface.is_consistent());
    let values = surface.vertices.iter().chain(&surface.normals).flatten();
    assert!(values.clone().all(|v| v.is_finite()));
}

#[test]
fn it_can_be_stopped() {
    let mut calls = 0;
    let mut tick = |_: f32| {
        calls += 1;
        if calls < 3 { Ok(()) } else { Err(DecomposeError::Canceled) }
    };
    let all = gaussians(1.0, DVec3::ZERO);
    let photos = photos(6, 1.0, DVec3::ZERO);
    let result = extract(&all, &photos.iter().collect::<Vec<_>>(), &Options::default(), &mut tick);
    assert_eq!(result.unwrap_err(), DecomposeError::Canceled);
}

/// Bright and dark spots in space.
fn texture(p: DVec3) -> f32 {
    let s = (41.0 * p.x + 9.0 * p.z).sin() * (37.0 * p.y - 11.0 * p.x).sin()
        + (53.0 * p.z + 17.0 * p.y).sin();
    0.4 + 0.15 * s as f32
}

#[test]
fn photos_correct_a_depth_that_is_wrong_everywhere() {
    let mut photos = photos(12, 1.0, DVec3::ZERO);
    let shapes = shapes();
    for photo in &mut photos {
        let view = View::new(photo, &UnitWorld::IDENTITY);
        for y in 0..view.height {
            for x in 0..view.width {
                let direction = view.ray(x as f32 + 0.5, y as f32 + 0.5).normalize();
                let ray = Ray::new(view.center, direction);
                let value = shapes
                    .closest_hit(&ray)
                    .map_or(0.0, |h| texture(ray.at(h.distance).as_dvec3()));
                photo.radiance_linear.floats_mut()[y * photo.camera.width + x] = [value; 3];
            }
        }
    }
    let views: Vec<View> = photos.iter().map(|p| View::new(p, &UnitWorld::IDENTITY)).collect();
    let mut maps = depths(&views, &UnitWorld::IDENTITY, 0.003);
    let exact = maps.clone();
    // 1 % too far, as behind a surface that reflects.
    maps.iter_mut().for_each(|m| m.depth.iter_mut().for_each(|z| *z *= 1.01));
    let error = |refine_rounds: usize| {
        let mut tick = |_: f32| Ok(());
        let mut parts = Parts { tick: &mut tick, times: Vec::new(), started: None };
        let options = Options { refine_rounds, ..fine() };
        let (mesh, _, report) =
            surface_of(&views, exact.clone(), maps.clone(), &options, &mut parts).unwrap();
        let sphere = |v: &Vec3| (v.as_dvec3() - DVec3::new(0.0, 0.0, 0.25)).length() - RADIUS;
        let off: Vec<f64> = mesh
            .vertices
            .iter()
            .filter(|v| v.z > 0.1)
            .map(|v| sphere(v).abs() / report.voxel)
            .collect();
        assert!(off.len() > 1000);
        off.iter().sum::<f64>() / off.len() as f64
    };
    let (before, after) = (error(0), error(4));
    println!("off by {before} voxels, after refinement {after}");
    assert!(before > 0.5, "{before}");
    assert!(after < 0.25 && after < 0.3 * before, "{before} {after}");
}

/// A disk at z = 0, and a dome around it all where asked for.
fn disk(with_dome: bool) -> Gaussians {
    let step = |k: i32| 0.03 * k as f32;
    let grid = (-12..=12).flat_map(|y| (-12..=12).map(move |x| Vec3::new(step(x), step(y), 0.0)));
    let of_disk = grid.filter(|p| p.length() < 0.35).map(|p| (p, [0.02, 0.02, 0.001]));
    // Golden spiral.
    let at = |k: i32| {
        let (z, turn) = (1.0 - (k as f32 + 0.5) / 200.0, 2.399_963 * k as f32);
        let r = (1.0 - z * z).max(0.0).sqrt();
        (Vec3::new(r * turn.cos(), r * turn.sin(), z) * 35.0, [4.0; 3])
    };
    let dome = (0..400).map(at).take(if with_dome { 400 } else { 0 });
    let (means, scales): (Vec<Vec3>, Vec<[f32; 3]>) = of_disk.chain(dome).unzip();
    Gaussians {
        rotations: vec![[1.0, 0.0, 0.0, 0.0]; means.len()],
        log_scales: scales.iter().map(|s| s.map(f32::ln)).collect(),
        opacity_logits: vec![5.0; means.len()],
        sh: vec![0.0; 3 * means.len()],
        means: means.iter().map(Vec3::to_array).collect(),
        ..Gaussians::empty(0)
    }
}

#[test]
fn what_stands_for_the_sky_is_no_surface() {
    let photos = photos(12, 1.0, DVec3::ZERO);
    let photos: Vec<&Photo> = photos.iter().collect();
    let of = |gaussians: &Gaussians| extract(gaussians, &photos, &fine(), &mut |_| Ok(())).unwrap();
    let [(plain, report), (domed, under_dome)] = [false, true].map(|dome| of(&disk(dome)));
    assert!(plain.triangles.len() > 100, "{report:?}");
    assert_eq!(report.voxel, under_dome.voxel);
    assert_eq!(plain, domed);
}
