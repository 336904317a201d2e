//! A source in another unit, or at map coordinates, gives the same picture.

use std::fs;

use super::bench::{Bench, IMPORT, TRAIN, tiny};

/// Copies the tiny COLMAP model with every position `p` replaced by `scale p + shift`.
fn transformed(bench: &Bench, scale: f64, shift: [f64; 3]) {
    let model = bench.path("model");
    fs::create_dir_all(model.join("sparse/0")).unwrap();
    fs::create_dir_all(model.join("images")).unwrap();
    for photo in fs::read_dir(tiny().join("images")).unwrap() {
        let photo = photo.unwrap();
        fs::copy(photo.path(), model.join("images").join(photo.file_name())).unwrap();
    }
    let read = |name: &str| fs::read_to_string(tiny().join("sparse/0").join(name)).unwrap();
    let write =
        |name: &str, text: String| fs::write(model.join("sparse/0").join(name), text).unwrap();
    write("cameras.txt", read("cameras.txt"));
    let mut points = String::new();
    for line in read("points3D.txt").lines() {
        let mut words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        if !line.starts_with('#') {
            for axis in 0..3 {
                let value: f64 = words[1 + axis].parse().unwrap();
                words[1 + axis] = format!("{}", value * scale + shift[axis]);
            }
        }
        points += &(words.join(" ") + "\n");
    }
    write("points3D.txt", points);
    let mut images = String::new();
    for line in read("images.txt").lines() {
        let mut words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        if !line.starts_with('#') && line.ends_with(".png") {
            let number = |k: usize| words[k].parse::<f64>().unwrap();
            let rotation = glam::DQuat::from_xyzw(number(2), number(3), number(4), number(1));
            let translation = glam::DVec3::new(number(5), number(6), number(7)) * scale
                - rotation.normalize() * glam::DVec3::from_array(shift);
            for axis in 0..3 {
                words[5 + axis] = format!("{}", translation[axis]);
            }
        }
        images += &(words.join(" ") + "\n");
    }
    write("images.txt", images);
}

fn psnr_of(scale: f64, shift: [f64; 3]) -> f64 {
    let bench = Bench::new();
    transformed(&bench, scale, shift);
    bench.ok(IMPORT, &["model", "-o", "cap", "--test-every", "4", "-q"]);
    let line = ["--capture", "cap/capture.json", "-o", "g.ply", "-n=300", "-q"];
    bench.ok(TRAIN, &[&line[..], &["--max-gaussians", "800", "--refine-every=50"]].concat());
    bench.psnr("g.ply")
}

#[test]
fn the_unit_and_origin_of_the_source_do_not_matter() {
    let one = psnr_of(1.0, [0.0; 3]);
    assert!(one > 15.0, "{one}");
    for (scale, shift) in [
        (1e-6, [0.0; 3]),
        (1e-3, [0.0; 3]),
        (0.3048, [0.0; 3]),
        (1e6, [0.0; 3]),
        (1.0, [500_000.0, 5_400_000.0, 300.0]),
        (1.0, [1e7, -1e7, 1e7]),
    ] {
        let other = psnr_of(scale, shift);
        assert!((other - one).abs() < 0.01, "{scale:e} {shift:?}: {one:.4} dB, now {other:.4} dB");
    }
}
