//! `--stylize` with a provider: who may start one, what it changes, what is kept.

use super::*;

/// The provider of tests: linear gains that the prompt says, and another exposure for each picture.
const PROVIDER: &str =
    concat!("python3 ", env!("CARGO_MANIFEST_DIR"), "/../../testdata/providers/warm_light.py");
const LINE: [&str; 8] = [
    "--gaussians",
    "scene/gaussians.ply",
    "--capture",
    "capture.json",
    "--provider-cache",
    "answers",
    "--json",
    "-o",
];

/// Mean of the colors of degree 0, per channel, of rows that `chosen` says.
fn mean(toy: &ToyScene, name: &str, chosen: impl Fn([f32; 3]) -> bool) -> [f32; 3] {
    let gaussians = read_gaussians(&toy.path(name)).unwrap();
    let rows: Vec<usize> = (0..gaussians.len()).filter(|&i| chosen(gaussians.means[i])).collect();
    [0, 1, 2].map(|c| rows.iter().map(|&i| gaussians.sh_of(i)[c]).sum::<f32>() / rows.len() as f32)
}

#[test]
fn a_provider_edits_views_and_only_the_selection_changes() {
    let toy = toy_scene();
    let style = ["a.ply", "--select", BOX_STEP, "--stylize", "red 1.6 blue 0.4"];
    let line = [&LINE[..], &style, &["--provider", PROVIDER]].concat();
    let said = answer(&edit(&toy, &line));
    assert_eq!(said["provider"]["name"], "warm-light");
    assert!(said["provider"]["answered"].as_u64() > Some(0), "{said}");
    let inside = |[x, y, z]: [f32; 3]| x.abs() < 0.3 && y.abs() < 0.3 && z > 0.05;
    let (before, after) = (mean(&toy, "scene/gaussians.ply", inside), mean(&toy, "a.ply", inside));
    assert!(after[0] - before[0] > after[2] - before[2] + 0.2, "{before:?} {after:?}");
    let floor = |[_, _, z]: [f32; 3]| z < 0.005;
    assert_eq!(mean(&toy, "scene/gaussians.ply", floor), mean(&toy, "a.ply", floor));
    // The log names no program: a replay needs the user's word, and then gives the same.
    let log = std::fs::read_to_string(toy.path("a.ply.edit-log.json")).unwrap();
    assert!(!log.contains("warm_light.py"), "{log}");
    let replay = [&LINE[..], &["b.ply", "--plan", "a.ply.edit-log.json"]].concat();
    let refused = edit(&toy, &replay);
    assert_code(&refused, 3);
    assert!(text(&refused).contains("/ops/1") && text(&refused).contains("give --provider"));
    let again = answer(&edit(&toy, &[&replay[..], &["--provider", PROVIDER]].concat()));
    assert_eq!(again["provider"]["answered"], 0, "answers are kept: {again}");
    assert_eq!(
        std::fs::read(toy.path("a.ply")).unwrap(),
        std::fs::read(toy.path("b.ply")).unwrap()
    );
}

#[test]
fn a_file_names_no_provider_and_a_broken_one_is_told() {
    let toy = toy_scene();
    let style = ["a.ply", "--select", BOX_STEP, "--stylize", "snow"];
    let config = json!({ "provider": PROVIDER }).to_string();
    std::fs::write(toy.path("config.json"), config).unwrap();
    let named = edit(&toy, &[&LINE[..], &style, &["--config", "config.json"]].concat());
    assert_code(&named, 2);
    for (provider, code, said) in [
        ("no-such-provider-here", 3, "there is no provider no-such-provider-here"),
        ("false", 3, "the provider false failed"),
        ("sh -c 'echo hello'", 3, "does not keep the protocol"),
    ] {
        let done = edit(&toy, &[&LINE[..], &style, &["--provider", provider]].concat());
        assert_code(&done, code);
        assert!(text(&done).contains(said) && !text(&done).contains("panicked"), "{}", text(&done));
    }
    let dry = [&LINE[..], &style, &["--provider", "false", "--dry-run"]].concat();
    assert_eq!(answer(&edit(&toy, &dry))["report"]["skipped"][0]["op"], "stylize");
    assert!(!toy.path("a.ply").exists());
}
