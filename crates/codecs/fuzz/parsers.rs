//! One function per parser: feed it any bytes. It must return, without a panic and, as the test
//! that shares this file checks, without much memory.
//!
//! Included by the cargo-fuzz targets and by `tests/fuzz_parsers.rs`.

use std::path::Path;

use motes_codecs::{self, SplatFormat, SplatWriteOptions};
use motes_formats::camera_path::CameraPathDocument;
use motes_formats::capture::{CaptureDocument, capture_from_document};
use motes_formats::decomposition::DecompositionDocument;
use motes_formats::documents::parse_document;
use motes_formats::metrics::MetricsDocument;
use motes_formats::ply::{self, PlyWriteOptions};
use motes_formats::run_record::RunRecord;
use motes_formats::{colmap, environment, exr_aov, images, tensors, transforms};

const NAME: &str = "fuzzed";

/// A Gaussian PLY. What is accepted must survive being written and read.
pub(crate) fn gaussians(bytes: &[u8]) {
    let name = Path::new(NAME);
    let Ok(file) = ply::read_gaussians_from(bytes, name) else { return };
    assert!(file.gaussians.is_consistent(), "arrays of different lengths were accepted");
    let options = PlyWriteOptions {
        render_mode: file.render_mode,
        exposure_response: file.exposure_response,
        comments: file.comments,
        ..PlyWriteOptions::default()
    };
    let mut written = Vec::new();
    if ply::write_gaussians_to(&mut written, &file.gaussians, &options, name).is_err() {
        return; // a column name that only a reader must understand
    }
    let again = ply::read_gaussians_from(&written[..], name).expect("what was written is read");
    let mut twice = Vec::new();
    ply::write_gaussians_to(&mut twice, &again.gaussians, &options, name).expect("and written");
    assert!(written == twice, "the second copy differs from the first");
}

/// Gaussians in a format of another program. What is accepted can be written in it.
pub(crate) fn splats(format: SplatFormat, bytes: &[u8]) {
    let name = Path::new(NAME);
    let Ok(file) = motes_codecs::read_gaussians_from(format, bytes, name) else { return };
    assert!(file.gaussians.is_consistent(), "arrays of different lengths were accepted");
    if format.codec().is_writable() && file.gaussians.len() < 1000 {
        let options = SplatWriteOptions::default();
        let mut written = Vec::new();
        let outcome =
            motes_codecs::write_gaussians_to(&mut written, format, &file.gaussians, &options, name);
        if outcome.is_ok() && !file.gaussians.is_empty() && file.gaussians.invalid_rows().is_empty()
        {
            let again = motes_codecs::read_gaussians_from(format, &written, name)
                .expect("what was written");
            assert_eq!(again.gaussians.len(), file.gaussians.len());
        }
    }
}

/// A point PLY.
pub(crate) fn points(bytes: &[u8]) {
    if let Ok(points) = ply::read_points_from(bytes, Path::new(NAME)) {
        assert_eq!(points.positions.len(), points.colors.len());
    }
}

/// A surface. What is accepted must survive being written and read.
pub(crate) fn surface(bytes: &[u8]) {
    let name = Path::new(NAME);
    let Ok(surface) = ply::read_surface_from(bytes, name) else { return };
    assert!(surface.is_consistent(), "a surface that is not consistent was accepted");
    let mut written = Vec::new();
    ply::write_surface_to(&mut written, &surface, name).expect("memory takes all");
    assert_eq!(ply::read_surface_from(&written[..], name).expect("what was written"), surface);
}

/// An environment map.
pub(crate) fn environment(bytes: &[u8]) {
    if let Ok(map) = environment::read_environment_from(bytes, Path::new(NAME)) {
        assert_eq!((map.channels, map.data.len()), (3, map.width * map.height * 3));
    }
}

/// The document of a scene folder.
pub(crate) fn decomposition(bytes: &[u8]) {
    let name = Path::new(NAME);
    let Ok(parsed) = parse_document::<DecompositionDocument>(bytes, name) else { return };
    if let Ok(checked) = parsed.document.check(name) {
        assert!(!checked.surface.is_absolute(), "an absolute path was accepted");
    }
}

/// A capture, without its points.
pub(crate) fn capture(bytes: &[u8]) {
    let name = Path::new(NAME);
    let Ok(parsed) = parse_document::<CaptureDocument>(bytes, name) else { return };
    let Ok(capture) = capture_from_document(&parsed.document, name) else { return };
    for view in &capture.views {
        assert!(view.camera < capture.cameras.len(), "a dangling camera was accepted");
        assert!(!view.image.is_absolute(), "an absolute path was accepted");
        let pose = &view.camera_from_world;
        assert!((pose.rotation.length() - 1.0).abs() < 1e-9 && pose.translation.is_finite());
    }
}

/// A camera path.
pub(crate) fn camera_path(bytes: &[u8]) {
    let name = Path::new(NAME);
    if let Ok(parsed) = parse_document::<CameraPathDocument>(bytes, name) {
        let _ = parsed.document.check(name);
    }
}

/// Metrics and run records.
pub(crate) fn reports(bytes: &[u8]) {
    let _ = parse_document::<MetricsDocument>(bytes, Path::new(NAME));
    let _ = parse_document::<RunRecord>(bytes, Path::new(NAME));
}

/// A photo.
pub(crate) fn image(bytes: &[u8]) {
    if let Ok(image) = images::read_image_from(bytes, Path::new(NAME)) {
        assert_eq!(image.data.len(), image.width * image.height * image.channels);
    }
}

/// An OpenEXR image.
pub(crate) fn exr(bytes: &[u8]) {
    if let Ok(image) = exr_aov::read_exr_from(bytes, Path::new(NAME)) {
        for channel in &image.channels {
            assert_eq!(channel.samples.len(), image.width * image.height, "{}", channel.name);
        }
    }
}

/// A safetensors file.
pub(crate) fn tensor_file(bytes: &[u8]) {
    let _ = tensors::read_tensors_from(bytes, bytes.len() as u64, Path::new(NAME));
}

/// A file of a COLMAP model, in the place of one of its three files, beside valid ones.
///
/// `folder` holds a valid model with files of `suffix` and is used for nothing else.
pub(crate) fn colmap_file(bytes: &[u8], folder: &Path, suffix: &str) {
    // Which file it stands for follows from the input, so that a failure can be repeated.
    let stem = ["cameras", "images", "points3D"][bytes.len() % 3];
    let path = folder.join(format!("{stem}.{suffix}"));
    let Ok(valid) = std::fs::read(&path) else { return };
    if std::fs::write(&path, bytes).is_ok() {
        let _ = colmap::read_model(folder);
    }
    let _ = std::fs::write(&path, valid);
}

/// A `transforms.json`; `scratch` is a file to write it to.
pub(crate) fn transforms_file(bytes: &[u8], scratch: &Path) {
    if std::fs::write(scratch, bytes).is_ok() {
        let _ = transforms::read_transforms(scratch);
    }
}
