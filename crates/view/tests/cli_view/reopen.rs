//! A plan that was saved before, and environment maps of folders that the command line names.

use motes_formats::environment::{read_environment, write_environment};
use motes_scene::ImageF32;
use serde_json::json;

use super::acts::{SCENE, edit, on_the_box};
use super::*;

#[test]
fn a_saved_plan_goes_on_and_is_undone_as_if_it_was_made_here() {
    let toy = scene_with_photos();
    let served = Served::start(toy.folder.path(), &[&SCENE[..], &["--seed", "7"]].concat());
    let before = served.get("gaussians").body;
    served.wait("ready", |state| state["views"] == "ready");
    let (view, pixel) = on_the_box(&toy);
    let click = json!({ "kind": "click", "view": view, "pixel": pixel, "positive": true });
    served.act("prompt", &click);
    served.act("keep", &json!({ "name": "box" }));
    served.act("act", &json!({ "op": { "op": "set_material", "name": "brass" } }));
    served.act("light", &json!({ "sun": "noon" }));
    served.settled();
    let (shown, saved) = (served.get("gaussians").body, served.get("plan").body);
    std::fs::write(toy.path("saved.json"), &saved).unwrap();
    served.quit();

    let again = [&SCENE[..], &["--plan", "saved.json", "-o", "further.json"]].concat();
    let served = Served::start(toy.folder.path(), &again);
    let state = served.settled();
    assert_eq!(state["selections"], json!(["box"]));
    assert!(served.get("gaussians").body == shown, "reopened it shows something else");
    assert_eq!(served.get("plan").body, saved, "the seed and the acts are those of the plan");
    // Going on, and back to the start.
    served.act("choose", &json!({ "name": "box" }));
    let delete = json!({ "op": { "op": "delete", "fill": "none" } });
    let state = served.act("act", &delete);
    assert_eq!(state["steps"].as_array().unwrap().len(), 4);
    served.settled();
    edit(&toy, &["--plan", "further.json", "-o", "further"]);
    let written = std::fs::read(toy.path("further/gaussians.ply")).unwrap();
    assert!(served.get("gaussians").body == written);
    for _ in 0..4 {
        served.act("undo", &json!({}));
    }
    served.settled();
    assert!(served.get("gaussians").body == before);
}

#[test]
fn a_plan_that_does_not_fit_or_reaches_out_is_refused() {
    let toy = toy_scene();
    let outside = tempfile::tempdir().unwrap();
    let map = outside.path().join("map.exr");
    write_environment(&map, &ImageF32::filled(16, 8, 3, 1.0), &[]).unwrap();
    let light = json!({ "op": "set_environment", "file": map });
    let stylize =
        json!({ "op": "stylize", "prompt": "x", "editor": "touch started {input} {output}" });
    for (ops, says) in [
        (json!([light]), "outside the folder of the plan"),
        (json!([{ "op": "delete" }]), "select"),
        (
            json!([{ "op": "select", "steps": [{ "by": "sphere", "center": [9, 9, 9], "radius": 0.1 }] }]),
            "empty",
        ),
        (json!([stylize]), "not started"),
    ] {
        let plan = json!({ "format": "motes/edit-plan", "version": "1.0", "ops": ops });
        std::fs::write(toy.path("plan.json"), plan.to_string()).unwrap();
        let done = run(toy.folder.path(), &["--scene", "scene", "--plan", "plan.json"]);
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(3), "{ops}: {said}");
        assert!(said.contains(says), "{ops}: {said}");
    }
    assert!(!toy.path("started").exists());
}

#[test]
fn a_map_of_a_named_folder_is_chosen_and_no_other() {
    let toy = toy_scene();
    std::fs::create_dir(toy.path("maps")).unwrap();
    let mut map = ImageF32::filled(32, 16, 3, 0.2);
    map.pixel_mut(8, 4).copy_from_slice(&[60.0, 40.0, 20.0]);
    for name in ["b.exr", "a.exr"] {
        write_environment(&toy.path("maps").join(name), &map, &[]).unwrap();
        map = map.scaled(2.0);
    }
    std::fs::write(toy.path("maps/broken.hdr"), "no map").unwrap();
    std::fs::write(toy.path("maps/notes.txt"), "").unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(toy.path("scene/environment.exr"), toy.path("maps/link.exr"))
        .unwrap();
    let line = ["--scene", "scene", "--assets", "maps"];
    let served = Served::start(toy.folder.path(), &line);
    let maps = served.get("manifest").json()["session"]["maps"].clone();
    let names: Vec<&str> =
        maps.as_array().unwrap().iter().map(|m| m["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["a.exr", "b.exr", "broken.hdr"]);
    let state = served.act("light", &json!({ "map": 0, "rotate_deg": 40.0 }));
    assert_eq!(state["steps"][0]["file"], maps[0]["file"]);
    served.settled();
    for wrong in [json!({ "map": 2 }), json!({ "map": 3 }), json!({ "map": 0, "sun": "noon" })] {
        assert_eq!(served.post("light", &wrong).code, 422, "{wrong}");
    }
    // The command replays it.
    let words = served.state()["command"].clone();
    let words: Vec<&str> = words.as_array().unwrap().iter().map(|w| w.as_str().unwrap()).collect();
    let at = words.iter().position(|word| *word == "--assets").unwrap();
    assert!(Path::new(words[at + 1]).is_absolute(), "{words:?}");
    std::fs::write(toy.path("edit-plan.json"), served.get("plan").body).unwrap();
    let mut command = Command::new(motes_testkit::program("edit"));
    command.args(&words[2..]).args(["-q", "--no-provenance"]).current_dir(toy.folder.path());
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let written = std::fs::read(toy.path("edited/gaussians.ply")).unwrap();
    assert!(served.get("gaussians").body == written);
    let lit = read_environment(&toy.path("edited/environment.exr")).unwrap();
    assert!(lit.data.iter().any(|v| *v > 10.0));
}
