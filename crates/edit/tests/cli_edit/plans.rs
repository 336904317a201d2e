//! Plans: what is refused, what starts no program, the schema.

use super::*;

#[test]
fn bad_plans_fail_with_a_pointer_and_lose_nothing() {
    let toy = toy_scene();
    let stale = BoundGaussians {
        sha256: "0".repeat(64),
        count: 4,
        name: "other.ply".into(),
        same_rows_as: None,
    };
    let stale = SelectionDocument::new(&Selection::all(4), stale, SelectionNotes::default());
    write_selection(&toy.path("stale.json"), &stale).unwrap();
    // An old product is there, and stays.
    let old = [&SCENE[..], &["--order", "-o", "out", "-q"]].concat();
    assert_code(&edit(&toy, &old), 0);
    let select = json!({ "op": "select", "id": "a", "steps": [{ "by": "all" }] });
    let nothing = json!({ "op": "select", "steps": [{ "by": "sphere", "center": [99, 0, 0], "radius": 0.1 }] });
    let file = json!({ "op": "select", "steps": [{ "by": "file", "path": "stale.json" }] });
    let missing = json!({ "op": "insert", "file": "no.ply" });
    let before = files(toy.folder.path());
    for (ops, place) in [
        (json!([{ "op": "explode" }]), "/ops/0/op"),
        (json!([{ "op": "transform", "scale": 0 }]), "/ops/0/scale"),
        (json!([{ "op": "transform", "translate": [1e300, 0, 0] }]), "/ops/0"),
        (json!([{ "op": "delete" }]), "/ops/0/target"),
        (json!([{ "op": "delete", "target": "a" }, select]), "/ops/0/target"),
        (
            json!([select, { "op": "delete", "target": "a" }, { "op": "measure", "target": "a" }]),
            "/ops/2/target",
        ),
        (json!([nothing]), "/ops/0/steps"),
        (json!([{ "op": "drop_nan" }, file]), "/ops/1/steps/0"),
        (json!([missing]), "/ops/0/file"),
        // What reads itself: the output that it writes, a part of it, the plan as a thing.
        (json!([{ "op": "insert", "file": "out" }]), "/ops/0/file"),
        (
            json!([{ "op": "drop_nan" }, { "op": "swap", "file": "./scene/../out/gaussians.ply" }]),
            "/ops/1/file",
        ),
        (json!([{ "op": "set_environment", "file": "out/environment.exr" }]), "/ops/0/file"),
        (json!([{ "op": "insert", "file": "plan.json" }]), "/ops/0"),
        (
            json!([{ "op": "select", "steps": [{ "by": "file", "path": "plan.json" }] }]),
            "/ops/0/steps/0",
        ),
        (
            json!([{ "op": "insert", "file": "scene", "align": "none", "at": [1e18, 0, 0], "scale": 1e18 }]),
            "/ops/0",
        ),
        (json!([{ "op": "insert", "file": "scene", "at": [0, 1e19, 0] }]), "/ops/0/at/1"),
        (json!([{ "op": "set_material", "name": "mithril" }]), "/ops/0/name"),
        (
            json!([{ "op": "duplicate", "target": "all", "translate": [9, 0, 0], "count": 9000 }]),
            "/ops/0/count",
        ),
        (
            json!([{ "op": "select", "steps": [{ "by": "ids", "ids": [4_000_000] }] }]),
            "/ops/0/steps/0/ids",
        ),
        (json!([{ "op": "render", "view": "no such view" }]), "/ops/0/view"),
        (
            json!([{ "op": "duplicate", "translate": [1, 0, 0], "count": 1_000_000_000u64 }]),
            "/ops/0/count",
        ),
    ] {
        put_plan(&toy, "plan.json", &ops);
        let line = [&SCENE[..], &["--plan", "plan.json", "-o", "out", "-w"]].concat();
        let done = edit(&toy, &line);
        assert_code(&done, 3);
        assert!(text(&done).contains(place), "{ops}: {}", text(&done));
    }
    let plan = r#"{"format": "motes/edit-plan", "version": "1.0", "ops": [{"op": "transform", "translate": [0, NaN, 0]}]}"#;
    std::fs::write(toy.path("plan.json"), plan).unwrap();
    let done = edit(&toy, &[&SCENE[..], &["--plan", "plan.json", "-o", "new"]].concat());
    assert_code(&done, 3);
    assert!(text(&done).contains("/ops/0/translate/1"), "{}", text(&done));
    std::fs::remove_file(toy.path("plan.json")).unwrap();
    assert!(files(toy.folder.path()) == before, "files changed");
}

#[test]
fn the_schema_is_printed() {
    let toy = toy_scene();
    let done = edit(&toy, &["--print-schema"]);
    let schema = answer(&done);
    let committed = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../docs/formats/schema/edit-plan-v1.schema.json");
    let committed: Value = serde_json::from_slice(&std::fs::read(committed).unwrap()).unwrap();
    assert_eq!(schema, committed);
}

/// A plan is a document of anybody: it starts a program only when the user named the same one.
#[cfg(unix)]
#[test]
fn a_plan_starts_no_program_that_the_user_did_not_name() {
    let toy = toy_scene();
    let editor = "sh -c 'touch started; cp \"$0\" \"$1\"' {input} {output}";
    let op = json!({ "op": "stylize", "editor": editor, "views": 1, "rounds": 1, "steps": 1 });
    let select = json!({ "op": "select", "steps": [{ "by": "all" }] });
    put_plan(&toy, "plan.json", &json!([select, op]));
    std::fs::write(toy.path("config.json"), json!({ "op": [op.to_string()] }).to_string()).unwrap();
    let started = toy.path("started");
    let line = ["--gaussians", "scene/gaussians.ply", "--capture", "capture.json", "-q", "-o"];
    for more in [
        &["a.ply", "--plan", "plan.json"][..],
        &["a.ply", "--plan", "plan.json", "--dry-run"],
        &["a.ply", "--plan", "plan.json", "--editor", "another {input} {output}"],
        &["a.ply", "--config", "config.json"],
    ] {
        let done = edit(&toy, &[&line[..], more].concat());
        assert_code(&done, 3);
        assert!(text(&done).contains("not started") && text(&done).contains("/editor"), "{more:?}");
        assert!(!started.exists() && !toy.path("a.ply").exists(), "{more:?}");
    }
    let named = ["a.ply", "--plan", "plan.json", "--editor", editor];
    let dry = [&line[..], &named, &["--dry-run", "--json"]].concat();
    let said = answer(&edit(&toy, &dry));
    assert!(!started.exists(), "a dry run starts a program");
    assert_eq!(said["report"]["skipped"][0]["op"], "stylize", "{said}");
    assert_code(&edit(&toy, &[&line[..], &named].concat()), 0);
    assert!(started.exists());
    std::fs::remove_file(&started).unwrap();
    let replay = [&line[..], &["b.ply", "--plan", "a.ply.edit-log.json"]].concat();
    assert_code(&edit(&toy, &replay), 3);
    assert!(!started.exists(), "a replayed log starts a program");
}

/// A plan is a document of anybody: it reads below its own folder, that of the scene and those that the user named.
#[test]
fn a_plan_reads_nothing_outside_of_the_folders_that_the_user_named() {
    let toy = toy_scene();
    std::fs::create_dir_all(toy.path("from-the-web")).unwrap();
    std::fs::create_dir_all(toy.path("private")).unwrap();
    let cone = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/meshes/cone.ply");
    std::fs::copy(cone, toy.path("private/cone.ply")).unwrap();
    let absolute = toy.path("private/cone.ply").to_string_lossy().into_owned();
    let mut names = vec!["../private/cone.ply".to_owned(), absolute];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(toy.path("private"), toy.path("from-the-web/link")).unwrap();
        names.push("link/cone.ply".into());
    }
    let line = [&SCENE[..], &QUICK, &["--plan", "from-the-web/plan.json", "-q", "-o"]].concat();
    for name in &names {
        put_plan(&toy, "from-the-web/plan.json", &json!([{ "op": "insert", "file": name }]));
        let refused = edit(&toy, &[&line[..], &["refused"]].concat());
        assert_code(&refused, 3);
        assert!(text(&refused).contains("/ops/0/file") && text(&refused).contains("--assets"));
        assert!(!toy.path("refused").exists());
        let allowed = ["allowed", "-w", "--assets", "private"];
        assert_code(&edit(&toy, &[&line[..], &allowed].concat()), 0);
    }
    // What the user types needs no leave.
    let typed = [&SCENE[..], &QUICK, &["--insert", "private/cone.ply", "-q", "-o", "typed"]];
    assert_code(&edit(&toy, &typed.concat()), 0);
}

/// Ends an edit while its editor works: the editor ends too, and the exit code says why.
#[cfg(unix)]
#[test]
fn an_interrupted_edit_ends_its_editor() {
    let toy = toy_scene();
    let editor = "sh -c 'touch started; sleep 30' {input} {output}";
    let mut child = Command::new(env!("CARGO_BIN_EXE_edit"))
        .args(["--gaussians", "scene/gaussians.ply", "--capture", "capture.json", "-o", "a.ply"])
        .args(["--select", BOX_STEP, "--stylize", "autumn", "--editor", editor])
        .current_dir(toy.folder.path())
        .spawn()
        .unwrap();
    let begun = std::time::Instant::now();
    while !toy.path("started").exists() {
        assert_eq!(child.try_wait().unwrap(), None, "the editor is not started");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let kill = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(130));
    assert!(begun.elapsed().as_secs() < 25, "it waits for the editor");
    assert!(!toy.path("a.ply").exists());
}

#[test]
fn the_schema_in_the_documentation_is_the_one_that_is_printed() {
    let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../docs/formats/schema/edit-plan-v1.schema.json");
    let found = std::fs::read_to_string(page).unwrap();
    assert_eq!(found, edit::files::plan_schema(), "run `cargo xtask schemas`");
}
