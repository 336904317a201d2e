//! `.splat`: 32 bytes per Gaussian without a header, as antimatter15's viewer reads them.
//!
//! Position 3 x f32, scale 3 x f32 (linear), color and opacity 4 x u8, rotation 4 x u8 `w, x, y,
//! z` as `128 + 128 q`. No harmonics beyond degree 0. Rows are sorted by size times opacity, the
//! most visible first, so that a viewer shows a partial download well.

use std::io::Write;
use std::path::Path;

use motes_scene::Gaussians;
use rayon::prelude::*;

use super::bytes::f32_at;
use super::options::SplatWriteOptions;
use super::quantize::{color_byte, dc_of_color, logit_of_byte, sigmoid, unit, unorm8};
use super::registry::{Codec, Input};
use super::rows::{with_room, write_blocks};
use motes_formats::atomic::write_error;
use motes_formats::error::{FormatError, Result};
use motes_formats::ply::GaussianFile;

pub(super) static CODEC: Codec = Codec {
    name: "splat",
    about: "antimatter15 .splat",
    suffixes: &[".splat"],
    max_sh_degree: 0,
    loses: "quantized; harmonics; other columns; the order of rows",
    read: Input::Bytes(read),
    write: Some(write),
    ..Codec::DEFAULT
};

const ROW_BYTES: usize = 32;

fn read(data: &[u8], path: &Path) -> Result<GaussianFile> {
    if data.is_empty() || !data.len().is_multiple_of(ROW_BYTES) {
        let cause = format!(
            "a .splat file has {ROW_BYTES} bytes per Gaussian, this one has {}",
            data.len()
        );
        return Err(FormatError::invalid(path, "", cause)
            .with_remedy("the file is incomplete or of another format: copy or export it again"));
    }
    let mut gaussians = with_room(data.len() / ROW_BYTES, 0);
    for (i, row) in data.chunks_exact(ROW_BYTES).enumerate() {
        let scales = [12, 16, 20].map(|at| f32_at(row, at));
        // Garbage is noticed here: nothing else in this format can be wrong.
        if !scales.iter().all(|s| *s >= 0.0) {
            let cause = format!("the scale of Gaussian {i} is {scales:?}");
            return Err(FormatError::invalid(path, format!("byte {}", i * ROW_BYTES), cause)
                .with_remedy("this is not a .splat file, or it was damaged"));
        }
        gaussians.means.push([0, 4, 8].map(|at| f32_at(row, at)));
        gaussians.log_scales.push(scales.map(f32::ln));
        gaussians.sh.extend([24, 25, 26].map(|at| dc_of_color(f32::from(row[at]) / 255.0)));
        gaussians.opacity_logits.push(logit_of_byte(row[27]));
        let rotation = [28, 29, 30, 31].map(|at| (f32::from(row[at]) - 128.0) / 128.0);
        gaussians.rotations.push(unit(rotation));
    }
    Ok(GaussianFile::new(gaussians, Vec::new()))
}

fn write(
    writer: &mut dyn Write,
    gaussians: &Gaussians,
    _: &SplatWriteOptions,
    path: &Path,
) -> Result<()> {
    let order = by_visibility(gaussians);
    let encode = |rows: std::ops::Range<usize>, bytes: &mut Vec<u8>| {
        for &row in &order[rows] {
            let i = row as usize;
            for value in gaussians.means[i].into_iter().chain(gaussians.log_scales[i].map(f32::exp))
            {
                bytes.extend(value.to_le_bytes());
            }
            let dc = gaussians.sh_of(i);
            bytes.extend([color_byte(dc[0]), color_byte(dc[1]), color_byte(dc[2])]);
            bytes.push(unorm8(sigmoid(gaussians.opacity_logits[i])));
            let rotation = unit(gaussians.rotations[i]);
            bytes.extend(rotation.map(|q| (q * 128.0 + 128.0).round() as u8));
        }
    };
    write_blocks(writer, gaussians.len(), encode).map_err(|error| write_error(path, error))
}

/// Row numbers by falling volume times opacity; equal ones keep their order.
fn by_visibility(gaussians: &Gaussians) -> Vec<u32> {
    let mut keys: Vec<(f32, u32)> = (0..gaussians.len())
        .into_par_iter()
        .map(|i| {
            let size: f32 = gaussians.log_scales[i].iter().sum();
            (size.exp() * sigmoid(gaussians.opacity_logits[i]), i as u32)
        })
        .collect();
    keys.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    keys.into_iter().map(|(_, row)| row).collect()
}
