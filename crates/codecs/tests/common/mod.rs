//! What the tests of the corpus share: its folders, and one reader per document.

#![allow(dead_code, reason = "each test binary uses a part")]

use std::path::{Path, PathBuf};

use motes_formats::documents::{Document, read_document};
use motes_formats::{
    FormatError, camera_path, capture, decomposition, environment, exr_aov, images, metrics, ply,
    run_record, tensors,
};

/// A folder of the corpus and the reader that it tests.
pub(crate) struct Reader {
    pub(crate) document: &'static str,
    pub(crate) read: fn(&Path) -> Result<(), FormatError>,
}

pub(crate) const READERS: [Reader; 19] = [
    Reader { document: "camera-path", read: |p| camera_path::read_camera_path(p).map(drop) },
    Reader { document: "capture", read: |p| capture::read_capture(p).map(drop) },
    Reader { document: "compressed-ply", read: |p| motes_codecs::read_gaussians(p).map(drop) },
    Reader { document: "decomposition", read: |p| decomposition::read_decomposition(p).map(drop) },
    Reader { document: "environment", read: |p| environment::read_environment(p).map(drop) },
    Reader { document: "exr-aov", read: |p| exr_aov::open_exr(p).map(drop) },
    Reader { document: "gaussians-ply", read: |p| ply::read_gaussians(p).map(drop) },
    Reader { document: "gltf", read: |p| motes_codecs::read_gaussians(p).map(drop) },
    Reader { document: "images", read: |p| images::read_image_upright(p).map(drop) },
    Reader { document: "ksplat", read: |p| motes_codecs::read_gaussians(p).map(drop) },
    Reader { document: "meshes", read: mesh },
    Reader { document: "metrics", read: json::<metrics::MetricsDocument> },
    Reader { document: "points-ply", read: |p| ply::read_points(p).map(drop) },
    Reader { document: "run", read: json::<run_record::RunRecord> },
    Reader { document: "sog", read: |p| motes_codecs::read_gaussians(p).map(drop) },
    Reader { document: "splat", read: |p| motes_codecs::read_gaussians(p).map(drop) },
    Reader { document: "spz", read: |p| motes_codecs::read_gaussians(p).map(drop) },
    Reader { document: "surface-ply", read: |p| ply::read_surface(p).map(drop) },
    Reader { document: "tensors", read: |p| tensors::read_tensors(p).map(drop) },
];

fn mesh(path: &Path) -> Result<(), FormatError> {
    let mesh = motes_codecs::open_mesh(path)?;
    mesh.map(drop).ok_or_else(|| FormatError::invalid(path, "", "not a mesh"))
}

fn json<T: Document>(path: &Path) -> Result<(), FormatError> {
    read_document::<T>(path).map(drop)
}

/// `testdata/formats`.
pub(crate) fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/formats")
}

/// Files of `DOCUMENT/v1/KIND` that are cases: those a reader of the document opens itself.
pub(crate) fn cases(document: &str, kind: &str) -> Vec<PathBuf> {
    let folder = corpus().join(document).join("v1").join(kind);
    let mut paths: Vec<PathBuf> = std::fs::read_dir(&folder)
        .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            let suffix = path.extension().unwrap_or_default();
            let companion = document == "capture" && suffix != "json";
            suffix != "expect" && !companion
        })
        .collect();
    paths.sort();
    paths
}
