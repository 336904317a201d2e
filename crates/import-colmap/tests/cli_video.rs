//! Photos out of videos, with programs in place of ffmpeg and ffprobe that do as they would.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

const PROBE: &str = r#"#!/bin/sh
test -n "$BROKEN" && { echo "moov atom not found" >&2; exit 1; }
echo '{"streams": [{"avg_frame_rate": "30/1", "color_transfer": "'$TRANSFER'"}], "format": {"duration": "8.0"}}'
"#;

/// Pictures of a texture that moves by SPEED pixels per frame after the first two seconds; every third frame is sharp.
const FFMPEG: &str = r#"#!/usr/bin/env python3
import math, os, re, sys
arguments = sys.argv[1:]
folder_and_name = arguments[-1]
with open(os.environ["LOG"], "a") as log:
    print(*arguments, sep="\x1f", file=log)
chosen = re.findall(r"eq\(n\\,(\d+)\)", arguments[arguments.index("-vf") + 1])
speed, width, height = float(os.environ["SPEED"]), 96, 64

def gray(x, y, k):
    at = x + speed * max(0, k - 20)
    detail = 25 if k % 3 == 0 else 5
    return int(128 + 40 * math.sin(.21 * at + .13 * y) + 30 * math.sin(.37 * y - .11 * at) + detail * math.sin(1.9 * at + 1.3 * y))

for n, k in enumerate(map(int, chosen) if chosen else range(80), 1):
    pixels = bytes(gray(x, y, k) for y in range(height) for x in range(width))
    with open(folder_and_name % n, "wb") as out:
        out.write(b"P5 %d %d 255\n" % (width, height) + pixels)
    print("frame=%d" % n)
"#;

/// Runs `import-colmap --video walk.mp4` with programs of `folder/bin`.
fn import(folder: &Path, more: &[&str], settings: &[(&str, &str)]) -> Output {
    let bin = folder.join("bin");
    std::fs::create_dir_all(&bin).unwrap();
    for (name, text) in [("ffprobe", PROBE), ("ffmpeg", FFMPEG)] {
        std::fs::write(bin.join(name), text).unwrap();
        std::fs::set_permissions(bin.join(name), PermissionsExt::from_mode(0o755)).unwrap();
    }
    std::fs::write(folder.join("walk.mp4"), b"video").unwrap();
    let path = std::env::join_paths(
        std::iter::once(bin).chain(std::env::split_paths(&std::env::var_os("PATH").unwrap())),
    );
    Command::new(env!("CARGO_BIN_EXE_import-colmap"))
        .args(["--video", "walk.mp4", "-o", "capture", "--sfm-workspace", "work"])
        // No solver: what is tested comes before it.
        .args(["--python", "no-such-python"])
        .args(more)
        .current_dir(folder)
        .env("PATH", path.unwrap())
        .env("LOG", folder.join("log"))
        .env("SPEED", "2.0")
        .env_remove("MOTES_PYTHON")
        .envs(settings.iter().copied())
        .output()
        .unwrap()
}

fn expect(output: &Output, code: i32, said: &[&str]) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    for text in said {
        assert!(stderr.contains(text), "{text}: {stderr}");
    }
}

#[test]
fn the_sharpest_frames_at_equal_steps_of_motion_become_photos() {
    let folder = tempfile::tempdir().unwrap();
    let done = import(folder.path(), &["--frames", "10"], &[]);
    expect(&done, 1, &["no Python with pycolmap"]);
    let mut photos: Vec<String> = std::fs::read_dir(folder.path().join("work/frames"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    photos.sort();
    let expected: Vec<String> = (1..=10).map(|n| format!("frame_{n:04}.png")).collect();
    assert_eq!(photos, expected);
    let log = std::fs::read_to_string(folder.path().join("log")).unwrap();
    let passes: Vec<&str> = log.lines().collect();
    assert_eq!(passes.len(), 2);
    for pass in &passes {
        assert!(pass.contains("file:walk.mp4") && pass.contains("-protocol_whitelist\u{1f}file"));
    }
    let frames: Vec<u32> = passes[1]
        .split("eq(n\\,")
        .skip(1)
        .map(|rest| rest.split(')').next().unwrap().parse().unwrap())
        .collect();
    assert!(frames.iter().all(|k| k % 3 == 0), "sharp ones: {frames:?}");
    assert!(frames.iter().filter(|&&k| k < 20).count() <= 1, "it stands still: {frames:?}");
    assert!(frames.windows(2).skip(1).all(|w| w[1] - w[0] <= 9), "{frames:?}");
    // The frames of somebody are not solved with ours, nor removed.
    expect(&import(folder.path(), &[], &[]), 2, &["holds files already", "help: move it away"]);
    assert_eq!(std::fs::read_dir(folder.path().join("work/frames")).unwrap().count(), 10);
}

#[test]
fn videos_that_give_no_photos_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let still = import(folder.path(), &[], &[("SPEED", "0")]);
    expect(&still, 3, &["the camera hardly moves", "walk around the scene"]);
    let broken = import(folder.path(), &[], &[("BROKEN", "1")]);
    expect(&broken, 3, &["cannot be decoded (moov atom not found): walk.mp4", "H.264"]);
    let missing = import(folder.path(), &[], &[("PATH", "/nowhere")]);
    expect(&missing, 1, &["ffprobe", "help: install ffmpeg"]);
    let both = import(folder.path(), &["--photos", "x"], &[]);
    expect(&both, 2, &["--video"]);
    assert!(!folder.path().join("capture/capture.json").exists());
}
