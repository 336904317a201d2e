use std::io::Read as _;

use base64::Engine as _;
use motes_math::sh::SH_C0;
use motes_math::sigmoid::sigmoid;
use motes_raster::Antialias;
use motes_scene::{ColumnValues, ExtraColumn, Gaussians, Materials};
use motes_testkit::random_gaussians;

use super::pack::{BLOCK, CHUNK, PackOptions, Packed, pack};
use super::{ViewerPage, ViewerSplat};

const FINEST: PackOptions = PackOptions { html_sh_bits: 8 };

/// One Gaussian as the page's shaders read it: the same arithmetic in double precision.
struct Read {
    mean: [f64; 3],
    log_scales: [f64; 3],
    opacity: f64,
    rotation: [f64; 4],
    sh: Vec<f64>,
    material: Option<[u32; 3]>,
}

fn read(packed: &Packed) -> Vec<Read> {
    let mut all = Vec::new();
    for (b, block) in packed.blocks.iter().enumerate() {
        let mut bytes = Vec::new();
        flate2::read::DeflateDecoder::new(&block[..]).read_to_end(&mut bytes).unwrap();
        let n = (packed.count - b * BLOCK).min(BLOCK);
        let rest = 3 * ((packed.sh_degree as usize + 1).pow(2) - 1);
        let boxes = 24 * n.div_ceil(CHUNK);
        let size = boxes + n * (20 + rest + if packed.materials { 12 } else { 0 });
        assert_eq!(bytes.len(), size);
        let float =
            |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
        let byte = |first: usize, stride: usize, i: usize, j: usize| {
            assert!(j < stride);
            u32::from(bytes[boxes + first * n + j * n + i])
        };
        let word = |first: usize, stride: usize, i: usize, w: usize| {
            (0..4).map(|j| byte(first, stride, i, 4 * w + j) << (8 * j)).sum::<u32>()
        };
        for i in 0..n {
            let g: Vec<u32> = (0..4).map(|w| word(0, 16, i, w)).collect();
            let share = [g[0] & 0xffff, g[0] >> 16, g[1] & 0xffff];
            let chunk = 24 * (i / CHUNK);
            let mean = [0, 1, 2].map(|k| {
                float(chunk + 4 * k) + f64::from(share[k]) / 65535.0 * float(chunk + 12 + 4 * k)
            });
            let [low, high] = packed.log_scale_range.map(f64::from);
            let log_scales = [g[1] >> 16 & 4095, g[2] & 4095, g[2] >> 12 & 4095]
                .map(|s| low + f64::from(s) / 4095.0 * (high - low));
            let opacity = f64::from((g[2] >> 24 << 4) | g[1] >> 28) / 4095.0;
            let three: Vec<f64> = (0..3)
                .map(|k| (f64::from(g[3] >> (10 * k) & 1023) / 1023.0 - 0.5) * 2f64.sqrt())
                .collect();
            let largest = (1.0 - three.iter().map(|v| v * v).sum::<f64>()).max(0.0).sqrt();
            let mut rotation = three.clone();
            rotation.insert((g[3] >> 30) as usize, largest);
            let dc = word(16, 4, i, 0);
            let dc = [(dc & 2047, 2047.0), (dc >> 11 & 2047, 2047.0), (dc >> 22, 1023.0)];
            let mut sh: Vec<f64> = (0..3)
                .map(|c| {
                    f64::from(packed.dc_low[c])
                        + f64::from(dc[c].0) / dc[c].1 * f64::from(packed.dc_extent[c])
                })
                .collect();
            sh.extend((0..rest).map(|at| {
                let band = match at / 3 + 1 {
                    1..4 => 0,
                    4..9 => 1,
                    _ => 2,
                };
                let q = (f64::from(byte(20, rest, i, at)) - 128.0) / 127.0;
                q.signum() * q * q * f64::from(packed.sh_range[band])
            }));
            let material = packed.materials.then(|| [0, 1, 2].map(|w| word(20 + rest, 12, i, w)));
            all.push(Read {
                mean,
                log_scales,
                opacity,
                rotation: rotation.try_into().unwrap(),
                sh,
                material,
            });
        }
    }
    all
}

/// The row of `gaussians` that is nearest to a packed one.
fn nearest(gaussians: &Gaussians, mean: [f64; 3]) -> usize {
    let distance2 = |i: usize| -> f64 {
        (0..3).map(|k| (f64::from(gaussians.means[i][k]) - mean[k]).powi(2)).sum()
    };
    (0..gaussians.len()).min_by(|a, b| distance2(*a).total_cmp(&distance2(*b))).unwrap()
}

#[test]
fn what_the_shaders_read_is_the_gaussian_within_its_steps() {
    for degree in 0..=3u8 {
        let gaussians = random_gaussians(5, 700, degree);
        let packed = pack(&gaussians, &FINEST);
        assert_eq!((packed.count, packed.dropped, packed.sh_degree), (700, 0, degree));
        for read in read(&packed) {
            let i = nearest(&gaussians, read.mean);
            for k in 0..3 {
                assert!((read.mean[k] - f64::from(gaussians.means[i][k])).abs() < 1e-4);
                assert!((read.log_scales[k] - f64::from(gaussians.log_scales[i][k])).abs() < 3e-3);
            }
            let opacity = f64::from(sigmoid(gaussians.opacity_logits[i]));
            assert!((read.opacity - opacity).abs() < 2e-4);
            let q = gaussians.rotations[i].map(f64::from);
            let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
            let cosine: f64 = q.iter().zip(read.rotation).map(|(a, b)| a / norm * b).sum();
            assert!(cosine.abs() > 1.0 - 5e-6, "{cosine}");
            for (a, b) in read.sh.iter().zip(gaussians.sh_of(i)) {
                assert!((a - f64::from(*b)).abs() * SH_C0 < 0.01, "{a} {b}");
            }
        }
    }
}

#[test]
fn materials_and_objects_come_along() {
    let mut gaussians = random_gaussians(2, 300, 1);
    let n = gaussians.len();
    let materials = Materials {
        normals: (0..n)
            .map(|i| {
                glam::Vec3::new((i as f32).sin(), (i as f32).cos(), 0.3 - i as f32 % 2.0)
                    .normalize()
                    .to_array()
            })
            .collect(),
        base_color_linear: (0..n).map(|i| [i as f32 / n as f32, 0.25, 1.0]).collect(),
        roughness: vec![0.4; n],
        metallic: vec![1.0; n],
        visibility: vec![0.6; n],
        observations: vec![1; n],
    };
    materials.attach(&mut gaussians);
    let ids = (0..n as u32).collect();
    gaussians.extra.push(ExtraColumn { name: "object_id".into(), values: ColumnValues::U32(ids) });
    let packed = pack(&gaussians, &FINEST);
    assert!(packed.materials && packed.objects);
    for read in read(&packed) {
        let [normal, color, rest] = read.material.unwrap();
        let i = (rest >> 16) as usize;
        assert_eq!(i, nearest(&gaussians, read.mean));
        let e = [normal & 0xffff, normal >> 16].map(|v| v as f32 / 65535.0 * 2.0 - 1.0);
        let mut v = glam::Vec3::new(e[0], e[1], 1.0 - e[0].abs() - e[1].abs());
        if v.z < 0.0 {
            let (x, y) = (v.x, v.y);
            v.x = (1.0 - y.abs()) * if x < 0.0 { -1.0 } else { 1.0 };
            v.y = (1.0 - x.abs()) * if y < 0.0 { -1.0 } else { 1.0 };
        }
        assert!(v.normalize().distance(materials.normals[i].into()) < 1e-4);
        assert_eq!(color >> 24, 102);
        assert_eq!(color >> 16 & 255, 255);
        assert_eq!(color >> 8 & 255, 137); // 0.25 encoded is 0.5371
        assert_eq!((rest & 255, rest >> 8 & 255), (255, 153));
    }
}

#[test]
fn what_no_renderer_shows_is_left_out() {
    let mut gaussians = random_gaussians(1, 20, 3);
    gaussians.means[3][1] = f32::NAN;
    gaussians.opacity_logits[4] = -9.0;
    gaussians.sh[5 * 48 + 7] = f32::INFINITY;
    gaussians.log_scales[6][0] = f32::NEG_INFINITY;
    gaussians.opacity_logits[7] = f32::INFINITY;
    let packed = pack(&gaussians, &FINEST);
    assert_eq!((packed.count, packed.dropped), (17, 3));
    assert!(packed.log_scale_range.iter().all(|v| v.is_finite()));
    assert!(read(&packed).iter().all(|r| r.log_scales.iter().all(|s| s.is_finite())));
}

#[test]
fn the_fourth_band_is_left_out_and_fewer_bits_make_it_smaller() {
    let gaussians = random_gaussians(1, 2000, 4);
    let sizes: Vec<usize> = [8, 5, 3]
        .map(|html_sh_bits| {
            let packed = pack(&gaussians, &PackOptions { html_sh_bits });
            assert_eq!(packed.sh_degree, 3);
            packed.blocks.iter().map(Vec::len).sum()
        })
        .into();
    assert!(sizes[1] * 10 < sizes[0] * 9 && sizes[2] * 10 < sizes[1] * 9, "{sizes:?}");
}

fn page(gaussians: &Gaussians, title: &str) -> (String, super::HtmlSummary) {
    let page = ViewerPage {
        title: title.into(),
        splat: ViewerSplat { gaussians, antialias: Antialias::Classic },
        other: None,
        photos: Vec::new(),
        lights: Vec::new(),
        up_in_world: glam::DVec3::Z,
        background: [0.0; 3],
    };
    let mut bytes = Vec::new();
    let summary = page.write(&FINEST, &mut bytes).unwrap();
    (String::from_utf8(bytes).unwrap(), summary)
}

#[test]
fn a_page_is_whole_and_asks_for_nothing_else() {
    let (text, summary) = page(&random_gaussians(1, 50, 2), "a </script><b>\"& page");
    assert!(!text.contains("{{") && !text.contains("}}\n</script><b>"));
    assert!(text.contains("a &lt;/script&gt;&lt;b&gt;"));
    for outside in ["http:", "https:", "src=", "import ", "fetch(", "XMLHttpRequest"] {
        assert!(!text.contains(outside), "the page contains {outside}");
    }
    assert_eq!(summary.splats[0].gaussians, 50);
    let block = text.split(r#"id="splat-0-0">"#).nth(1).unwrap().split('<').next().unwrap();
    assert!(base64::engine::general_purpose::STANDARD.decode(block).is_ok());
}

#[test]
fn a_page_without_gaussians_is_a_page() {
    let (text, summary) = page(&Gaussians::empty(3), "nothing");
    assert!(text.ends_with("</html>\n") && summary.splats[0].gaussians == 0);
    assert!(!text.contains("NaN") || !text.contains("\"center\":[NaN"), "numbers stay numbers");
    let manifest = text.split(r#"id="manifest">"#).nth(1).unwrap().split("</script>").next();
    let manifest: serde_json::Value = serde_json::from_str(manifest.unwrap()).unwrap();
    assert!(manifest["start"]["eye"].as_array().unwrap().iter().all(serde_json::Value::is_f64));
}
