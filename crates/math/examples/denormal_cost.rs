//! What subnormal numbers cost Adam: the memory of a Gaussian that no view sees any more decays into
//! them. Prints nanoseconds per value; the source of the numbers in `docs/benchmarks/numerics.md`.
#![expect(clippy::print_stdout, reason = "printing is what it is for")]

use std::time::Instant;

use motes_math::adam::{AdamOptions, adam_step};

fn main() {
    const N: usize = 1 << 16;
    for (name, first, second) in [
        ("ordinary", 1e-5f32, 1e-8f32),
        ("first moment subnormal", 1e-40, 1e-8),
        ("both subnormal", 1e-40, 1e-40),
        ("zero", 0.0, 0.0),
    ] {
        let (mut values, gradients) = (vec![1.0f32; N], vec![0.0f32; N]);
        let mut best = f64::INFINITY;
        for _ in 0..200 {
            let (mut m, mut v) = (vec![first; N], vec![second; N]);
            let start = Instant::now();
            let options = AdamOptions::default();
            adam_step(&mut values, &gradients, &mut m, &mut v, &[1e-3], 1000, &options);
            best = best.min(start.elapsed().as_secs_f64());
        }
        println!("{name}: {:.3} ns", best * 1e9 / N as f64);
    }
}
