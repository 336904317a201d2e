//! A capture whose photos are renders of known Gaussians, in a folder of its own.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use glam::DVec3;
use motes_formats::capture::write_capture;
use motes_formats::images::write_png;
use motes_formats::ply::{PlyWriteOptions, write_gaussians};
use motes_raster::{RenderOptions, render};
use motes_scene::{Camera, Capture, Gaussians, Pinhole, Pose, SparsePoints, Split, View};
use tempfile::TempDir;

/// A capture in a folder of its own.
pub struct ToyCapture {
    /// Holds `capture.json`, the photos and `g.ply`; gone when dropped.
    pub folder: TempDir,
    /// Cameras, views and splits.
    pub capture: Capture,
    /// What the photos show.
    pub gaussians: Gaussians,
}

/// Eight cameras on half a circle around 40 Gaussians; views 2 and 5 are held out.
pub fn toy_capture() -> ToyCapture {
    let folder = tempfile::tempdir().unwrap();
    let camera = Pinhole { fx: 70.0, fy: 70.0, cx: 32.0, cy: 24.0, width: 64, height: 48 };
    let view = |i: usize| {
        let angle = i as f64 * 0.4;
        let eye = DVec3::new(4.0 * angle.cos(), 4.0 * angle.sin(), 1.5);
        View {
            name: format!("view_{i}.png"),
            camera: 0,
            camera_from_world: Pose::look_at(eye, DVec3::ZERO, DVec3::Z).unwrap(),
            image: format!("images/view_{i}.png").into(),
            mask: None,
            split: if i % 3 == 2 { Split::Test } else { Split::Train },
            exposure_stops: None,
        }
    };
    let capture = Capture {
        cameras: vec![Camera::from_pinhole(camera)],
        views: (0..8).map(view).collect(),
        points: SparsePoints::default(),
        world_origin: DVec3::ZERO,
        exposure_response: None,
    };
    let gaussians = gaussians();
    std::fs::create_dir(folder.path().join("images")).unwrap();
    for view in &capture.views {
        let photo = render(&gaussians, &camera, &view.camera_from_world, &RenderOptions::default());
        write_png(&folder.path().join(&view.image), &photo.color.to_u8()).unwrap();
    }
    write_capture(&folder.path().join("capture.json"), &capture).unwrap();
    write_gaussians(&folder.path().join("true.ply"), &gaussians, &PlyWriteOptions::default())
        .unwrap();
    ToyCapture { folder, capture, gaussians }
}

fn gaussians() -> Gaussians {
    let n = 40;
    let spread = |i: usize, step: f32| ((i as f32 * step).fract() - 0.5) * 2.0;
    Gaussians {
        means: (0..n)
            .map(|i| [spread(i, 0.618), spread(i, 0.414), 0.6 * spread(i, 0.732)])
            .collect(),
        rotations: (0..n).map(|i| [1.0, spread(i, 0.3), spread(i, 0.7), 0.2]).collect(),
        log_scales: vec![[-1.6, -2.0, -2.4]; n],
        opacity_logits: vec![2.0; n],
        sh_degree: 0,
        sh: (0..3 * n).map(|i| 1.5 * spread(i, 0.37)).collect(),
        extra: Vec::new(),
    }
}

impl ToyCapture {
    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

/// Runs a stage in `folder`.
pub fn run(program: &str, folder: &Path, arguments: &[&str]) -> Output {
    Command::new(program).args(arguments).current_dir(folder).output().unwrap()
}

/// What a program said on stderr.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The run ended with this exit code; on failure its messages are shown.
#[track_caller]
pub fn assert_code(output: &Output, code: i32) {
    assert_eq!(output.status.code(), Some(code), "{}", stderr(output));
}
