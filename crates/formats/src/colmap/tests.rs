use std::path::PathBuf;
use std::time::Instant;

use super::*;

fn corpus(part: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../testdata/colmap").join(part)
}

#[test]
fn the_text_model_says_what_was_written() {
    let model = read_model(&corpus("valid/text")).unwrap();
    assert_eq!(model.notes, Vec::<String>::new());
    let camera = &model.cameras[&7];
    assert_eq!((camera.model, camera.width, camera.height), (CameraModel::Opencv, 800, 600));
    assert_eq!(camera.params, [700.5, 701.25, 400.5, 299.5, 0.0625, -0.015625, 0.001, -0.002]);
    let names: Vec<_> = model.images.iter().map(|image| image.name.as_str()).collect();
    assert_eq!(names, ["a.png", "left/first photo.jpg", "zweites Bild ü.jpg"]);
    let (empty, first) = (&model.images[0], &model.images[1]);
    assert!(empty.observations.is_empty(), "its second line is empty");
    assert_eq!((first.id, first.camera_id), (3, 1));
    assert_eq!(first.observations, [([100.5, 200.25], 11), ([410.75, 80.5], 12)]);
    // q = (1, 1, 1, 1)/2 turns x to y to z.
    let turned = empty.camera_from_world.transform_point(DVec3::X);
    assert!((turned - DVec3::new(0.0, 1.0, 3.0)).length() < 1e-12, "{turned}");
    assert_eq!(model.points[0].color, [255, 128, 0]);
    assert_eq!(model.points[0].error, Some(0.75));
    assert_eq!(model.points[1].error, None, "-1 says that there is none");
    assert_eq!(model.points[1].track, [3, 9]);
}

#[test]
fn what_pycolmap_writes_is_the_same_model() {
    let text = read_model(&corpus("valid/text")).unwrap();
    for folder in ["valid/pycolmap-4-binary", "valid/pycolmap-4-text"] {
        let model = read_model(&corpus(folder)).unwrap();
        assert_eq!(model.cameras, text.cameras, "{folder}");
        assert_eq!(model.images.len(), text.images.len());
        for (a, b) in model.images.iter().zip(&text.images) {
            assert_eq!((a.id, &a.name, a.camera_id), (b.id, &b.name, b.camera_id), "{folder}");
            assert_eq!(a.observations, b.observations, "{folder} {}", a.name);
            let (a, b) = (a.camera_from_world, b.camera_from_world);
            assert!(a.rotation.dot(b.rotation).abs() > 1.0 - 1e-12);
            assert!((a.translation - b.translation).length() < 1e-12);
        }
        let mut points = model.points.clone();
        points.sort_by_key(|point| point.id);
        assert_eq!(points, text.points, "{folder}");
    }
}

#[test]
fn every_invalid_model_is_refused_at_once_and_for_its_reason() {
    let mut cases = 0;
    for entry in std::fs::read_dir(corpus("invalid")).unwrap() {
        let path = entry.unwrap().path();
        if !path.is_dir() {
            continue;
        }
        let expected = std::fs::read_to_string(path.with_extension("expect")).unwrap();
        let started = Instant::now();
        let error = read_model(&path).unwrap_err().to_string();
        assert!(started.elapsed().as_secs_f64() < 1.0);
        assert!(error.contains(expected.trim()), "{}: {error}", path.display());
        cases += 1;
    }
    assert!(cases >= 40, "{cases} cases");
}

#[test]
fn cutting_a_file_anywhere_is_an_error_and_no_panic() {
    let folder = corpus("valid/pycolmap-4-binary");
    for (which, name) in ["cameras", "images", "points3D"].iter().enumerate() {
        let whole = std::fs::read(folder.join(format!("{name}.bin"))).unwrap();
        for end in 0..=whole.len() {
            let mut data = vec![which as u8];
            data.extend_from_slice(&whole[..end]);
            assert_eq!(fuzz_one(&data), end == whole.len(), "{name} cut at {end}");
        }
        // Every single byte damaged: any outcome but a panic or a runaway allocation.
        for at in 0..whole.len() {
            let mut data = vec![which as u8];
            data.extend_from_slice(&whole);
            data[at + 1] ^= 0xff;
            fuzz_one(&data);
        }
    }
}

#[test]
fn models_are_found_in_a_project() {
    let folder = tempfile::tempdir().unwrap();
    let put = |place: &str| {
        let to = folder.path().join(place);
        std::fs::create_dir_all(&to).unwrap();
        for file in ["cameras.txt", "images.txt", "points3D.txt"] {
            std::fs::copy(corpus("valid/text").join(file), to.join(file)).unwrap();
        }
    };
    assert!(find_models(folder.path()).is_empty());
    put("sparse/10");
    put("sparse/2");
    let found: Vec<_> = find_models(folder.path())
        .iter()
        .map(|p| p.strip_prefix(folder.path()).unwrap().to_owned())
        .collect();
    assert_eq!(found, [PathBuf::from("sparse/2"), PathBuf::from("sparse/10")]);
    put(".");
    assert_eq!(find_models(folder.path()).len(), 3);
}

#[test]
fn a_model_without_points_is_read_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    for file in ["cameras.txt", "images.txt"] {
        std::fs::copy(corpus("valid/text").join(file), folder.path().join(file)).unwrap();
    }
    let model = read_model(folder.path()).unwrap();
    assert!(model.points.is_empty());
    assert!(model.notes[0].contains("no start points"), "{:?}", model.notes);
}
