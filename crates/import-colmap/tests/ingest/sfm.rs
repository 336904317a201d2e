//! The path from photos, with a stand-in for the Python that runs the driver: a shell script that
//! answers as the driver would. The real tools are tried by hand; see `docs/stages/import-colmap.md`.

#![cfg(unix)]

use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;

use import_colmap::{
    ImportInput, ImportOptions, ImportReport, IngestError, Keypoints, Result, SfmOptions, Silent,
    Source, import, import_photos,
};
use motes_formats::capture::read_capture;
use motes_scene::{Camera, CameraModel, Switch};

use crate::common::Project;

fn project() -> Project {
    let camera = Camera {
        model: CameraModel::Pinhole,
        width: 64,
        height: 48,
        params: vec![60.0, 60.0, 32.0, 24.0],
    };
    let project = Project::new(camera, &["a.png", "b.png", "c.png"]);
    project.write_photos();
    project.write_model_to("solved");
    project
}

/// A result line: registered photos, error, focal prior, focal length.
fn result(registered: usize, error: f64, prior: &str, focal: f64) -> String {
    format!(
        r#"{{"event":"result","models":[{{"path":"'"$5"'/sparse/0","registered":{registered},"points":4,"mean_reprojection_error_px":{error},"median_triangulation_angle_deg":20.0,"cameras":[{{"width":64,"height":48,"photos":3}}]}}],"photos":3,"focal_prior_px":{prior},"focal_prior_source":"none","focal_px":{focal},"contradicted":0,"verified_pairs":3,"features":900,"pycolmap":"0.0","seconds":1.0}}"#
    )
}

/// Makes the stand-in. `body` sees the arguments: $1 the script, $3 the photos, $5 the workspace.
fn python(project: &Project, body: &str) -> PathBuf {
    let path = project.path().join("python");
    let solved = project.path().join("solved");
    let head = format!(
        "#!/bin/sh\n[ \"$1\" = -c ] && exit 0\ntest -s \"$1\" || exit 9\nmkdir -p \"$5/sparse\"\ncp -r '{}' \"$5/sparse/0\"\n",
        solved.display()
    );
    std::fs::write(&path, format!("{head}{body}\n")).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    path
}

fn solve(project: &Project, body: &str, focal: Option<f64>) -> Result<ImportReport> {
    solve_with(project, body, SfmOptions { focal, ..SfmOptions::default() })
}

fn solve_with(project: &Project, body: &str, sfm: SfmOptions) -> Result<ImportReport> {
    let sfm = SfmOptions { python: Some(python(project, body)), ..sfm };
    let output = project.output();
    std::fs::create_dir_all(&output).unwrap();
    import_photos(&project.path().join("images"), &output, &ImportOptions::default(), &sfm, &Silent)
}

#[test]
fn a_good_solution_becomes_a_capture() {
    let project = project();
    let body = format!(
        "echo '{}'\necho noise >&2\necho '{}'",
        r#"{"event":"progress","phase":"features","done":1,"total":3}"#,
        result(3, 0.4, "60.0", 60.5)
    );
    let report = solve(&project, &body, None).unwrap();
    assert_eq!((report.registered, report.photos, report.points), (3, 3, 4));
    let sfm = report.sfm.unwrap();
    assert_eq!((sfm.tool.as_str(), sfm.focal_px), ("pycolmap 0.0", 60.5));
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
    let capture = read_capture(&project.output().join("capture.json")).unwrap();
    assert_eq!(capture.views.len(), 3);
}

#[test]
fn a_doubtful_solution_is_tried_again_with_a_prior_and_the_better_one_kept() {
    let project = project();
    let body = format!(
        "case \"$*\" in *--focal-px*) echo '{}';; *) echo '{}';; esac",
        result(3, 0.5, "76.8", 75.0),
        result(3, 1.3, "null", 40.0)
    );
    let report = solve(&project, &body, None).unwrap();
    let sfm = report.sfm.unwrap();
    assert_eq!((sfm.focal_px, sfm.focal_prior_source.as_str()), (75.0, "guess"));
    let told = report.notes.join("\n");
    assert!(
        told.contains("no focal length prior") && told.contains("the second was kept"),
        "{told}"
    );
    // With a focal length of the user's there is one run, and its doubts are told.
    let body = format!("echo '{}'", result(2, 1.3, "60.0", 90.0));
    let report = solve(&project, &body, Some(60.0)).unwrap();
    let warnings = report.warnings.join("\n");
    for part in ["2 of 3 photos have a pose", "1.30 px", "+50 %"] {
        assert!(warnings.contains(part), "{part}: {warnings}");
    }
}

/// Solves in a workspace that stays.
fn solve_in(project: &Project, body: &str, keypoints: Keypoints) -> Result<ImportReport> {
    let sfm_workspace = Some(project.path().join("workspace"));
    solve_with(project, body, SfmOptions { sfm_workspace, keypoints, ..SfmOptions::default() })
}

/// Answers by whether faint keypoints are asked for, and leaves a mark of it in the model.
fn clear_or_faint(clear: &str, faint: &str) -> String {
    format!(
        "case \"$*\" in *--guided-matching*) touch \"$5/sparse/0/faint\"; {faint};; *) {clear};; esac"
    )
}

#[test]
fn faint_keypoints_are_matched_where_photos_have_no_pose() {
    let project = project();
    let say = |registered, error| format!("echo '{}'", result(registered, error, "60.0", 60.5));
    let body = clear_or_faint(&say(2, 0.4), &say(3, 0.9));
    let report = solve_in(&project, &body, Keypoints::Auto).unwrap();
    let told = report.notes.join("\n");
    assert!(told.contains("faint keypoints: 3 of 3 photos"), "{told}");
    assert!(told.contains("the second was kept"), "{told}");
    let workspace = project.path().join("workspace");
    assert!(workspace.join("sparse/0/faint").exists(), "the kept model lies where users look");
    assert!(workspace.join("run-2/sparse/0").exists(), "and the other beside it");
    assert!(!workspace.join("run-2/sparse/0/faint").exists());

    std::fs::remove_dir_all(&workspace).unwrap();
    let report = solve_in(&project, &body, Keypoints::Clear).unwrap();
    assert!(!report.notes.join("\n").contains("faint") && report.sfm.unwrap().attempts.is_empty());
    assert!(!workspace.join("sparse/0/faint").exists());
    solve_in(&project, &body, Keypoints::Faint).unwrap();
    assert!(workspace.join("sparse/0/faint").exists());
}

#[test]
fn faint_keypoints_are_tried_where_clear_ones_come_to_nothing() {
    let project = project();
    let fails = r#"{ echo '{"event":"error","code":"no_model","message":"No model.","remedy":"R."}'; exit 1; }"#;
    let good = format!("echo '{}'", result(3, 0.9, "60.0", 60.5));
    let report = solve_in(&project, &clear_or_faint(fails, &good), Keypoints::Auto).unwrap();
    let told = report.notes.join("\n");
    assert!(told.contains("failed: No model.") && told.contains("3 of 3 photos"), "{told}");
    // A program that breaks in the second run takes nothing away from the first.
    let broken = clear_or_faint(&format!("echo '{}'", result(2, 0.4, "60.0", 60.5)), "exit 139");
    let report = solve_in(&project, &broken, Keypoints::Auto).unwrap();
    assert!(report.notes.join("\n").contains("the first was kept"), "{:?}", report.notes);
}

#[test]
fn failures_keep_the_words_and_the_kind() {
    let project = project();
    let error = |body: &str| solve(&project, body, None).unwrap_err();
    let bad = error(
        r#"echo '{"event":"error","code":"too_few_matches","message":"No two match.","remedy":"Overlap."}'; exit 1"#,
    );
    assert!(
        matches!(&bad, IngestError::BadInput { cause, remedy } if cause == "No two match." && remedy == "Overlap.")
    );
    let crash = error("echo 'segmentation fault' >&2; exit 139");
    assert!(
        matches!(&crash, IngestError::Failed { cause, .. } if cause.contains("segmentation fault"))
    );
    let silent = error("exit 0");
    assert!(
        matches!(&silent, IngestError::Failed { cause, .. } if cause.contains("without a result"))
    );
    let output = project.output();
    let missing =
        SfmOptions { python: Some(project.path().join("no-python")), ..SfmOptions::default() };
    let photos = project.path().join("images");
    let error =
        import_photos(&photos, &output, &ImportOptions::default(), &missing, &Silent).unwrap_err();
    assert!(
        matches!(&error, IngestError::Failed { cause, remedy } if cause.contains("no-python") && remedy.contains("pip install"))
    );
}

#[test]
fn photos_lying_on_their_side_are_solved_and_written_upright() {
    let project = project();
    // Portrait photos stored as landscape: orientation 6 says "turn right". The pinhole of the
    // solved model is 64 x 48, so the stored pixels are 48 x 64.
    let exif: Vec<u8> =
        [b"II*\0\x08\0\0\0\x01\0".as_slice(), b"\x12\x01\x03\0\x01\0\0\0\x06\0\0\0", &[0; 4]]
            .concat();
    for name in ["a.png", "b.png", "c.png"] {
        let mut pixels = image::RgbImage::from_pixel(48, 64, image::Rgb([10, 20, 30]));
        // The top-left corner of the stored photo is at the top right of the upright one.
        (0..8).for_each(|i| pixels.put_pixel(i % 4, i / 4, image::Rgb([250, 20, 30])));
        let file = std::fs::File::create(project.path().join("images").join(name)).unwrap();
        let mut encoder = image::codecs::png::PngEncoder::new(file);
        image::ImageEncoder::set_exif_metadata(&mut encoder, exif.clone()).unwrap();
        image::ImageEncoder::write_image(encoder, &pixels, 48, 64, image::ExtendedColorType::Rgb8)
            .unwrap();
    }
    let body = format!(
        "test \"$3\" != '{}' || exit 7\necho '{}'",
        project.path().join("images").display(),
        result(3, 0.4, "60.0", 60.0)
    );
    let report = solve(&project, &body, None).unwrap();
    assert!(
        report.notes.iter().any(|note| note.contains("3 photos were turned upright")),
        "{:?}",
        report.notes
    );
    let image = motes_formats::images::read_image(&project.output().join("images/a.png")).unwrap();
    assert_eq!((image.width, image.height), (64, 48));
    assert_eq!((image.pixel(63, 0), image.pixel(0, 0)), (&[250, 20, 30][..], &[10, 20, 30][..]));
}

/// Imports posed photos without points. In the stand-in $7 is the request.
fn triangulate(project: &Project, body: &str, when: Switch) -> Result<ImportReport> {
    let python = Some(python(project, body));
    let sfm = SfmOptions { python, triangulate: when, ..SfmOptions::default() };
    let output = project.output();
    std::fs::create_dir_all(&output).unwrap();
    // The model without its points: poses alone.
    let posed = project.path().join("posed");
    std::fs::create_dir_all(&posed).unwrap();
    for name in ["cameras.txt", "images.txt"] {
        std::fs::copy(project.path().join("solved").join(name), posed.join(name)).unwrap();
    }
    std::fs::write(posed.join("points3D.txt"), "").unwrap();
    let (model, images) = (Some(posed), Some(project.path().join("images")));
    let source = Source::recognize(&ImportInput { input: None, model, images })?;
    import(&source, &output, &ImportOptions::default(), &sfm, &Silent)
}

const TRIANGULATED: &str = r#"echo '{"event":"result","points":4,"pycolmap":"0.0","mean_reprojection_error_px":0.5,"seconds":1.0}'"#;

#[test]
fn posed_photos_without_points_get_triangulated_ones() {
    let project = project();
    let keep = project.path().join("request.json");
    let body = format!("cp \"$7\" '{}'\n{TRIANGULATED}", keep.display());
    let report = triangulate(&project, &body, Switch::Auto).unwrap();
    assert_eq!(report.points, 4);
    assert!(report.notes.iter().any(|note| note.contains("4 start points triangulated")));
    let request = std::fs::read_to_string(keep).unwrap();
    let request: serde_json::Value = serde_json::from_str(&request).unwrap();
    assert_eq!(request["photos"].as_array().unwrap().len(), 3);
    assert!(!request["pairs"].as_array().unwrap().is_empty());
    let capture = read_capture(&project.output().join("capture.json")).unwrap();
    assert_eq!(capture.points.len(), 4);
}

#[test]
fn a_triangulation_that_fails_is_an_error_only_when_it_was_asked_for() {
    let fails = r#"echo '{"event":"error","code":"too_few_matches","message":"no two match","remedy":"r"}'; exit 1"#;
    let project = project();
    let report = triangulate(&project, fails, Switch::Auto).unwrap();
    assert_eq!(report.points, 0);
    assert!(report.warnings.iter().any(|w| w.contains("no two match")), "{:?}", report.warnings);
    let error = triangulate(&project, fails, Switch::On).unwrap_err();
    assert!(matches!(error, IngestError::BadInput { .. }), "{error}");
    let report = triangulate(&project, "exit 7", Switch::Off).unwrap();
    assert!(report.warnings.is_empty() && report.points == 0);
}

#[test]
fn photos_that_contradict_their_matches_go_one_at_a_time() {
    // Matches and agreeing ones of pairs of photos. 4 was placed by 20 chance matches with 3; what it shares with 1 and 2 contradicts it, and
    // takes their share and that of 3 down with it.
    let script = "from pycolmap_contradicted import contradicted\n\
        right = {(1, 2): (100, 60), (2, 3): (50, 20), (1, 3): (40, 15)}\n\
        wrong = {(1, 4): (150, 0), (2, 4): (60, 1), (3, 4): (40, 20)}\n\
        print(contradicted(right), contradicted({**right, **wrong}), contradicted({}), contradicted({(1, 2): (9, 0)}))";
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src/files/sfm");
    let output = std::process::Command::new("python3")
        .args(["-B", "-c", script])
        .env("PYTHONPATH", folder)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(said.trim(), "[] [4] [] []", "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_driver_ends_cleanly_while_motes_lives() {
    // The driver listens to its standard input, which motes keeps open until the driver has ended.
    let driver = concat!(env!("CARGO_MANIFEST_DIR"), "/src/files/sfm/pycolmap_driver.py");
    let empty = tempfile::tempdir().unwrap();
    let folder = empty.path().to_str().unwrap();
    let mut child = std::process::Command::new("python3")
        .args([driver, "--photos", folder, "--workspace", folder, "--end-with-parent"])
        .stdin(std::process::Stdio::piped())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let held_open = child.stdin.take();
    let ended = child.wait_with_output().unwrap();
    drop(held_open);
    let said = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(1), "{said}");
    assert!(said.contains("No photos") && !said.contains("Fatal"), "{said}");
}
