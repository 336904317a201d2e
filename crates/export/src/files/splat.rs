//! Gaussians as a file of another program.

use motes_formats::standard_stream::is_standard_stream;
use std::path::Path;

use clap::Args;
use motes_codecs::{
    PlyLayout, SogOptions, SplatFormat, SplatWriteOptions, SpzOptions, write_gaussians,
    write_gaussians_to,
};
use motes_stage::{Context, StageError};
use serde::Serialize;

use super::Source;

/// Parameters of the formats.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Splat formats")]
pub struct SplatOptions {
    /// Columns of a PLY
    #[arg(long, value_enum, value_name = "LAYOUT", default_value_t)]
    pub layout: PlyLayout,

    /// Version of an spz file; every reader supports 2 and 3
    #[arg(long, value_name = "VERSION", default_value_t = 3, value_parser = clap::value_parser!(u8).range(2..=4))]
    pub spz_version: u8,

    /// Fractional bits of a coordinate in an spz file [default: 12, more in small scenes]
    #[arg(long, value_name = "BITS", value_parser = clap::value_parser!(u8).range(0..=23),
        help_heading = "Splat compression (expert)")]
    pub spz_fractional_bits: Option<u8>,

    /// Bits of a coefficient of degree 1, and of higher degrees, in an spz file
    #[arg(long, value_name = "BITS", num_args = 2, default_values_t = [5, 4], value_parser = clap::value_parser!(u8).range(1..=8),
        help_heading = "Splat compression (expert)")]
    pub spz_sh_bits: Vec<u8>,

    /// Iterations of k-means for the codebook of spherical harmonics of a SOG file
    #[arg(
        long,
        value_name = "N",
        default_value_t = 6,
        help_heading = "Splat compression (expert)"
    )]
    pub sog_iterations: u32,

    /// Groups of the codebook searched per Gaussian
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=256),
        help_heading = "Splat compression (expert)")]
    pub sog_probes: u32,

    /// Entries of the codebook of a SOG file, at most 65536 [default: as other writers]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536),
        help_heading = "Splat compression (expert)")]
    pub sog_palette: Option<u32>,

    /// Seed of the random numbers (SOG codebook, shadow plane)
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    pub seed: u64,
}

impl SplatOptions {
    fn for_source(&self, source: &Source) -> SplatWriteOptions {
        SplatWriteOptions {
            render_mode: source.file.render_mode,
            exposure_response: source.file.exposure_response,
            comments: source.file.comments.clone(),
            layout: self.layout,
            spz: SpzOptions {
                version: self.spz_version,
                fractional_bits: self.spz_fractional_bits,
                sh1_bits: self.spz_sh_bits[0],
                sh_rest_bits: self.spz_sh_bits[1],
            },
            sog: SogOptions {
                iterations: self.sog_iterations,
                probes: self.sog_probes as usize,
                palette: self.sog_palette,
                seed: self.seed,
            },
        }
    }
}

/// Writes the Gaussians; warns of what the format cannot hold. `-` is standard output.
///
/// # Errors
/// When the file cannot be written.
pub fn write_splat(
    source: &Source,
    format: SplatFormat,
    options: &SplatOptions,
    output: &Path,
    context: &Context,
) -> anyhow::Result<()> {
    let gaussians = &source.file.gaussians;
    let codec = format.codec();
    if options.layout != PlyLayout::Motes && format != SplatFormat::Ply {
        return Err(StageError::usage("--layout belongs to the format ply").into());
    }
    if gaussians.sh_degree > codec.max_sh_degree {
        context.warn(format!(
            "the format {} holds harmonics up to degree {}; those of degree {} are left out",
            codec.name, codec.max_sh_degree, gaussians.sh_degree
        ));
    }
    if !gaussians.extra.is_empty() && !codec.keeps_extra_columns {
        let names: Vec<&str> = gaussians.extra.iter().map(|c| c.name.as_str()).take(12).collect();
        tracing::info!("the format {} has no columns {}", codec.name, names.join(", "));
    }
    let options = options.for_source(source);
    if is_standard_stream(output) {
        let mut stdout = context.stdout();
        write_gaussians_to(&mut stdout, format, gaussians, &options, output)?;
        std::io::Write::flush(&mut stdout)?;
    } else {
        write_gaussians(output, format, gaussians, &options)?;
    }
    Ok(())
}
