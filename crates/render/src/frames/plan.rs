//! Which pictures to render: names, cameras and poses.

use std::collections::HashMap;

use glam::DVec3;
use motes_formats::camera_path::CameraPath;
use motes_scene::camera_path::{self, CameraPathError};
use motes_scene::{Capture, Pinhole, Pose, Split, told_apart};
use thiserror::Error;

/// One picture to render.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// File name without suffix; unique within a plan.
    pub name: String,
    /// Intrinsics. A panorama takes its size from here.
    pub camera: Pinhole,
    /// Pose.
    pub camera_from_world: Pose,
    /// Exposure of the photo that was taken here, stops.
    pub exposure_stops: Option<f64>,
}

/// Where the cameras of a plan come from.
#[derive(Clone, Debug, PartialEq)]
pub enum FrameSource {
    /// The views of one split, or all.
    Split(Option<Split>),
    /// Views by name.
    Views(Vec<String>),
    /// Poses between two named views at fractions from 0 (first) to 1 (second).
    Between(String, String, Vec<f64>),
    /// A circle around what the training cameras look at.
    Orbit(usize),
    /// A spiral in front of what the training cameras look at.
    Spiral(usize),
}

/// Why a plan cannot be made.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PlanError {
    /// No view has this name.
    #[error("the capture has no view named \"{name}\"{nearest}")]
    NoSuchView {
        /// What was asked for.
        name: String,
        /// A hint with names that exist.
        nearest: String,
    },
    /// The split is empty.
    #[error(
        "the capture has no {0} views\nhelp: import it with --test-every or --test-list, or take --split all"
    )]
    EmptySplit(&'static str),
    /// A view's camera has distortion, which a rasterizer cannot draw.
    #[error(
        "the camera of view \"{0}\" is not a pinhole\nhelp: import the photos with import-colmap, which undistorts them"
    )]
    NotPinhole(String),
    /// The cameras allow no such path.
    #[error("{0}\nhelp: give --path with a camera path file, or --between two views")]
    NoPath(#[from] CameraPathError),
}

/// The frames of `source`, in order; files are named after views, paths are numbered.
///
/// # Errors
/// When a view does not exist or the cameras allow no such path.
pub fn plan_frames(capture: &Capture, source: &FrameSource) -> Result<Vec<Frame>, PlanError> {
    match source {
        FrameSource::Split(split) => {
            let views = views_of(capture, *split)?;
            view_frames(capture, &views)
        }
        FrameSource::Views(names) => {
            let views: Result<Vec<usize>, _> = names.iter().map(|n| find(capture, n)).collect();
            view_frames(capture, &views?)
        }
        FrameSource::Between(a, b, times) => {
            let (a, b) = (find(capture, a)?, find(capture, b)?);
            let camera = pinhole_of(capture, a)?;
            let pose = |i: usize| capture.views[i].camera_from_world;
            let frame = |(i, &t): (usize, &f64)| Frame {
                name: if times.len() == 1 { format!("between_{t:.3}") } else { numbered(i) },
                camera,
                camera_from_world: Pose::between(&pose(a), &pose(b), t),
                exposure_stops: None,
            };
            Ok(times.iter().enumerate().map(frame).collect())
        }
        FrameSource::Orbit(frames) => {
            frames_along(capture, |cameras, _| camera_path::orbit(cameras, *frames))
        }
        FrameSource::Spiral(frames) => {
            frames_along(capture, |cameras, depth| camera_path::spiral(cameras, depth, *frames))
        }
    }
}

/// Views of a split, or of both.
///
/// # Errors
/// When there is none.
pub fn views_of(capture: &Capture, split: Option<Split>) -> Result<Vec<usize>, PlanError> {
    let (views, name) = match split {
        None => ((0..capture.views.len()).collect(), ""),
        Some(Split::Train) => (capture.views_of(Split::Train), "training"),
        Some(Split::Test) => (capture.views_of(Split::Test), "test"),
    };
    if views.is_empty() { Err(PlanError::EmptySplit(name)) } else { Ok(views) }
}

/// The intrinsics of a view.
///
/// # Errors
/// When its camera has distortion.
pub fn pinhole_of(capture: &Capture, view: usize) -> Result<Pinhole, PlanError> {
    let view = &capture.views[view];
    capture.cameras[view.camera]
        .as_pinhole()
        .ok_or_else(|| PlanError::NotPinhole(view.name.clone()))
}

/// Name of frame `i` of a path.
pub fn numbered(i: usize) -> String {
    format!("frame_{i:04}")
}

/// File stem per view: the view's name without its suffix and with folders flattened, or the
/// whole name where two views would share a file; a number behind it where they still would.
pub fn view_stems(capture: &Capture) -> Vec<String> {
    let flat = |name: &str| name.replace(['/', '\\'], "__");
    let stem = |name: &str| match name.rsplit_once('.') {
        Some((stem, suffix)) if !stem.is_empty() && !suffix.contains(['/', '\\']) => flat(stem),
        _ => flat(name),
    };
    let mut uses: HashMap<String, usize> = HashMap::new();
    for view in &capture.views {
        *uses.entry(stem(&view.name)).or_default() += 1;
    }
    let names = capture.views.iter().map(|view| &view.name);
    told_apart(
        names.map(|name| if uses[&stem(name)] == 1 { stem(name) } else { flat(name) }).collect(),
    )
}

fn find(capture: &Capture, name: &str) -> Result<usize, PlanError> {
    capture.view_named(name).ok_or_else(|| {
        let names: Vec<&str> = capture.views.iter().map(|view| view.name.as_str()).collect();
        let mut shown = names.iter().take(4).map(|n| format!("\"{n}\"")).collect::<Vec<_>>();
        if names.len() > shown.len() {
            shown.push("...".into());
        }
        let nearest = format!("\nhelp: its {} views are {}", names.len(), shown.join(", "));
        PlanError::NoSuchView { name: name.to_owned(), nearest }
    })
}

fn view_frames(capture: &Capture, views: &[usize]) -> Result<Vec<Frame>, PlanError> {
    let stems = view_stems(capture);
    let frame = |&view: &usize| {
        Ok(Frame {
            name: stems[view].clone(),
            camera: pinhole_of(capture, view)?,
            camera_from_world: capture.views[view].camera_from_world,
            exposure_stops: capture.views[view].exposure_stops,
        })
    };
    views.iter().map(frame).collect()
}

/// The frames of a camera path document, numbered.
pub fn path_frames(path: &CameraPath) -> Vec<Frame> {
    let frame = |(i, &(camera, camera_from_world))| {
        let name = numbered(i);
        Frame { name, camera, camera_from_world, exposure_stops: None }
    };
    path.frames.iter().enumerate().map(frame).collect()
}

fn frames_along(
    capture: &Capture,
    path: impl Fn(&[Pose], Option<f64>) -> Result<Vec<Pose>, CameraPathError>,
) -> Result<Vec<Frame>, PlanError> {
    let views = views_of(capture, Some(Split::Train)).or_else(|_| views_of(capture, None))?;
    let camera = pinhole_of(capture, views[0])?;
    let poses: Vec<Pose> = views.iter().map(|&i| capture.views[i].camera_from_world).collect();
    let poses = path(&poses, median_depth(capture, &poses))?;
    let frame = |(i, camera_from_world)| {
        let name = numbered(i);
        Frame { name, camera, camera_from_world, exposure_stops: None }
    };
    Ok(poses.into_iter().enumerate().map(frame).collect())
}

/// Median depth of the sparse points in front of the first cameras, world units.
fn median_depth(capture: &Capture, poses: &[Pose]) -> Option<f64> {
    let points = capture.points.positions.iter().map(|p| DVec3::from(p.map(f64::from)));
    let mut depths: Vec<f64> = points
        .enumerate()
        .map(|(i, point)| poses[i % poses.len()].transform_point(point).z)
        .filter(|z| *z > 0.0)
        .collect();
    depths.sort_by(f64::total_cmp);
    depths.get(depths.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use motes_scene::{Camera, SparsePoints, View};

    use super::*;

    fn capture(names: &[&str]) -> Capture {
        let camera = Pinhole { fx: 50.0, fy: 50.0, cx: 32.0, cy: 24.0, width: 64, height: 48 };
        let view = |(i, name): (usize, &&str)| {
            let angle = i as f64;
            let eye = DVec3::new(3.0 * angle.cos(), 3.0 * angle.sin(), 1.0);
            View {
                name: (*name).into(),
                camera: 0,
                camera_from_world: Pose::look_at(eye, DVec3::ZERO, DVec3::Z).unwrap(),
                image: (*name).into(),
                mask: None,
                split: if i == 1 { Split::Test } else { Split::Train },
                exposure_stops: None,
            }
        };
        Capture {
            cameras: vec![Camera::from_pinhole(camera)],
            views: names.iter().enumerate().map(view).collect(),
            points: SparsePoints::default(),
            world_origin: DVec3::ZERO,
            exposure_response: None,
        }
    }

    #[test]
    fn files_are_named_after_views_and_never_collide() {
        let capture = capture(&["a.jpg", "a.png", "left/b.jpg", "c", "../d.e.jpg"]);
        let stems = view_stems(&capture);
        assert_eq!(stems, ["a.jpg", "a.png", "left__b", "c", "..__d.e"]);
        assert!(stems.iter().all(|stem| !stem.contains('/')));
    }

    #[test]
    fn splits_views_and_paths_give_frames() {
        let capture = capture(&["a.jpg", "b.jpg", "c.jpg", "d.jpg"]);
        let plan = |source| plan_frames(&capture, &source).unwrap();
        assert_eq!(plan(FrameSource::Split(Some(Split::Test)))[0].name, "b");
        assert_eq!(plan(FrameSource::Split(None)).len(), 4);
        assert_eq!(plan(FrameSource::Views(vec!["d.jpg".into()]))[0].name, "d");
        let half = plan(FrameSource::Between("a.jpg".into(), "c.jpg".into(), vec![0.5]));
        assert_eq!(half[0].name, "between_0.500");
        let orbit = plan(FrameSource::Orbit(6));
        assert_eq!((orbit.len(), orbit[5].name.as_str()), (6, "frame_0005"));
    }

    #[test]
    fn what_does_not_exist_is_named() {
        let mut capture = capture(&["a.jpg", "b.jpg"]);
        let error = plan_frames(&capture, &FrameSource::Views(vec!["x".into()])).unwrap_err();
        assert!(error.to_string().contains("\"x\"") && error.to_string().contains("\"a.jpg\""));
        capture.views[1].split = Split::Train;
        let error = plan_frames(&capture, &FrameSource::Split(Some(Split::Test))).unwrap_err();
        assert!(error.to_string().contains("no test views"), "{error}");
        capture.cameras[0].model = motes_scene::CameraModel::Opencv;
        let error = plan_frames(&capture, &FrameSource::Split(None)).unwrap_err();
        assert_eq!(error, PlanError::NotPinhole("a.jpg".into()));
    }
}
