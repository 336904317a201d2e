//! Micro-benchmarks of the rasterizer beside the measured floor of this machine.
//!
//! ```text
//! kernels                                   a made-up scene at every SIMD level
//! kernels --gaussians M.ply --capture C.json   and a model, seen from the views of a capture
//! kernels --scaling                         and cost curves by pixels and by Gaussians
//! ```
//!
//! Times are processor times of the fastest repetition, so that other work on the machine changes
//! little. The table goes to stdout, JSON to the file of `--output`.

mod clock;
mod floor;
mod measure;
mod scenes;
mod table;

use std::path::PathBuf;

use anyhow::Context as _;
use clap::Parser;
use motes_raster::{RasterParameters, SimdLevel};
use serde::Serialize;

use crate::floor::Floor;
use crate::measure::Row;
use crate::scenes::Workload;

/// Micro-benchmarks of the rasterizer beside the measured floor of this machine
#[derive(Parser, Debug)]
#[command(name = "kernels")]
struct Args {
    /// Model to draw (PLY)
    #[arg(long, value_name = "FILE", requires = "capture")]
    gaussians: Option<PathBuf>,
    /// Capture whose views are drawn
    #[arg(long, value_name = "FILE", requires = "gaussians")]
    capture: Option<PathBuf>,
    /// Use the first views only
    #[arg(long, value_name = "COUNT", default_value_t = 6)]
    views: usize,
    /// Repetitions per view; the fastest counts
    #[arg(long, value_name = "COUNT", default_value_t = 15)]
    repetitions: usize,
    /// Also every other SIMD level that this machine has
    #[arg(long)]
    all_levels: bool,
    /// Also cost curves: up to 4 million pixels, up to 2 million Gaussians
    #[arg(long)]
    scaling: bool,
    /// Threads of the rasterizer
    #[arg(long, value_name = "COUNT", default_value_t = 1)]
    threads: usize,
    /// Write the measurements as JSON
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    parameters: RasterParameters,
}

/// Everything measured.
#[derive(Debug, Serialize)]
struct Record {
    parameters: RasterParameters,
    floors: Vec<(String, Floor)>,
    rows: Vec<Row>,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads).build()?;
    let record = pool.install(|| measure_all(&args))?;
    table::print(&record);
    if let Some(path) = &args.output {
        let text = serde_json::to_string_pretty(&record)? + "\n";
        std::fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

fn measure_all(args: &Args) -> anyhow::Result<Record> {
    let mut levels = vec![args.parameters.simd];
    if args.all_levels {
        levels = vec![SimdLevel::Avx512, SimdLevel::Avx2, SimdLevel::Sse42, SimdLevel::Baseline];
        levels.retain(|level| level.level().is_some());
    }
    let mut workloads = vec![scenes::synthetic(26_000, 512, 384)];
    if let (Some(gaussians), Some(capture)) = (&args.gaussians, &args.capture) {
        workloads.push(scenes::model(gaussians, capture, args.views)?);
    }
    let mut record = Record { parameters: args.parameters, floors: Vec::new(), rows: Vec::new() };
    for &simd in &levels {
        let Some(level) = simd.level() else { continue };
        record.floors.push((format!("{simd:?}"), floor::measure(level)));
        for workload in &workloads {
            let mut parameters = args.parameters;
            parameters.simd = simd;
            record.rows.push(measure::run(workload, parameters, args.repetitions));
        }
    }
    if args.scaling {
        let curve = |workload: Workload| measure::run(&workload, args.parameters, 3);
        for size in [256, 512, 1024, 1536, 2048] {
            record.rows.push(curve(scenes::synthetic(100_000, size, size)));
        }
        for count in [20_000, 100_000, 500_000, 2_000_000] {
            record.rows.push(curve(scenes::synthetic(count, 512, 384)));
        }
    }
    Ok(record)
}
