//! How fast Gaussians are written and read: `cargo run --release -p motes-formats --example
//! ply_speed -- 1000000`. The file is in the page cache when it is read.

use std::io::{self, Write as _};
use std::time::Instant;

use motes_formats::ply::{PlyWriteOptions, read_gaussians, write_gaussians};
use motes_scene::Gaussians;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let n: usize = std::env::args().nth(1).map_or(Ok(1_000_000), |text| text.parse())?;
    let gaussians = Gaussians {
        means: vec![[1.0, 2.0, 3.0]; n],
        rotations: vec![[1.0, 0.0, 0.0, 0.0]; n],
        log_scales: vec![[-3.0; 3]; n],
        opacity_logits: vec![0.5; n],
        sh_degree: 3,
        sh: (0..48 * n).map(|i| (i % 1000) as f32).collect(),
        extra: Vec::new(),
    };
    let path = std::env::temp_dir().join(format!("motes-ply-speed-{}.ply", std::process::id()));
    let started = Instant::now();
    write_gaussians(&path, &gaussians, &PlyWriteOptions::default())?;
    let written = started.elapsed();
    drop(gaussians);
    let started = Instant::now();
    let read = read_gaussians(&path)?;
    let elapsed = started.elapsed();
    std::fs::remove_file(&path)?;
    let (w, r, n) = (written.as_secs_f64(), elapsed.as_secs_f64(), read.len());
    writeln!(io::stdout(), "{n} Gaussians of degree 3: written in {w:.2} s, read in {r:.2} s")?;
    Ok(())
}
