//! What the real networks cost, with random weights: `cargo test --release -p provider-diffusion --test cost -- --ignored --nocapture`.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "it prints a measurement")]

mod common;

use candle_core::{DType, Device, Tensor};
use common::document;
use provider_diffusion::network::{Autoencoder, AutoencoderConfig, UNet, UNetConfig};
use provider_diffusion::weights::Source;

/// CPU seconds of this process so far, where `/proc` tells.
fn cpu_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = text.rsplit(')').next().unwrap_or_default().split(' ').collect();
    let ticks = |k: usize| fields.get(k).and_then(|v| v.parse::<f64>().ok()).unwrap_or(f64::NAN);
    (ticks(12) + ticks(13)) / 100.0
}

fn peak_gb() -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or_default();
    line.trim().trim_end_matches(" kB").parse::<f64>().unwrap_or(f64::NAN) / 1e6
}

fn timed<T>(what: &str, work: impl FnOnce() -> T) -> T {
    let (before, began) = (cpu_seconds(), std::time::Instant::now());
    let made = work();
    let (spent, wall) = (cpu_seconds() - before, began.elapsed().as_secs_f64());
    println!("{what}: {spent:.1} CPU s, {wall:.1} s, peak {:.1} GB so far", peak_gb());
    made
}

#[test]
#[ignore = "a measurement of minutes, 5 GB"]
fn cost_of_an_evaluation() {
    let layouts = document("layouts.json");
    let source = Source::random(1, &Device::Cpu, DType::F32);
    let zeros =
        |shape: (usize, usize, usize, usize)| Tensor::zeros(shape, DType::F32, &Device::Cpu);
    let config: AutoencoderConfig =
        serde_json::from_value(layouts["vae"]["config"].clone()).unwrap();
    let network = Autoencoder::new(&source.root(), &config).unwrap();
    timed("autoencoder, encoding 512", || {
        network.encode(&zeros((1, 3, 512, 512)).unwrap()).unwrap()
    });
    timed("autoencoder, decoding 512", || network.decode(&zeros((1, 4, 64, 64)).unwrap()).unwrap());
    let config: UNetConfig = serde_json::from_value(layouts["unet-8"]["config"].clone()).unwrap();
    let network = timed("random weights", || UNet::new(&source.root(), &config).unwrap());
    let text = Tensor::zeros((1, 77, 768), DType::F32, &Device::Cpu).unwrap();
    for side in [32, 64, 64] {
        let seen = zeros((1, 8, side, side)).unwrap();
        let what = format!("UNet, {0} x {0} pixels", 8 * side);
        timed(&what, || network.forward(&seen, 500.0, &text, 1).unwrap());
    }
}
