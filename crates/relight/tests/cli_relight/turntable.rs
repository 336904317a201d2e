//! Pictures over which the light turns, and videos of them.

use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use motes_formats::images::read_image;
use motes_testkit::toy_scene::{ToyScene, toy_scene};

use crate::{VIEW, assert_code, picture, relight, text};

#[test]
fn a_turntable_numbers_its_frames_and_begins_unturned() {
    let toy = toy_scene();
    let light = ["--sun", "azimuth=60,elevation=35", "--env-exposure", "ground"];
    let done = relight(&toy, &[&VIEW[..], &light, &["--turntable", "4", "-o", "turn"]].concat());
    assert_code(&done, 0);
    assert!(text(&done).contains("ffmpeg"), "{}", text(&done));
    let frame = |i: usize| read_image(&toy.path(&format!("turn/frame_000{i}.png"))).unwrap();
    assert_eq!(frame(0), picture(&toy, "first", &light));
    let opposite = ["--sun", "azimuth=240,elevation=35", "--env-exposure", "ground"];
    let opposite = picture(&toy, "opposite", &opposite);
    let far =
        frame(2).data.iter().zip(&opposite.data).filter(|(a, b)| a.abs_diff(**b) > 12).count();
    assert!(far < opposite.data.len() / 100, "{far}");
    assert!(!toy.path("turn/frame_0004.png").exists());
}

/// A program called `ffmpeg` that notes what it was asked for and writes the last word of it.
fn put_ffmpeg(toy: &ToyScene, code: i32) -> PathBuf {
    let folder = toy.path(&format!("bin-{code}"));
    std::fs::create_dir_all(&folder).unwrap();
    let program = folder.join("ffmpeg");
    let text = format!(
        "#!/bin/sh\n[ \"$1\" = -version ] && exit {code}\nfor last; do :; done\necho \"$@\" > \"$last\"\n"
    );
    std::fs::write(&program, text).unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    folder
}

#[test]
fn a_video_is_made_of_numbered_pictures() {
    let toy = toy_scene();
    let run = |folder: &Path, line: &[&str]| {
        let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap());
        Command::new(env!("CARGO_BIN_EXE_relight"))
            .args(["--scene", "scene", "--no-provenance", "--quality", "preview"])
            .args(VIEW)
            .args(line)
            .env("PATH", path)
            .current_dir(toy.folder.path())
            .output()
            .unwrap()
    };
    let works = put_ffmpeg(&toy, 0);
    let done = run(&works, &["--turntable", "2", "--video", "turn.mp4", "--fps", "12", "-o", "a"]);
    assert_code(&done, 0);
    let words = std::fs::read_to_string(toy.path("turn.mp4")).unwrap();
    assert!(words.contains("-framerate 12 -i a/frame_%04d.png"), "{words}");
    assert!(toy.path("a/frame_0001.png").exists());
    // Views of their own names are numbered for it.
    assert_code(&run(&works, &["--video", "view.mp4", "-o", "b"]), 0);
    assert!(toy.path("view.mp4").exists() && toy.path("b/frame_0000.png").exists());
    // Without the program the pictures are there, and the command that makes it.
    let done = run(&put_ffmpeg(&toy, 1), &["--video", "none.mp4", "-o", "c"]);
    assert_code(&done, 0);
    assert!(
        text(&done).contains("ffmpeg cannot be run") && text(&done).contains("c/frame_%04d.png")
    );
    assert!(toy.path("c/frame_0000.png").exists() && !toy.path("none.mp4").exists());
    // What is no picture has no video, and one that is there stays.
    assert_code(&run(&works, &["--video", "x.mp4", "--format", "exr", "-o", "d"]), 2);
    assert_code(&run(&works, &["--video", "turn.mp4", "-o", "e"]), 2);
    assert!(!toy.path("d").exists() && !toy.path("e").exists());
}
