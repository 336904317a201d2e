//! A COLMAP model of views whose keypoints are not known.

use std::fmt::Write as _;
use std::path::Path;

use super::{PosedView, PosedViews};
use crate::atomic::write_atomic;
use crate::colmap::Layout;
use crate::error::Result;

/// Number that stands for an error that is not known.
const NO_ERROR: f64 = -1.0;

/// Writes `cameras`, `images` and `points3D` into `folder`. Images have no keypoints and points no tracks, because a
/// capture keeps neither.
///
/// # Errors
/// Writing fails.
pub fn write_colmap_model(folder: &Path, views: &PosedViews, layout: Layout) -> Result<()> {
    let files = match layout {
        Layout::Binary => [cameras_bin(views), images_bin(views), points_bin(views)],
        Layout::Text => [cameras_txt(views), images_txt(views), points_txt(views)],
    };
    for (stem, bytes) in ["cameras", "images", "points3D"].into_iter().zip(files) {
        let path = folder.join(format!("{stem}.{}", layout.suffix()));
        write_atomic(&path, |writer| writer.write_all(&bytes))?;
    }
    Ok(())
}

/// `qw qx qy qz tx ty tz`.
fn pose(view: &PosedView) -> [f64; 7] {
    let (q, t) = (view.camera_from_world.rotation, view.camera_from_world.translation);
    [q.w, q.x, q.y, q.z, t.x, t.y, t.z]
}

fn cameras_bin(views: &PosedViews) -> Vec<u8> {
    let mut bytes = (views.cameras.len() as u64).to_le_bytes().to_vec();
    for (i, camera) in views.cameras.iter().enumerate() {
        bytes.extend((i as u32 + 1).to_le_bytes());
        bytes.extend(camera.model.id().to_le_bytes());
        bytes.extend((camera.width as u64).to_le_bytes());
        bytes.extend((camera.height as u64).to_le_bytes());
        camera.params.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    }
    bytes
}

fn images_bin(views: &PosedViews) -> Vec<u8> {
    let mut bytes = (views.views.len() as u64).to_le_bytes().to_vec();
    for (i, view) in views.views.iter().enumerate() {
        bytes.extend((i as u32 + 1).to_le_bytes());
        pose(view).iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        bytes.extend((view.camera as u32 + 1).to_le_bytes());
        bytes.extend(view.name.bytes());
        bytes.push(0);
        bytes.extend(0u64.to_le_bytes());
    }
    bytes
}

fn points_bin(views: &PosedViews) -> Vec<u8> {
    let points = &views.points;
    let mut bytes = (points.len() as u64).to_le_bytes().to_vec();
    for (i, (position, color)) in points.positions.iter().zip(&points.colors).enumerate() {
        bytes.extend((i as u64 + 1).to_le_bytes());
        position.iter().for_each(|value| bytes.extend(f64::from(*value).to_le_bytes()));
        bytes.extend(color);
        bytes.extend(NO_ERROR.to_le_bytes());
        bytes.extend(0u64.to_le_bytes());
    }
    bytes
}

fn words(values: &[f64]) -> String {
    values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

fn cameras_txt(views: &PosedViews) -> Vec<u8> {
    let mut text = String::from("# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n");
    for (i, camera) in views.cameras.iter().enumerate() {
        let (name, params) = (camera.model.name(), words(&camera.params));
        let _ = writeln!(text, "{} {name} {} {} {params}", i + 1, camera.width, camera.height);
    }
    text.into_bytes()
}

fn images_txt(views: &PosedViews) -> Vec<u8> {
    let mut text = String::from(
        "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)\n",
    );
    for (i, view) in views.views.iter().enumerate() {
        // The second line of an image is its keypoints: none.
        let _ =
            writeln!(text, "{} {} {} {}\n", i + 1, words(&pose(view)), view.camera + 1, view.name);
    }
    text.into_bytes()
}

fn points_txt(views: &PosedViews) -> Vec<u8> {
    let mut text = String::from("# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]\n");
    let points = &views.points;
    for (i, ([x, y, z], [r, g, b])) in points.positions.iter().zip(&points.colors).enumerate() {
        let _ = writeln!(text, "{} {x} {y} {z} {r} {g} {b} {NO_ERROR}", i + 1);
    }
    text.into_bytes()
}
