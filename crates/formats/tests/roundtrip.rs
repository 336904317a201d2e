//! Random values survive being written and read, bit for bit where the format can hold them.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;

use glam::{DQuat, DVec3};
use motes_formats::exr_aov::{AovChannel, open_exr, write_exr};
use motes_formats::{capture, images, ply, tensors};
use motes_math::rng::keyed_rng;
use motes_scene::{
    Camera, CameraModel, Capture, ColumnValues, ExposureResponse, ExtraColumn, Gaussians, ImageU8,
    Pose, SparsePoints, Split, View,
};
use rand::{Rng, RngExt as _};

const CASES: u64 = 40;

/// Any bits at all: infinities, NaN with payloads, denormals.
fn any_f32(rng: &mut impl Rng) -> f32 {
    f32::from_bits(rng.random())
}

fn list<T>(n: usize, mut make: impl FnMut() -> T) -> Vec<T> {
    (0..n).map(|_| make()).collect()
}

fn any_column(rng: &mut impl Rng, n: usize) -> ColumnValues {
    match rng.random_range(0..8) {
        0 => ColumnValues::I8(list(n, || rng.random())),
        1 => ColumnValues::U8(list(n, || rng.random())),
        2 => ColumnValues::I16(list(n, || rng.random())),
        3 => ColumnValues::U16(list(n, || rng.random())),
        4 => ColumnValues::I32(list(n, || rng.random())),
        5 => ColumnValues::U32(list(n, || rng.random())),
        6 => ColumnValues::F32(list(n, || any_f32(rng))),
        _ => ColumnValues::F64(list(n, || f64::from_bits(rng.random()))),
    }
}

fn any_gaussians(rng: &mut impl Rng) -> Gaussians {
    // Around the number of rows that one block of the reader and of the writer holds.
    let n = [0, 1, 7, 1023, 1024, 1025, 4500][rng.random_range(0..7)];
    let sh_degree = rng.random_range(0..=4u8);
    let coefficients = 3 * (usize::from(sh_degree) + 1).pow(2);
    let names = ["nx", "ny", "nz", "label", "x2", "f_rest", "écran", "rot_x"];
    let extra = names[rng.random_range(0..names.len())..]
        .iter()
        .map(|name| ExtraColumn { name: (*name).into(), values: any_column(rng, n) });
    let extra = extra.collect();
    Gaussians {
        means: list(n, || [0; 3].map(|_| any_f32(rng))),
        rotations: list(n, || [0; 4].map(|_| any_f32(rng))),
        log_scales: list(n, || [0; 3].map(|_| any_f32(rng))),
        opacity_logits: list(n, || any_f32(rng)),
        sh_degree,
        sh: list(n * coefficients, || any_f32(rng)),
        extra,
    }
}

/// Bit patterns, because NaN equals nothing.
fn bits(g: &Gaussians) -> Vec<u32> {
    let floats = g.means.iter().flatten().chain(g.rotations.iter().flatten());
    let floats = floats.chain(g.log_scales.iter().flatten()).chain(&g.opacity_logits).chain(&g.sh);
    floats.map(|v| v.to_bits()).collect()
}

#[test]
fn gaussians() {
    let options = ply::PlyWriteOptions::default();
    let dir = tempfile::tempdir().unwrap();
    for case in 0..CASES {
        let mut rng = keyed_rng(1, 0, case);
        let gaussians = any_gaussians(&mut rng);
        let path = dir.path().join(format!("{case}.ply"));
        // As they are: a product would have to be finite.
        let file = std::fs::File::create(&path).unwrap();
        let mut file = std::io::BufWriter::new(file);
        ply::write_gaussians_to(&mut file, &gaussians, &options, &path).unwrap();
        std::io::Write::flush(&mut file).unwrap();
        let read = ply::read_gaussians(&path).unwrap();
        assert_eq!(read.sh_degree, gaussians.sh_degree, "case {case}");
        assert!(bits(&read) == bits(&gaussians), "case {case}");
        let mut stream = Vec::new();
        ply::write_gaussians_to(&mut stream, &read, &options, Path::new("-")).unwrap();
        assert!(stream == std::fs::read(&path).unwrap(), "case {case}: the copy differs");
        let streamed = ply::read_gaussians_from(&stream[..], Path::new("-")).unwrap().gaussians;
        assert!(bits(&streamed) == bits(&gaussians), "case {case}: read as a stream");
    }
}

#[test]
fn points_and_captures() {
    let dir = tempfile::tempdir().unwrap();
    for case in 0..CASES {
        let mut rng = keyed_rng(2, 0, case);
        let mut real = |scale: f64| (rng.random::<f64>() - 0.5) * scale;
        let mut cameras = Vec::new();
        for model in CameraModel::all() {
            let focals = model.focal_count();
            let value = |i| if i < focals { real(1.0).abs() * 1e4 + 1.0 } else { real(1e3) };
            let params = (0..model.parameter_count()).map(value).collect();
            cameras.push(Camera { model, width: 4000, height: 1, params });
        }
        let mut views: Vec<View> = (0..20)
            .map(|i| {
                let rotation = DQuat::from_xyzw(real(1.0), real(1.0), real(1.0), real(1.0) + 1e-3);
                let translation = DVec3::new(real(1e7), real(1e-12), real(1.0));
                View {
                    name: format!("{} {i}", char::from_u32(0x3b1 + i).unwrap()),
                    camera: i as usize % cameras.len(),
                    camera_from_world: Pose { rotation: rotation.normalize(), translation },
                    image: format!("i/{i}.jpg").into(),
                    mask: (i % 3 == 0).then(|| format!("m/{i}.png").into()),
                    split: if i % 8 == 0 { Split::Test } else { Split::Train },
                    exposure_stops: (i % 3 == 0).then(|| f64::from(i) / 3.0),
                }
            })
            .collect();
        views.sort_by(|a, b| a.name.cmp(&b.name));
        let world_origin = DVec3::new(real(1e8), real(1.0), real(1e-300));
        let n = (case * 37) as usize;
        let positions = list(n, || [0; 3].map(|_| real(1e6) as f32));
        let colors = list(n, || [0; 3].map(|_| rng.random::<u8>()));
        let points = SparsePoints { positions, colors };
        let exposure_response = (case % 2 == 0).then_some(ExposureResponse {
            slope_per_stop: 0.1 + 1e-17,
            reference_stops: -1.0 / 3.0,
        });
        let expected = Capture { cameras, views, points, world_origin, exposure_response };
        let path = dir.path().join(format!("{case}/capture.json"));
        capture::write_capture(&path, &expected).unwrap();
        assert_eq!(capture::read_capture(&path).unwrap(), expected, "case {case}");
    }
}

#[test]
fn images_and_channels() {
    let dir = tempfile::tempdir().unwrap();
    for case in 0..CASES {
        let mut rng = keyed_rng(3, 0, case);
        let (width, height) = (rng.random_range(1..70), rng.random_range(1..70));
        let pixels = width * height;
        for channels in [3, 4] {
            let data = list(pixels * channels, || rng.random());
            let image = ImageU8::from_data(width, height, channels, data);
            let png = images::encode_png(&image);
            assert_eq!(images::read_image_from(&png, Path::new("x")).unwrap(), image);
        }
        let halves: Vec<f32> = list(pixels, || rng.random::<i16>().into());
        let channels = [
            AovChannel::half("R", &halves),
            AovChannel::uint("id", list(pixels, || rng.random())),
            AovChannel::float("layer.pass.V", list(pixels, || rng.random::<f32>() - 0.5)),
        ];
        let path = dir.path().join(format!("{case}.exr"));
        let attributes = [("a".to_owned(), "b".to_owned()), ("c".to_owned(), String::new())];
        write_exr(&path, width, height, &channels, &attributes).unwrap();
        let read = open_exr(&path).unwrap();
        assert_eq!((read.width, read.height), (width, height));
        assert_eq!(read.channels, channels, "case {case}");
        let first = std::fs::read(&path).unwrap();
        write_exr(&path, width, height, &channels, &attributes).unwrap();
        assert!(first == std::fs::read(&path).unwrap(), "case {case}: other bytes");
    }
}

#[test]
fn tensor_files() {
    let dir = tempfile::tempdir().unwrap();
    for case in 0..CASES {
        let mut rng = keyed_rng(4, 0, case);
        let n = rng.random_range(0..3000);
        let list = vec![
            ("f".to_owned(), tensors::TensorData::F32(vec![n], list(n, || any_f32(&mut rng)))),
            ("i".to_owned(), tensors::TensorData::I64(vec![1, n], list(n, || rng.random()))),
            ("b".to_owned(), tensors::TensorData::U8(vec![n, 1], list(n, || rng.random()))),
        ];
        let path = dir.path().join("t");
        tensors::write_tensors(&path, &list, &Default::default()).unwrap();
        let (read, _) = tensors::read_tensors(&path).unwrap();
        let floats = |t: &tensors::TensorData| -> Vec<u32> {
            t.as_f32().unwrap().iter().map(|v| v.to_bits()).collect()
        };
        assert_eq!(floats(&read["f"]), floats(&list[0].1), "case {case}");
        assert_eq!((&read["i"], &read["b"]), (&list[1].1, &list[2].1), "case {case}");
    }
}
