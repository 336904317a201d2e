//! Instructions and files that are refused: one clear error each, with help.

use serde_json::json;

use super::{SCENE, instruct, labeled, put_labels, said};

#[test]
fn what_is_not_understood_ends_with_code_3_a_sentence_and_help() {
    let toy = labeled();
    let long = "move the box to the left and ".repeat(400);
    let cases = [
        ("", "empty"),
        ("   ", "empty"),
        ("...", "empty"),
        (long.as_str(), "2000 letters"),
        ("déplace la boîte", "no command"),
        ("移动球", "no command"),
        ("make the box 🟥", "means nothing"),
        ("make the box red\u{202e}", "means nothing"),
        ("remove the spoon", "nothing called"),
        ("move the box left and right", "cannot be both"),
        ("move the box -20 cm to the left", "no amount"),
        ("move the box 20 cm to the left", "cannot be measured"),
        ("move the box 1e400 units left", "no unit"),
        ("rotate the box by nan degrees", "how far"),
        ("insert vase.glb", "no asset"),
        ("insert /etc/passwd", "outside"),
        ("make the box red and then frobnicate it", "no command"),
        ("scale the box by 0", "no amount"),
        ("scale the box by 100000", "out of reason"),
        ("make 1000 copies of the box", "cannot be made"),
    ];
    for (instruction, why) in cases {
        let line = [&[instruction], &SCENE[..], &["-o", "plan.json"]].concat();
        let done = instruct(&toy, &line);
        let text = said(&done);
        assert_eq!(done.status.code(), Some(3), "{instruction}: {text}");
        assert!(text.contains(why), "{instruction}: {text}");
        assert!(text.contains("\nhelp: ") && !text.contains("panicked"), "{instruction}: {text}");
        assert!(!toy.path("plan.json").exists());
    }
}

#[test]
fn without_labels_only_the_whole_scene_can_be_spoken_of() {
    let toy = labeled();
    let line = ["remove the box", "--scene", "scene", "-o", "plan.json"];
    let done = instruct(&toy, &line);
    assert_eq!(done.status.code(), Some(3));
    assert!(said(&done).contains("--labels"), "{}", said(&done));
    let done = instruct(&toy, &["make it noon", "--scene", "scene", "-o", "plan.json"]);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
}

#[test]
fn labels_and_assets_do_not_lead_out_of_their_folders() {
    let toy = labeled();
    let line = [&["make it noon"], &SCENE[..], &["-o", "plan.json"]].concat();
    put_labels(&toy, &json!([{ "name": "box", "selection": "../scene/gaussians.ply" }]));
    let done = instruct(&toy, &line);
    assert_eq!(done.status.code(), Some(3));
    assert!(said(&done).contains("/objects/0/selection"), "{}", said(&done));
    std::fs::write(toy.path("outside.json"), "{}").unwrap();
    std::os::unix::fs::symlink(toy.path("outside.json"), toy.path("labels/link.json")).unwrap();
    put_labels(&toy, &json!([{ "name": "box", "selection": "link.json" }]));
    let done = instruct(&toy, &line);
    assert_eq!(done.status.code(), Some(3));
    assert!(said(&done).contains("leads out"), "{}", said(&done));

    let toy = labeled();
    std::fs::create_dir(toy.path("assets")).unwrap();
    std::fs::write(toy.path("secret.glb"), "glTF").unwrap();
    std::os::unix::fs::symlink(toy.path("secret.glb"), toy.path("assets/link.glb")).unwrap();
    std::fs::write(toy.path("assets/crate.glb"), "glTF").unwrap();
    for (instruction, code) in [
        ("swap the box for crate.glb", 0),
        ("swap the box for link.glb", 3),
        ("swap the box for ../secret.glb", 3),
        ("swap the box for secret.glb", 3),
    ] {
        let more = ["--assets", "assets", "-o", "plan.json", "-w"];
        let done = instruct(&toy, &[&[instruction], &SCENE[..], &more].concat());
        assert_eq!(done.status.code(), Some(code), "{instruction}: {}", said(&done));
    }
    let plan = std::fs::read_to_string(toy.path("plan.json")).unwrap();
    assert!(plan.contains("\"assets/crate.glb\""), "{plan}");
}
