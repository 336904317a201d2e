//! What a lens takes from the corners comes back, where the points tell it.

use std::f64::consts::TAU;

use crate::common::{NAMES, Project, capture_of, pinhole};
use glam::{DVec2, DVec3};
use import_colmap::ImportOptions;
use motes_formats::images::{read_image, write_png};
use motes_math::srgb;
use motes_scene::{ImageU8, Split, Switch};

/// A gray place, photographed by a thin lens without a filter (`exponent` 4), each photo at an exposure of its own.
fn gray_place(exponent: f64) -> Project {
    let mut project = Project::new(pinhole(), &NAMES);
    let spiral = |k: usize| {
        let (turn, radius) = (0.618 * TAU * k as f64, 0.9 * (k as f64 / 120.0).sqrt());
        DVec3::new(radius * turn.cos(), radius * turn.sin(), 0.3 * (0.7 * k as f64).sin())
    };
    project.points = (0..120).map(spiral).collect();
    project.write_photos();
    for (i, (name, camera, _)) in project.images.iter().enumerate() {
        let camera = &project.cameras[*camera];
        let exposure = 0.3 * (1.0 + 0.2 * (2.0 * i as f64).sin());
        let value = |k: usize| {
            let at = DVec2::new((k % camera.width) as f64 + 0.5, (k / camera.width) as f64 + 0.5);
            let cosine = camera.direction_from_pixel(at).unwrap().normalize().z;
            [(255.0 * srgb::encode_f64(exposure * cosine.powf(exponent))).round() as u8; 3]
        };
        let data = (0..camera.width * camera.height).flat_map(value).collect();
        let photo = ImageU8::from_data(camera.width, camera.height, 3, data);
        write_png(&project.path().join("images").join(name), &photo).unwrap();
    }
    project
}

/// Largest difference of values inside a photo of the capture, over training and over held-out photos.
fn unevenness(project: &Project) -> [u8; 2] {
    let mut worst = [0; 2];
    for view in &capture_of(project).views {
        let image = read_image(&project.output().join(&view.image)).unwrap();
        let (low, high) = image.data.iter().fold((255, 0), |(l, h), v| (l.min(*v), h.max(*v)));
        let of = &mut worst[usize::from(view.split == Split::Test)];
        *of = high.saturating_sub(low).max(*of);
    }
    worst
}

fn notes(project: &Project, vignetting: Switch) -> String {
    let _ = std::fs::remove_dir_all(project.output());
    let options = ImportOptions { vignetting, test_every: Some(5), ..Default::default() };
    project.write_model();
    project.import_written(&options).unwrap().notes.join("\n")
}

#[test]
fn gray_photos_are_gray_up_to_their_corners_again() {
    let project = gray_place(4.0);
    let before = {
        let notes = notes(&project, Switch::Off);
        assert!(!notes.contains("vignetting"), "{notes}");
        unevenness(&project)
    };
    assert!(before.iter().all(|v| *v > 30), "{before:?}");
    let notes = notes(&project, Switch::Auto);
    assert!(notes.contains("vignetting kept") && notes.contains("power 4.0"), "{notes}");
    let after = unevenness(&project);
    assert!(after.iter().all(|v| *v <= 2), "{after:?}");
}

#[test]
fn photos_of_a_corrected_lens_keep_their_bytes() {
    let project = gray_place(0.0);
    let said = notes(&project, Switch::Auto);
    assert!(!said.contains("vignetting kept"), "{said}");
    for (name, ..) in &project.images {
        let [before, after] = [project.path(), &project.output()]
            .map(|folder| read_image(&folder.join("images").join(name)).unwrap());
        assert!(before == after, "{name}");
    }
}
