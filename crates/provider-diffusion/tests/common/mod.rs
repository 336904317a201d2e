//! What `scripts/providers/fixtures.py` wrote, and the numbers that a formula makes there as here.
#![allow(dead_code, reason = "each test program uses a part")]
#![allow(clippy::print_stdout, reason = "tests say the numbers that the records hold")]

use std::path::{Path, PathBuf};

use candle_core::{DType, Device, Tensor};
use motes_scene::ImageU8;
use provider_diffusion::network::{UNet, UNetConfig};
use provider_diffusion::noise::Noise;
use provider_diffusion::parts::{Parts, unet};
use provider_diffusion::weights::{Source, TensorFile};
use safetensors::tensor::{Dtype, TensorView};
use serde_json::{Value, json};

pub(crate) fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/diffusion").join(name)
}

pub(crate) fn document(name: &str) -> Value {
    serde_json::from_slice(&std::fs::read(data(name)).unwrap()).unwrap()
}

/// Numbers from -1 to 1 by a name.
pub(crate) fn values(name: &str, count: usize) -> Vec<f32> {
    let fold = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let seed = name.bytes().fold(0xcbf2_9ce4_8422_2325, fold);
    let value = |k: u64| {
        let mut z = seed.wrapping_add(k).wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (((z ^ (z >> 31)) >> 40) as f64 / f64::from(1 << 23) - 1.0) as f32
    };
    (0..count as u64).map(value).collect()
}

pub(crate) fn hashed(name: &str, shape: &[usize]) -> Tensor {
    Tensor::from_vec(values(name, shape.iter().product()), shape, &Device::Cpu).unwrap()
}

/// Draws by number.
#[derive(Default)]
pub(crate) struct Hashed(usize);

impl Noise for Hashed {
    fn values(&mut self, count: usize) -> Vec<f32> {
        self.0 += 1;
        let root = 3f64.sqrt() as f32;
        values(&format!("noise {}", self.0 - 1), count).iter().map(|v| v * root).collect()
    }
}

pub(crate) fn expected(name: &str) -> Tensor {
    let file = TensorFile::open(&data("expected.safetensors")).unwrap();
    Tensor::from_vec(file.read(name).unwrap(), file.shape(name), &Device::Cpu).unwrap()
}

pub(crate) fn flat(tensor: &Tensor) -> Vec<f32> {
    tensor.flatten_all().unwrap().to_vec1().unwrap()
}

/// Asserts the largest difference over the largest value, and says it.
pub(crate) fn assert_close(what: &str, found: &Tensor, wanted: &Tensor, allowed: f32) {
    assert_eq!(found.dims(), wanted.dims(), "{what}");
    let (found, wanted) = (flat(found), flat(wanted));
    let largest = wanted.iter().fold(0f32, |most, v| most.max(v.abs()));
    let worst = found.iter().zip(&wanted).map(|(a, b)| (a - b).abs()).fold(0f32, f32::max);
    println!("{what}: {:.1e}", worst / largest);
    assert!(worst / largest <= allowed, "{what}: {:.1e}", worst / largest);
}

/// Signal to noise of a picture, dB.
pub(crate) fn psnr(a: &ImageU8, b: &ImageU8) -> f64 {
    assert_eq!((a.width, a.height, a.channels), (b.width, b.height, b.channels));
    let square = |(a, b): (&u8, &u8)| (f64::from(*a) - f64::from(*b)).powi(2);
    let sum: f64 = a.data.iter().zip(&b.data).map(square).sum();
    20.0 * 255f64.log10() - 10.0 * (sum / a.data.len() as f64).max(1e-9).log10()
}

pub(crate) fn parts() -> Parts {
    Parts::load(&data(""), &Device::Cpu).unwrap()
}

pub(crate) fn iclight(name: &str, channels: usize) -> UNet {
    let file = data(&format!("ic-light/iclight_sd15_{name}.safetensors"));
    unet(&data(""), Some((&file, channels)), (&Device::Cpu, DType::F32)).unwrap()
}

/// `unet/config.json` of the network whose weights are hashed.
pub(crate) fn hashed_config() -> Value {
    json!({
        "in_channels": 8, "out_channels": 4, "block_out_channels": [32, 64, 96], "layers_per_block": 2,
        "attention_head_dim": 4, "cross_attention_dim": 32, "norm_num_groups": 32,
        "down_block_types": ["CrossAttnDownBlock2D", "CrossAttnDownBlock2D", "DownBlock2D"],
        "up_block_types": ["UpBlock2D", "CrossAttnUpBlock2D", "CrossAttnUpBlock2D"],
    })
}

/// A folder of InstructPix2Pix: the stored text encoder and autoencoder, and the UNet whose weights are hashed.
pub(crate) fn ip2p(folder: &Path) {
    for part in ["tokenizer", "text_encoder", "vae", "scheduler"] {
        copy(&data(part), &folder.join(part));
    }
    let config: UNetConfig = serde_json::from_value(hashed_config()).unwrap();
    let source = Source::shapes();
    UNet::new(&source.root(), &config).unwrap();
    let tensor = |(name, shape): (String, Vec<usize>)| {
        let count: usize = shape.iter().product();
        let scale = match shape.len() {
            1 => 0.1,
            _ => (3.0 / (count / shape[0]) as f64).sqrt() as f32,
        };
        let shift = if shape.len() == 1 && name.ends_with("weight") { 1.0 } else { 0.0 };
        let values: Vec<f32> = values(&name, count).iter().map(|v| shift + scale * v).collect();
        (name, shape, values)
    };
    let tensors: Vec<_> = source.asked().into_iter().map(tensor).collect();
    std::fs::create_dir_all(folder.join("unet")).unwrap();
    std::fs::write(folder.join("unet/config.json"), hashed_config().to_string()).unwrap();
    write(&folder.join("unet/diffusion_pytorch_model.safetensors"), &tensors);
}

/// Tensors of 32 bits as a file.
pub(crate) fn write(path: &Path, tensors: &[(String, Vec<usize>, Vec<f32>)]) {
    let bytes = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let all: Vec<(String, Vec<usize>, Vec<u8>)> =
        tensors.iter().map(|(n, s, v)| (n.clone(), s.clone(), bytes(v))).collect();
    let views = all
        .iter()
        .map(|(n, s, b)| (n.as_str(), TensorView::new(Dtype::F32, s.clone(), b).unwrap()));
    std::fs::write(path, safetensors::serialize(views, None).unwrap()).unwrap();
}

/// All tensors of a file.
pub(crate) fn read(path: &Path) -> Vec<(String, Vec<usize>, Vec<f32>)> {
    let file = TensorFile::open(path).unwrap();
    file.shapes().into_iter().map(|(n, s)| (n.clone(), s, file.read(&n).unwrap())).collect()
}

pub(crate) fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}

/// A folder of Stable Diffusion with all its parts.
pub(crate) fn stable_diffusion(folder: &Path) {
    for part in ["tokenizer", "text_encoder", "vae", "scheduler", "unet", "ic-light"] {
        copy(&data(part), &folder.join(part));
    }
}
