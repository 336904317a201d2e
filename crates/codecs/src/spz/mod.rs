//! Niantic's `.spz`, versions 1 to 4.
//!
//! Six streams, one attribute after another: positions (24-bit fixed point), opacities, colors, log
//! scales, rotations, harmonics, all as bytes. Up to version 3 they follow a header of 16 bytes in one
//! gzip stream; version 4 has a plain header, a table and a zstd frame per stream. Axes are right,
//! up, back.

mod container;
mod pack;
mod unpack;

use std::io::Write;
use std::path::Path;

use motes_scene::Gaussians;

use super::options::SplatWriteOptions;
use super::registry::{Codec, Input};
use motes_formats::atomic::write_error;
use motes_formats::error::{FormatError, Result};
use motes_formats::ply::{GaussianFile, RenderMode};

pub(super) static CODEC: Codec = Codec {
    name: "spz",
    about: "Niantic .spz, see --spz-version",
    suffixes: &[".spz"],
    // 3 before version 4.
    max_sh_degree: 4,
    loses: "quantized; other columns; before version 4, harmonics of degree 4",
    versions: ["versions 1 to 4", "versions 2 to 4"],
    starts: |start| start.starts_with(&MAGIC.to_le_bytes()) || start.starts_with(&[0x1f, 0x8b]),
    read: Input::Bytes(read),
    write: Some(write),
    ..Codec::DEFAULT
};

/// `NGSP`.
const MAGIC: u32 = 0x5053_474e;
const FLAG_ANTIALIASED: u8 = 1;
const FLAG_EXTENSIONS: u8 = 2;
/// Bytes of `f_dc` per unit: colors beyond 0 and 1 have room.
const COLOR_SCALE: f32 = 0.15;
/// Bits after the binary point that other writers take.
const USUAL_FRACTIONAL_BITS: u8 = 12;
/// Readers shift a 32-bit one by this.
const MOST_FRACTIONAL_BITS: u8 = 30;

/// What a file holds, still packed.
struct Packed {
    version: u32,
    rows: usize,
    sh_degree: u8,
    fractional_bits: u8,
    flags: u8,
    /// Positions, opacities, colors, log scales, rotations, harmonics.
    streams: [Vec<u8>; 6],
}

/// Bytes per row of each stream.
fn stride(version: u32, sh_degree: u8) -> [usize; 6] {
    let harmonics = 3 * ((usize::from(sh_degree) + 1).pow(2) - 1);
    [if version == 1 { 6 } else { 9 }, 1, 3, 3, if version >= 3 { 4 } else { 3 }, harmonics]
}

fn read(data: &[u8], path: &Path) -> Result<GaussianFile> {
    let packed = container::read(data, path)?;
    let gaussians = unpack::unpack(&packed);
    let antialiased = packed.flags & FLAG_ANTIALIASED != 0;
    let render_mode = Some(if antialiased { RenderMode::Mip } else { RenderMode::Default });
    Ok(GaussianFile { render_mode, ..GaussianFile::new(gaussians, Vec::new()) })
}

fn write(
    writer: &mut dyn Write,
    gaussians: &Gaussians,
    options: &SplatWriteOptions,
    path: &Path,
) -> Result<()> {
    let spz = options.spz;
    let out_of_range = |what: &str| Err(FormatError::not_supported(path, "options of spz", what));
    if !(2..=4).contains(&spz.version) {
        return out_of_range("versions 2, 3 and 4 are written");
    }
    if !(1..=8).contains(&spz.sh1_bits) || !(1..=8).contains(&spz.sh_rest_bits) {
        return out_of_range("harmonics have 1 to 8 bits");
    }
    // Degree 4 came with version 4.
    let lower = (spz.version < 4 && gaussians.sh_degree > 3).then(|| gaussians.with_sh_degree(3));
    let gaussians = lower.as_ref().unwrap_or(gaussians);
    let flags = if options.render_mode == Some(RenderMode::Mip) { FLAG_ANTIALIASED } else { 0 };
    let packed = pack::pack(gaussians, &spz, flags, path)?;
    container::write(writer, &packed).map_err(|error| write_error(path, error))
}
