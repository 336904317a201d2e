//! LPIPS against a naive double-precision evaluation of the published formula.

use super::*;

/// Deterministic values in [-1, 1).
fn noise(n: usize, seed: u64) -> Vec<f32> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    (0..n)
        .map(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
        })
        .collect()
}

/// Weights of the network's shape with `width + k` channels in convolution `k`.
fn weights(net: LpipsNet, width: usize) -> BTreeMap<String, TensorData> {
    let mut tensors = BTreeMap::new();
    let (mut channels, mut taps, mut seed) = (3, 0, 1);
    for step in net.steps() {
        match *step {
            Step::Convolution { feature, kernel, .. } => {
                let out = width + seed as usize % 3;
                let gain = (2.0 / (channels * kernel * kernel) as f32).sqrt() * 1.7;
                let values = noise(out * channels * kernel * kernel, seed);
                let values = values.iter().map(|v| v * gain).collect();
                let shape = vec![out, channels, kernel, kernel];
                tensors
                    .insert(format!("features.{feature}.weight"), TensorData::F32(shape, values));
                let bias = noise(out, seed + 77).iter().map(|v| 0.1 * v).collect();
                tensors
                    .insert(format!("features.{feature}.bias"), TensorData::F32(vec![out], bias));
                channels = out;
                seed += 1;
            }
            Step::Tap => {
                let values: Vec<f32> =
                    noise(channels, 500 + taps).iter().map(|v| v.abs()).collect();
                let shape = vec![1, channels, 1, 1];
                tensors.insert(format!("lin{taps}.weight"), TensorData::F32(shape, values));
                taps += 1;
            }
            Step::MaxPool { .. } => {}
        }
    }
    tensors
}

fn picture(width: usize, height: usize, seed: u64) -> ImageF32 {
    let values = noise(width * height * 3, seed).iter().map(|v| 0.5 + 0.5 * v).collect();
    ImageF32::from_data(width, height, 3, values)
}

type Planes = (usize, usize, Vec<Vec<f64>>);

/// The formula written out: one loop per index, no padding tricks, nothing shared with the
/// implementation but the list of layers of torchvision, which is spelled out again here.
fn naive(net: LpipsNet, tensors: &BTreeMap<String, TensorData>, a: &ImageF32, b: &ImageF32) -> f64 {
    let values = |name: &str| -> Vec<f64> {
        let TensorData::F32(_, v) = &tensors[name] else { panic!("{name}") };
        v.iter().map(|&v| f64::from(v)).collect()
    };
    let input = |image: &ImageF32| -> Planes {
        let planes = (0..3)
            .map(|c| {
                let (mean, deviation) = ([-0.030, -0.088, -0.188][c], [0.458, 0.448, 0.450][c]);
                let pixels = image.data.iter().skip(c).step_by(3);
                pixels.map(|&v| (f64::from(v) * 2.0 - 1.0 - mean) / deviation).collect()
            })
            .collect();
        (image.width, image.height, planes)
    };
    let convolve = |(w, h, planes): &Planes, n: usize, k: i64, stride: i64, pad: i64| -> Planes {
        let (weight, bias) =
            (values(&format!("features.{n}.weight")), values(&format!("features.{n}.bias")));
        let (ow, oh) =
            ((*w as i64 + 2 * pad - k) / stride + 1, (*h as i64 + 2 * pad - k) / stride + 1);
        let out = bias.iter().enumerate().map(|(o, bias)| {
            let mut plane = Vec::new();
            for y in 0..oh {
                for x in 0..ow {
                    let mut sum = *bias;
                    for (i, plane) in planes.iter().enumerate() {
                        for ky in 0..k {
                            for kx in 0..k {
                                let (sy, sx) = (y * stride + ky - pad, x * stride + kx - pad);
                                if sy >= 0 && sx >= 0 && sy < *h as i64 && sx < *w as i64 {
                                    let at = ((o as i64 * planes.len() as i64 + i as i64) * k + ky)
                                        * k
                                        + kx;
                                    sum +=
                                        weight[at as usize] * plane[(sy * *w as i64 + sx) as usize];
                                }
                            }
                        }
                    }
                    plane.push(if sum > 0.0 { sum } else { 0.0 });
                }
            }
            plane
        });
        let out = out.collect();
        (ow as usize, oh as usize, out)
    };
    let pool = |(w, h, planes): &Planes, size: usize| -> Planes {
        let (ow, oh) = ((w - size) / 2 + 1, (h - size) / 2 + 1);
        let out = planes.iter().map(|plane| {
            let mut out = Vec::new();
            for y in 0..oh {
                for x in 0..ow {
                    let mut best = plane[2 * y * w + 2 * x];
                    for dy in 0..size {
                        for dx in 0..size {
                            best = best.max(plane[(2 * y + dy) * w + 2 * x + dx]);
                        }
                    }
                    out.push(best);
                }
            }
            out
        });
        (ow, oh, out.collect())
    };
    let taps = |image: &ImageF32| -> Vec<Planes> {
        let x = input(image);
        match net {
            LpipsNet::Alex => {
                let t0 = convolve(&x, 0, 11, 4, 2);
                let t1 = convolve(&pool(&t0, 3), 3, 5, 1, 2);
                let t2 = convolve(&pool(&t1, 3), 6, 3, 1, 1);
                let t3 = convolve(&t2, 8, 3, 1, 1);
                let t4 = convolve(&t3, 10, 3, 1, 1);
                vec![t0, t1, t2, t3, t4]
            }
            LpipsNet::Vgg => {
                let block = |x: &Planes, numbers: &[usize]| {
                    numbers.iter().fold(x.clone(), |x, &n| convolve(&x, n, 3, 1, 1))
                };
                let t0 = block(&x, &[0, 2]);
                let t1 = block(&pool(&t0, 2), &[5, 7]);
                let t2 = block(&pool(&t1, 2), &[10, 12, 14]);
                let t3 = block(&pool(&t2, 2), &[17, 19, 21]);
                let t4 = block(&pool(&t3, 2), &[24, 26, 28]);
                vec![t0, t1, t2, t3, t4]
            }
        }
    };
    let mut total = 0.0;
    for (layer, (a, b)) in taps(a).iter().zip(&taps(b)).enumerate() {
        let lin = values(&format!("lin{layer}.weight"));
        let pixels = a.0 * a.1;
        for i in 0..pixels {
            let norm = |p: &Planes| p.2.iter().map(|c| c[i] * c[i]).sum::<f64>().sqrt() + 1e-10;
            for (c, lin) in lin.iter().enumerate() {
                let d = a.2[c][i] / norm(a) - b.2[c][i] / norm(b);
                total += lin * d * d / pixels as f64;
            }
        }
    }
    total
}

#[test]
fn both_networks_match_the_naive_formula() {
    for (net, width, height) in [(LpipsNet::Alex, 71, 83), (LpipsNet::Vgg, 37, 33)] {
        let tensors = weights(net, 4);
        let (a, b) = (picture(width, height, 3), picture(width, height, 4));
        let lpips = Lpips::new(net, LpipsRange::Symmetric, &tensors).unwrap();
        let (fast, slow) = (lpips.distance(&a, &b).unwrap(), naive(net, &tensors, &a, &b));
        assert!(slow > 0.01, "{net:?}: the test images differ: {slow}");
        assert!((fast - slow).abs() < 1e-5 * slow, "{net:?}: {fast} against {slow}");
    }
}

#[test]
fn equal_images_have_distance_zero_and_order_does_not_matter() {
    let lpips =
        Lpips::new(LpipsNet::Vgg, LpipsRange::Symmetric, &weights(LpipsNet::Vgg, 4)).unwrap();
    let (a, b) = (picture(40, 36, 8), picture(40, 36, 9));
    assert_eq!(lpips.distance(&a, &a).unwrap(), 0.0);
    assert_eq!(lpips.distance(&a, &b).unwrap(), lpips.distance(&b, &a).unwrap());
}

#[test]
fn the_input_range_matters() {
    let tensors = weights(LpipsNet::Alex, 4);
    let (a, b) = (picture(71, 71, 1), picture(71, 71, 2));
    let distance =
        |range| Lpips::new(LpipsNet::Alex, range, &tensors).unwrap().distance(&a, &b).unwrap();
    let (symmetric, unit) = (distance(LpipsRange::Symmetric), distance(LpipsRange::Unit));
    assert!((symmetric - unit).abs() > 1e-4, "{symmetric} {unit}");
}

#[test]
fn unfit_weights_and_images_are_named() {
    let mut tensors = weights(LpipsNet::Alex, 4);
    let lpips = Lpips::new(LpipsNet::Alex, LpipsRange::Symmetric, &tensors).unwrap();
    let tiny = picture(20, 90, 1);
    assert_eq!(lpips.distance(&tiny, &tiny), Err(LpipsError::TooSmall(20, 90)));
    tensors.insert("lin2.weight".into(), TensorData::F32(vec![1], vec![1.0]));
    let error = Lpips::new(LpipsNet::Alex, LpipsRange::Symmetric, &tensors).unwrap_err();
    assert!(error.to_string().contains("lin2.weight"), "{error}");
    tensors.remove("features.3.bias");
    let error = Lpips::new(LpipsNet::Alex, LpipsRange::Symmetric, &tensors).unwrap_err();
    assert!(error.to_string().contains("features.3.bias"), "{error}");
    let error = Lpips::new(LpipsNet::Vgg, LpipsRange::Symmetric, &tensors).unwrap_err();
    assert!(error.to_string().contains("features.0.weight"), "{error}");
}
