//! Every valid file of the corpus is read, and nothing is lost when it is written and read again.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::path::Path;

use common::cases;
use motes_formats::documents::{Document, parse_document, to_pretty_json};
use motes_formats::ply::{self, PlyWriteOptions};
use motes_formats::{
    camera_path, capture, decomposition, environment, exr_aov, images, metrics, run_record, tensors,
};
use motes_scene::Gaussians;

fn name(path: &Path) -> String {
    path.file_name().unwrap().to_string_lossy().into_owned()
}

fn gaussian_bytes(gaussians: &Gaussians) -> Vec<u8> {
    let mut bytes = Vec::new();
    let options = PlyWriteOptions::default();
    ply::write_gaussians_to(&mut bytes, gaussians, &options, Path::new("written")).unwrap();
    bytes
}

#[test]
fn gaussians_survive_to_the_byte() {
    let mut same: Option<Gaussians> = None;
    let mut count = 0;
    for path in cases("gaussians-ply", "valid") {
        let gaussians = ply::read_gaussians(&path).unwrap();
        assert!(gaussians.is_consistent(), "{}", path.display());
        let written = gaussian_bytes(&gaussians);
        let again = ply::read_gaussians_from(&written[..], Path::new("again")).unwrap().gaussians;
        assert_eq!(gaussian_bytes(&again), written, "{}", path.display());
        if name(&path).starts_with("same-") {
            let first = same.get_or_insert_with(|| gaussians.clone());
            assert_eq!(gaussians, *first, "{}", path.display());
            count += 1;
        }
    }
    let same = same.unwrap();
    assert!(count >= 12 && same.len() == 5 && same.sh_degree == 1 && same.extra.is_empty());
}

/// The columns of these files spell their own values, so the reader cannot agree with itself only.
#[test]
fn gaussian_columns_have_the_values_that_the_files_spell() {
    let find = |file: &str| {
        let paths = cases("gaussians-ply", "valid");
        ply::read_gaussians(paths.iter().find(|p| name(p) == file).unwrap()).unwrap()
    };
    let extra = find("extra-columns.ply").extra;
    let names: Vec<&str> = extra.iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names, ["label", "object_id", "score", "group", "sign", "s", "u", "roughness"]);
    use motes_scene::ColumnValues as V;
    let expected = [
        V::U8(vec![250, 251, 252]),
        V::I32(vec![0, -1, -2]),
        V::F64(vec![0.0, 1.0 / 3.0, 2.0 / 3.0]),
        V::U16(vec![65535, 65534, 65533]),
        V::I8(vec![0, -1, -2]),
        V::I16(vec![0, -300, -600]),
        V::U32(vec![u32::MAX, u32::MAX - 1, u32::MAX - 2]),
        V::F32(vec![0.5, 1.5, 2.5]),
    ];
    for (column, values) in extra.iter().zip(expected) {
        assert_eq!(column.values, values, "{}", column.name);
    }
    for degree in 0..=4u8 {
        let gaussians = find(&format!("degree-{degree}.ply"));
        assert_eq!((gaussians.sh_degree, gaussians.len()), (degree, 3));
    }
    assert_eq!(find("not-a-number.ply").invalid_rows(), [1]);
    assert_eq!(find("normals.ply").extra.len(), 3);
    let flat = find("flat-2dgs.ply").log_scales[2];
    assert_eq!(flat[2], flat[0].min(flat[1]) + ply::FLAT_LOG_RATIO);
}

/// The cases spell what is compared: `testdata/formats/splat_cases.py`.
#[test]
fn splats_have_the_values_that_the_files_spell() {
    let read = |document: &str, file: &str| {
        let paths = cases(document, "valid");
        motes_codecs::open_gaussians(paths.iter().find(|p| name(p) == file).unwrap()).unwrap()
    };
    let near = |a: f32, b: f32| (a - b).abs() < 1e-5;
    let dot = read("splat", "five.splat").gaussians;
    assert_eq!((dot.len(), dot.means[3]), (5, [3.0, 1.5, -1.0]));
    assert!(near(dot.log_scales[2][2], 2.3f32.ln()) && near(dot.sh[0], -0.5 / 0.282_094_8));
    for version in 1..=4 {
        let file = read("spz", &format!("version-{version}.spz"));
        let spz = file.gaussians;
        assert_eq!((spz.len(), spz.sh_degree), (5, if version == 4 { 3 } else { 2 }));
        let z = if version == 1 { -0.5 } else { -2.0 };
        assert_eq!(spz.means[3], [3.0, 3.0, z], "y and z are turned");
        assert_eq!(spz.log_scales[0], [60.0f32, 61.0, 62.0].map(|v| v / 16.0 - 10.0));
        // Y_1 is odd in y, which is turned: byte 100 of the first row.
        assert_eq!(spz.sh_of(0)[3], 28.0 / 128.0);
        if version >= 3 {
            // Largest w; x = 100, y = -100, z = 50 of 511.
            let unit = |v: f32| v / 511.0 * 0.5f32.sqrt();
            let [w, x, y, z] = spz.rotations[0];
            assert!(
                w > 0.95 && near(x, unit(100.0)) && near(y, unit(100.0)) && near(z, -unit(50.0))
            );
        }
    }
    assert_eq!(read("spz", "version-4-degree-4.spz").gaussians.sh_degree, 4);
    assert_eq!(read("spz", "antialiased.spz").render_mode, Some(ply::RenderMode::Mip));
    for level in 0..3u8 {
        let ksplat = read("ksplat", &format!("level-{level}.ksplat")).gaussians;
        assert_eq!((ksplat.len(), ksplat.sh_degree), (5, level));
        let expected = match level {
            0 => [4.0, -4.0, 0.25],
            // The fifth is alone in the third bucket; a step is 2 / 32767.
            _ => [20.0 + 400.0 * 2.0 / 32767.0, 1.0, 2.0 - (32767.0 - 5.0) * 2.0 / 32767.0],
        };
        assert!((0..3).all(|axis| near(ksplat.means[4][axis], expected[axis])), "{level}");
        assert!((ksplat.log_scales[1][1] - 0.2f32.ln()).abs() < 1e-3);
    }
    let level_2 = read("ksplat", "level-2.ksplat").gaussians;
    // Components 0, 1, 2 are red of band 1, then green: (j % 7 - 3) / 4 in steps of 4 / 255.
    let sh = level_2.sh_of(0);
    assert!((sh[3] + 0.75).abs() < 0.02 && (sh[6] + 0.5).abs() < 0.02 && sh[4].abs() < 0.02);
    let glb = read("gltf", "same-binary.glb").gaussians;
    assert_eq!(glb, read("gltf", "same-embedded.gltf").gaussians);
    assert_eq!((glb.len(), glb.sh_degree, glb.means[2]), (5, 1, [-2.0, 2.0, 0.5]));
    assert_eq!((glb.rotations[0], glb.opacity_logits[2]), ([0.8, 0.0, 0.0, 0.6], 0.0));
    assert_eq!((glb.sh_of(1)[3], glb.extra[0].name.as_str()), (-2.0 / 8.0, "roughness"));
    // Linear 0.5 - 0.28 / 8 is encoded.
    let linear = read("gltf", "linear.glb").gaussians;
    let color = 0.5 + 0.282_094_8 * linear.sh_of(0)[1];
    assert!((color - motes_math::srgb::encode(0.5 + 0.282_094_8 / 8.0)).abs() < 1e-4);
    for degree in 0..4 {
        let path = format!("degree-{degree}.compressed.ply");
        let compressed = read("compressed-ply", &path).gaussians;
        assert_eq!((compressed.len(), compressed.sh_degree), (300, degree));
        // Byte 7 of the first row: red of the second coefficient at degree 1.
        if degree == 1 {
            assert_eq!(compressed.sh_of(0)[6], ((7.0 + 0.5) / 256.0 - 0.5) * 8.0);
        }
    }
    // What splat-transform packed from `ply_cases.py`, against what it packed.
    for degree in [0, 1, 3] {
        let sog = read("sog", &format!("degree-{degree}.sog")).gaussians;
        assert_eq!((sog.len(), sog.sh_degree), (64, degree));
        assert!(sog.means.iter().flatten().all(|v| (-2.01..2.0).contains(v)));
        assert!(sog.log_scales.iter().flatten().all(|v| (-4.01..=-2.1).contains(v)));
    }
}

#[test]
fn points_survive_to_the_byte() {
    let mut same = None;
    for path in cases("points-ply", "valid") {
        let points = ply::read_points(&path).unwrap();
        let mut bytes = Vec::new();
        ply::write_points_to(&mut bytes, &points, Path::new("written")).unwrap();
        assert_eq!(ply::read_points_from(&bytes[..], Path::new("again")).unwrap(), points);
        if name(&path).starts_with("same-") {
            let first = same.get_or_insert_with(|| points.clone());
            assert_eq!(points, *first, "{}", path.display());
        }
    }
    assert_eq!(same.unwrap().colors, [[0, 60, 120], [1, 61, 121], [2, 62, 122], [3, 63, 123]]);
}

#[test]
fn surfaces_survive_to_the_byte() {
    let mut same = None;
    for path in cases("surface-ply", "valid") {
        let surface = ply::read_surface(&path).unwrap();
        assert!(surface.is_consistent(), "{}", path.display());
        let mut bytes = Vec::new();
        ply::write_surface_to(&mut bytes, &surface, Path::new("written")).unwrap();
        let again = ply::read_surface_from(&bytes[..], Path::new("again")).unwrap();
        assert_eq!(again, surface, "{}", path.display());
        if name(&path) == "same-plain.ply" {
            // Behind the header nothing differs from what another program packed.
            let tail = bytes.len() - (4 * 11 * 4 + 2 * 13);
            assert!(std::fs::read(&path).unwrap().ends_with(&bytes[tail..]));
        }
        if name(&path).starts_with("same-") {
            let first = same.get_or_insert_with(|| surface.clone());
            assert_eq!(surface, *first, "{}", path.display());
        }
    }
    let same = same.unwrap();
    assert_eq!(same.triangles, [[0, 1, 2], [2, 1, 3]]);
    assert_eq!((same.vertices[2], same.normals[2]), ([0.0, 1.0, 0.5], [0.0, 0.0, 1.0]));
    assert_eq!((same.base_color_linear[3], same.roughness[3]), ([0.75, 0.5, 1.0], 0.25));
    assert_eq!(same.metallic, [1.0; 4]);
}

#[test]
fn environments_have_the_values_that_the_files_spell() {
    for path in cases("environment", "valid") {
        let map = environment::read_environment(&path).unwrap();
        assert_eq!(map.pixel(map.width - 1, 0), [0.5, 0.25, 2.0], "{}", path.display());
    }
}

#[test]
fn captures_survive_to_the_byte() {
    for path in cases("capture", "valid") {
        let (capture, warnings) = capture::read_capture_with_warnings(&path).unwrap();
        assert_eq!(warnings.len(), usize::from(name(&path) == "newer-minor.json"));
        let dir = tempfile::tempdir().unwrap();
        let (first, second) = (dir.path().join("a.json"), dir.path().join("b.json"));
        capture::write_capture(&first, &capture).unwrap();
        let again = capture::read_capture(&first).unwrap();
        assert_eq!(again, capture, "{}", path.display());
        capture::write_capture(&second, &again).unwrap();
        assert_eq!(std::fs::read(&first).unwrap(), std::fs::read(&second).unwrap());
    }
}

fn json_survives<T: Document + PartialEq + std::fmt::Debug>(folder: &str) {
    for path in cases(folder, "valid") {
        let parsed = parse_document::<T>(&std::fs::read(&path).unwrap(), &path).unwrap();
        assert!(parsed.warnings.is_empty(), "{:?}", parsed.warnings);
        let text = to_pretty_json(&parsed.document);
        let again = parse_document::<T>(text.as_bytes(), &path).unwrap();
        assert_eq!(again.document, parsed.document, "{}", path.display());
        assert_eq!(to_pretty_json(&again.document), text);
    }
}

#[test]
fn json_documents_survive() {
    json_survives::<metrics::MetricsDocument>("metrics");
    json_survives::<run_record::RunRecord>("run");
    json_survives::<camera_path::CameraPathDocument>("camera-path");
    json_survives::<decomposition::DecompositionDocument>("decomposition");
    for path in cases("decomposition", "valid") {
        let read = decomposition::read_decomposition(&path).unwrap();
        assert_eq!(read.gaussians, path.with_file_name("gaussians.ply"));
        assert_eq!(read.document.up_in_world, [0.0, 0.0, 1.0]);
    }
    for path in cases("camera-path", "valid") {
        assert_eq!(camera_path::read_camera_path(&path).unwrap().frames.len(), 2);
    }
}

#[test]
fn images_have_three_or_four_channels_and_survive_as_png() {
    for path in cases("images", "valid") {
        let image = images::read_image(&path).unwrap();
        let alpha = name(&path).contains("alpha") || name(&path).contains("rgba");
        assert_eq!(image.channels, if alpha { 4 } else { 3 }, "{}", path.display());
        let png = images::encode_png(&image);
        assert_eq!(images::read_image_from(&png, Path::new("again")).unwrap(), image);
        assert_eq!(images::image_dimensions(&path).unwrap(), (image.width, image.height));
        let first = match name(&path).as_str() {
            "gray.png" | "png-named-jpeg.jpg" => [0, 0, 0],
            "gray-1-bit.png" => [255; 3],
            "gray-16-bit.png" => [255; 3],
            "gray-alpha.png" => [200; 3],
            "rgb.png" | "rgb.ppm" => [0, 1, 2],
            "rgba-16-bit.png" => [255, 0, 1],
            "palette.png" => [9, 8, 7],
            "rgb.bmp" => [3, 2, 1],
            other => panic!("say what the first pixel of {other} is"),
        };
        assert_eq!(image.pixel(0, 0)[..3], first, "{}", path.display());
    }
}

#[test]
fn exr_channels_survive() {
    for path in cases("exr-aov", "valid") {
        let image = exr_aov::open_exr(&path).unwrap();
        let dir = tempfile::tempdir().unwrap();
        let copy = dir.path().join("copy.exr");
        let attributes: Vec<_> = image.attributes.clone().into_iter().collect();
        let (width, height) = (image.width, image.height);
        exr_aov::write_exr(&copy, width, height, &image.channels, &attributes).unwrap();
        assert_eq!(exr_aov::open_exr(&copy).unwrap(), image, "{}", path.display());
        if name(&path) == "layers.exr" {
            assert_eq!((width, height, image.channels.len()), (4, 3, 6));
            assert_eq!(image.attributes["comments"], "grün");
            let ids = &image.channel("object_id").unwrap().samples;
            assert_eq!(*ids, exr_aov::AovSamples::U32(vec![u32::MAX; 12]));
            assert_eq!(image.channel("depth.Z").unwrap().to_f32(), [3.7f32; 12]);
        }
    }
}

#[test]
fn tensors_survive() {
    for path in cases("tensors", "valid") {
        let (read, metadata) = tensors::read_tensors(&path).unwrap();
        let dir = tempfile::tempdir().unwrap();
        let copy = dir.path().join("copy.safetensors");
        let list: Vec<_> = read.clone().into_iter().collect();
        tensors::write_tensors(&copy, &list, &metadata).unwrap();
        let (again, again_metadata) = tensors::read_tensors(&copy).unwrap();
        // NaN equals nothing, its text does.
        assert_eq!(format!("{again:?}"), format!("{read:?}"), "{}", path.display());
        assert_eq!(again_metadata, metadata);
    }
}
