//! A made scene is consistent with itself, and scores see the difference between good and bad.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DVec3, Vec3};
use motes_formats::colmap::read_model;
use motes_formats::environment::{read_environment, write_environment};
use motes_formats::exr_aov::{AovChannel, open_exr, write_exr};
use motes_formats::images::{read_image, write_png};
use motes_scene::ImageF32;
use motes_shading::brdf::Lobes;
use motes_shading::tracing::Ray;
use motes_truth::cameras::ring;
use motes_truth::faults::Fault;
use motes_truth::lamps::LampShape;
use motes_truth::lights::environment;
use motes_truth::path::PathTracer;
use motes_truth::render::{buffers, radiance};
use motes_truth::repainted::{Repaint, make_repainted};
use motes_truth::scenes::SceneName;
use motes_truth::score::align::Align;
use motes_truth::score::pictures::PSNR_CAP_DB;
use motes_truth::score::truth_folder::TruthFolder;
use motes_truth::score::{Results, score};
use motes_truth::world::World;
use motes_truth::{MakeOptions, make};

fn tiny() -> MakeOptions {
    MakeOptions { width: 48, train_views: 4, test_views: 2, samples: 2, ..MakeOptions::default() }
}

fn made(name: SceneName, threads: usize, folder: &Path) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| make(name, &tiny(), folder, &mut |_| {})).unwrap();
}

fn files(root: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut folders = vec![root.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(root).unwrap().to_string_lossy().into_owned();
                all.insert(name, std::fs::read(path).unwrap());
            }
        }
    }
    all
}

#[test]
fn the_files_are_the_same_at_any_thread_count() {
    let (one, three) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    made(SceneName::Bedroom, 1, one.path());
    made(SceneName::Bedroom, 3, three.path());
    made(SceneName::Kitchen, 1, &one.path().join("kitchen"));
    made(SceneName::Kitchen, 3, &three.path().join("kitchen"));
    let (one, three) = (files(one.path()), files(three.path()));
    // 4 photos, 4 lights with previews, 2 test views under 4 lights as PNG and EXR, ...
    assert!(one.len() > 40, "{} files", one.len());
    for (name, bytes) in &one {
        assert!(three[name] == *bytes, "{name} differs");
    }
}

#[test]
fn cameras_points_and_depths_agree() {
    let folder = tempfile::tempdir().unwrap();
    made(SceneName::Studio, 2, folder.path());
    let model = read_model(&folder.path().join("sparse/0")).unwrap();
    assert_eq!(model.images.len(), 4);
    assert!(model.points.len() > 200, "{} points", model.points.len());
    let mut errors = Vec::new();
    for image in &model.images {
        for (at, id) in &image.observations {
            let point = &model.points[*id as usize - 1];
            let q = image.camera_from_world.transform_point(point.position);
            let f = 1.12 * 48.0;
            errors.push((24.0 + f * q.x / q.z - at[0]).hypot(18.0 + f * q.y / q.z - at[1]));
        }
    }
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    assert!(mean > 0.1 && mean < 1.5, "{mean} px");

    // The center of the depth map lies on the object that the id picture names.
    let recipe = SceneName::Studio.recipe();
    let world = World::new(&recipe, Lobes::Burley).unwrap();
    let shots = ring(&recipe, (48, 36), 4, 2);
    let depth = open_exr(&folder.path().join("aov/test_000_depth.exr")).unwrap();
    let depth = depth.channel("Z").unwrap().to_f32();
    let ids = read_image(&folder.path().join("aov/test_000_id.png")).unwrap();
    let camera = &shots[4];
    for (x, y) in [(24, 18), (5, 30), (40, 9)] {
        let i = y * 48 + x;
        let local = DVec3::new(x as f64 + 0.5 - 24.0, y as f64 + 0.5 - 18.0, camera.focal);
        let p = camera
            .camera_from_world
            .inverse()
            .transform_point(local / camera.focal * f64::from(depth[i]));
        let (low, high) = world.bounds[ids.data[3 * i] as usize - 1];
        let slack = Vec3::splat(1e-3 * recipe.unit);
        let p = p.as_vec3();
        assert!(p.cmpge(low - slack).all() && p.cmple(high + slack).all(), "{p} {low} {high}");
    }
}

#[test]
fn nothing_shines_in_a_furnace_and_open_ground_returns_its_base_color() {
    let recipe = SceneName::Matte.recipe();
    let world = World::new(&recipe, Lobes::Burley).unwrap();
    let light = environment(&ImageF32::filled(16, 8, 3, 1.0)).unwrap();
    let tracer = PathTracer::new(&world, &light, 8, 1);
    let shot = &ring(&recipe, (64, 48), 4, 0)[1];
    let guide = buffers(&world, shot);
    let picture = radiance(&tracer, shot, &guide, 64, (1, 0));
    let mut open = Vec::new();
    for (i, (l, b)) in
        picture.data.chunks_exact(3).zip(guide.albedo.data.chunks_exact(3)).enumerate()
    {
        assert!(l.iter().all(|&v| v < 1.0), "pixel {i} shines: {l:?}");
        let p = Vec3::from_slice(&guide.position.data[3 * i..3 * i + 3]);
        if guide.ids[i] == 1 && p.truncate().length() > 1.5 {
            open.push(l.iter().sum::<f32>() / b.iter().sum::<f32>());
        }
    }
    let mean = open.iter().sum::<f32>() / open.len() as f32;
    assert!(open.len() > 50 && (mean - 1.0).abs() < 0.03, "{mean} over {} pixels", open.len());
}

#[test]
fn a_lamp_over_the_ground_lights_it_by_the_square_of_its_distance() {
    let radius = 0.05;
    let mut recipe = SceneName::Bedroom.recipe();
    recipe.things.clear();
    recipe.walls.clear();
    recipe.lambert = true;
    recipe.lamps.truncate(1);
    recipe.lamps[0].shape = LampShape::Ball { center: Vec3::Z, radius };
    recipe.lamps[0].radiance = Vec3::splat(40.0);
    let world = World::new(&recipe, Lobes::Burley).unwrap();
    let black = environment(&ImageF32::filled(16, 8, 3, 0.0)).unwrap();
    let dark = PathTracer::new(&world, &black, 0, 1);
    let lit = PathTracer::new(&world, &black, 0, 1).with_lamps();
    for aside in [0.0, 0.8] {
        let p = recipe.origin + Vec3::new(aside, 0.0, 0.0) * recipe.unit;
        let from = p + Vec3::new(0.4, 0.7, 1.0) * recipe.unit;
        let ray = Ray::new(from, (p - from).normalize());
        let base = world.see(&ray).unwrap().point.material.base_color_linear;
        // A far sphere shines like a disc of its radius: E = L pi r^2 cos / d^2, here both over pi.
        let distance2 = 1.0 + aside * aside;
        let expected = base * 40.0 * radius * radius / (distance2 * distance2.sqrt());
        let mean: Vec3 = (0..512).map(|i| lit.radiance(ray, 5, i, 512)).sum::<Vec3>() / 512.0;
        assert!((mean / expected - 1.0).abs().max_element() < 0.03, "{aside}: {mean} {expected}");
        assert_eq!(dark.radiance(ray, 5, 0, 1), Vec3::ZERO);
    }
    // Seen directly it has its radiance.
    let eye = recipe.origin + Vec3::new(1.0, 0.0, 1.0) * recipe.unit;
    assert_eq!(lit.radiance(Ray::new(eye, Vec3::NEG_X), 0, 0, 1), Vec3::splat(40.0));
}

#[test]
fn faults_change_the_photos_and_the_told_poses_and_leave_the_truth() {
    let (ideal, phone) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let with = |faults: &[Fault], folder: &Path| {
        let options = MakeOptions { faults: Some(faults.to_vec()), ..tiny() };
        make(SceneName::Matte, &options, folder, &mut |_| {}).unwrap();
    };
    with(&[], ideal.path());
    with(&[Fault::PoseNoise, Fault::SensorNoise, Fault::Jpeg], phone.path());
    let (ideal, phone) = (files(ideal.path()), files(phone.path()));
    let touched = ["images/train_", "sparse/0/", "transforms_train", "scene.json"];
    for (name, bytes) in &ideal {
        let may_differ = touched.iter().any(|start| name.starts_with(start));
        assert!(may_differ || phone[name] == *bytes, "{name} differs");
    }
    assert!(ideal["images/train_000.png"] != phone["images/train_000.png"]);
    assert!(ideal["transforms_train.json"] != phone["transforms_train.json"]);
}

/// The truth's own buffers in the names of a prediction, changed by `change`.
fn predict(truth: &TruthFolder, to: &Path, change: impl Fn(&str, usize, f32) -> f32) {
    for view in &truth.views {
        let mut channels = Vec::new();
        let b = truth.buffers(view).unwrap();
        for (layer, names, image) in [
            ("base_color", &["R", "G", "B"][..], &b.albedo),
            ("normal", &["X", "Y", "Z"][..], &b.normal),
            ("roughness", &[""][..], &b.roughness),
            ("metallic", &[""][..], &b.metallic),
        ] {
            for (c, name) in names.iter().enumerate() {
                let plane = image.data.iter().skip(c).step_by(names.len());
                let values = plane.map(|&v| change(layer, c, v)).collect();
                let name = if name.is_empty() { layer.into() } else { format!("{layer}.{name}") };
                channels.push(AovChannel::float(name, values));
            }
        }
        let (w, h) = truth.size;
        write_exr(&to.join(format!("{view}.exr")), w, h, &channels, &[]).unwrap();
    }
}

#[test]
fn the_truth_scores_best_and_what_is_wrong_with_a_result_is_named() {
    let (folder, same, worse) =
        (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    made(SceneName::Studio, 2, folder.path());
    let truth = TruthFolder::open(folder.path()).unwrap();
    predict(&truth, same.path(), |_, _, v| v);
    predict(&truth, worse.path(), |layer, c, v| match layer {
        "base_color" => v * [0.5, 0.7, 0.6][c],
        "roughness" => v + 0.1,
        "metallic" => 0.0,
        _ => v,
    });
    let relit = |of: &str| folder.path().join("test").join(of);
    let light = truth.lights[0].clone();
    let results = |picture: &str, buffers: &Path| Results {
        relit: BTreeMap::from([(light.clone(), relit(picture))]),
        buffers: Some(buffers.to_path_buf()),
        ..Results::default()
    };
    let best = score(&truth, &results(&format!("relight_{light}"), same.path())).unwrap();
    let pictures = |s: &motes_truth::score::Scores, a| s.relit[&light].aligned[&a].psnr_db;
    assert!(pictures(&best, Align::None) >= PSNR_CAP_DB);
    let m = best.materials.unwrap();
    assert!(m.objects.pixels > 100 && m.objects.normal_mae_deg < 0.1, "{m:?}");
    assert!(m.objects.roughness_mse + m.objects.metallic_mse < 1e-9);
    assert!(m.objects.base_color[&Align::None].psnr_linear_db >= PSNR_CAP_DB);

    let bad = score(&truth, &results("capture", worse.path())).unwrap();
    assert!(pictures(&bad, Align::None) < 30.0);
    assert!(pictures(&bad, Align::Channel) > pictures(&bad, Align::None));
    let m = bad.materials.unwrap().objects;
    let color = |a| m.base_color[&a].psnr_linear_db;
    assert!(color(Align::None) < 25.0 && color(Align::Scalar) > color(Align::None) + 3.0);
    assert!(color(Align::Channel) > 60.0, "{}", color(Align::Channel));
    assert!((m.roughness_mse - 0.01).abs() < 1e-4 && m.metallic_mse > 0.1, "{m:?}");

    // A missing picture is an error that names it.
    let empty = tempfile::tempdir().unwrap();
    let missing = Results { splat: Some(empty.path().to_path_buf()), ..Results::default() };
    let error = format!("{:#}", score(&truth, &missing).unwrap_err());
    assert!(error.contains("test_000.png"), "{error}");
    let white = motes_scene::ImageU8::filled(8, 8, 3, 255);
    write_png(&empty.path().join("test_000.png"), &white).unwrap();
    let error = format!("{:#}", score(&truth, &missing).unwrap_err());
    assert!(error.contains("8 x 8"), "{error}");
}

#[test]
fn what_is_repainted_differs_where_it_is_and_the_same_paint_under_the_same_light_is_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let options = MakeOptions { no_relights: true, samples: 16, ..tiny() };
    make(SceneName::Kitchen, &options, folder.path(), &mut |_| {}).unwrap();
    let truth = TruthFolder::open(folder.path()).unwrap();
    // The light of the photos, in photo values.
    let map = read_environment(&folder.path().join("env/overcast.exr")).unwrap();
    let file = folder.path().join("light.exr");
    write_environment(&file, &map.scaled(truth.exposure as f32), &[]).unwrap();
    let black: Repaint = "cabinet=0.03,0.03,0.03,0.9,0".parse().unwrap();
    for (name, repaints) in [("same", &[][..]), ("black", &[black][..])] {
        let lights = [(name.to_owned(), file.clone())];
        make_repainted(SceneName::Kitchen, repaints, &lights, folder.path()).unwrap();
    }
    let mean = |place: &str, is_meant: bool| {
        let (mut sum, mut n) = (0.0, 0.0);
        for view in &truth.views {
            let picture = truth.picture(&folder.path().join("test").join(place), view).unwrap();
            let ids = truth.buffers(view).unwrap().ids;
            for (id, pixel) in ids.data.iter().zip(picture.data.chunks_exact(3)) {
                let object = truth.objects.iter().find(|o| o.id == *id);
                if object.is_some_and(|o| o.name.starts_with("cabinet")) == is_meant {
                    sum += pixel.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0;
                    n += 1.0;
                }
            }
        }
        sum / n
    };
    for is_meant in [true, false] {
        let (own, same) = (mean("capture", is_meant), mean("relight_same", is_meant));
        assert!((own - same).abs() < 2.0, "{own} {same}");
    }
    assert!(mean("relight_black", true) < 0.5 * mean("capture", true));
    assert!(mean("relight_black", false) > 0.85 * mean("capture", false));
    // A folder of another scene is refused.
    let error = make_repainted(SceneName::Studio, &[], &[("x".into(), file)], folder.path());
    assert!(error.unwrap_err().to_string().contains("kitchen"));
}
