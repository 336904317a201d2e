//! What a fit leaves on its way: PLY snapshots and event files for TensorBoard.
#![expect(clippy::unwrap_used, reason = "a test that cannot prepare its files has failed")]

use std::collections::BTreeMap;
use std::path::Path;

use motes_formats::ply::read_gaussians;
use motes_testkit::toy_capture::{ToyCapture, assert_code, run, stderr, toy_capture};

const PROGRAM: &str = env!("CARGO_BIN_EXE_train-splat");

fn train(toy: &ToyCapture, extra: &[&str]) -> std::process::Output {
    let line = ["--capture", "capture.json", "--init-ply", "true.ply", "-q", "--no-provenance"];
    run(PROGRAM, toy.folder.path(), &[&line[..], &["-n=25"], extra].concat())
}

/// CRC-32C by long division, the highest bit first: not how the writer does it.
fn crc32c(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(byte.reverse_bits()) << 24;
        for _ in 0..8 {
            crc = (crc << 1) ^ if crc >> 31 == 1 { 0x1edc_6f41 } else { 0 };
        }
    }
    !crc.reverse_bits()
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

/// The events of a TFRecord file, whose sums hold.
fn records(mut bytes: &[u8]) -> Vec<Vec<u8>> {
    let masked = |bytes: &[u8]| {
        let crc = crc32c(bytes);
        crc.rotate_right(15).wrapping_add(0xa282_ead8)
    };
    let mut records = Vec::new();
    while !bytes.is_empty() {
        let length = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
        assert_eq!(u32_at(bytes, 8), masked(&bytes[..8]));
        let event = &bytes[12..12 + length];
        assert_eq!(u32_at(bytes, 12 + length), masked(event));
        records.push(event.to_vec());
        bytes = &bytes[16 + length..];
    }
    records
}

fn varint(bytes: &mut &[u8]) -> u64 {
    let mut value = 0;
    for i in 0.. {
        let byte = bytes[0];
        *bytes = &bytes[1..];
        value |= u64::from(byte & 0x7f) << (7 * i);
        if byte < 0x80 {
            break;
        }
    }
    value
}

/// Fields of a protocol buffer by number: the bytes of each, or of its number.
fn fields(mut bytes: &[u8]) -> Vec<(u64, Vec<u8>)> {
    let mut found = Vec::new();
    while !bytes.is_empty() {
        let key = varint(&mut bytes);
        let length = match key & 7 {
            0 => {
                found.push((key >> 3, varint(&mut bytes).to_le_bytes().to_vec()));
                continue;
            }
            1 => 8,
            2 => varint(&mut bytes) as usize,
            5 => 4,
            other => panic!("type {other}"),
        };
        found.push((key >> 3, bytes[..length].to_vec()));
        bytes = &bytes[length..];
    }
    found
}

/// Scalars by tag and step.
fn scalars(path: &Path) -> BTreeMap<(String, u64), f32> {
    let events = records(&std::fs::read(path).unwrap());
    assert!(events[0].ends_with(b"\x1a\x0dbrain.Event:2"), "the first event tells the version");
    let mut found = BTreeMap::new();
    for event in &events[1..] {
        let event = fields(event);
        let step = event.iter().find(|(number, _)| *number == 2).unwrap();
        let step = u64::from_le_bytes(step.1.as_slice().try_into().unwrap());
        for (_, summary) in event.iter().filter(|(number, _)| *number == 5) {
            for (_, value) in fields(summary) {
                let value = fields(&value);
                let tag = String::from_utf8(value[0].1.clone()).unwrap();
                found.insert((tag, step), f32::from_bits(u32_at(&value[1].1, 0)));
            }
        }
    }
    found
}

#[test]
fn snapshots_are_whole_splats_and_change_nothing() {
    let toy = toy_capture();
    assert_code(&train(&toy, &["-o", "plain.ply"]), 0);
    assert_code(&train(&toy, &["-o", "g.ply", "--export-every", "10", "--tensorboard", "tb"]), 0);
    let bytes = |name: &str| std::fs::read(toy.path(name)).unwrap();
    assert!(bytes("plain.ply") == bytes("g.ply"));
    let [ten, twenty] = ["g.step-000010.ply", "g.step-000020.ply"];
    assert!(bytes(ten) != bytes(twenty), "the fit went on");
    for name in [ten, twenty] {
        let gaussians = read_gaussians(&toy.path(name)).unwrap();
        assert!(!gaussians.is_empty() && gaussians.invalid_rows().is_empty());
    }
    let names = std::fs::read_dir(toy.folder.path()).unwrap();
    let names = names.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    assert_eq!(names.filter(|name| name.starts_with("g.step")).count(), 2);

    std::fs::remove_file(toy.path("g.ply")).unwrap();
    let refused = train(&toy, &["-o", "g.ply", "--export-every", "10"]);
    assert_code(&refused, 2);
    assert!(stderr(&refused).contains("g.step-000010.ply"), "{}", stderr(&refused));
    assert_code(&train(&toy, &["-o", "g.ply", "--export-every", "10", "-w"]), 0);
    assert_code(&train(&toy, &["-o", "n.ply", "--export-every", "0"]), 2);
}

#[test]
fn curves_for_tensorboard_read_back_with_their_sums() {
    let toy = toy_capture();
    let line = ["-o", "g.ply", "--tensorboard", "tb", "--eval-every", "10", "--metrics", "m.json"];
    assert_code(&train(&toy, &line), 0);
    let files: Vec<_> = std::fs::read_dir(toy.path("tb")).unwrap().map(|e| e.unwrap()).collect();
    assert_eq!(files.len(), 1);
    assert!(files[0].file_name().to_str().unwrap().starts_with("events.out.tfevents."));
    let found = scalars(&files[0].path());
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(toy.path("m.json")).unwrap()).unwrap();
    let history = report["history"].as_array().unwrap();
    assert!(history.len() >= 3, "{history:?}");
    for row in history {
        let step = row["step"].as_u64().unwrap();
        let of = |tag: &str| f64::from(found[&(tag.to_owned(), step)]);
        assert!((of("loss/train") - row["loss"].as_f64().unwrap()).abs() < 1e-6);
        assert_eq!(of("gaussians"), row["gaussians"].as_f64().unwrap());
    }
    let last = report["iterations"].as_u64().unwrap();
    for (tag, key) in [("psnr/train", "psnr_train"), ("psnr/test", "psnr_test")] {
        let score = f64::from(found[&(tag.to_owned(), last)]);
        assert!((score - report[key].as_f64().unwrap()).abs() < 1e-4, "{tag}: {score}");
    }
    assert!(found.contains_key(&("psnr/test".to_owned(), 10)));
}

#[test]
#[should_panic(expected = "assertion")]
fn a_changed_byte_breaks_a_sum() {
    let folder = tempfile::tempdir().unwrap();
    let mut events = motes_formats::event_file::EventFile::create(folder.path()).unwrap();
    events.scalars(1, &[("a", 1.0)]).unwrap();
    let mut bytes = std::fs::read(events.path()).unwrap();
    let last = bytes.len() - 6;
    bytes[last] ^= 1;
    records(&bytes);
}
