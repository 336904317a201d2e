//! Writing a compressed PLY.

use std::fmt::Write as _;
use std::io::Write;
use std::ops::Range;
use std::path::Path;

use motes_scene::Gaussians;
use rayon::prelude::*;

use super::super::morton::morton_order;
use super::super::options::SplatWriteOptions;
use super::super::quantize::{sigmoid, smallest_three, unit, unorm};
use super::super::rows::write_blocks;
use super::{BOUNDS, CHUNK, PACKED, SH_RANGE};
use motes_formats::atomic::write_error;
use motes_formats::error::Result;
use motes_formats::ply::SH_C0;

/// Log scales beyond this are clamped: minus infinity has no place between bounds.
const SCALE_LIMIT: f32 = 20.0;

/// Three values of three kinds per Gaussian: position, log scale, color.
type Values = [[f32; 3]; 3];

fn values_of(gaussians: &Gaussians, i: usize) -> Values {
    let dc = gaussians.sh_of(i);
    [
        gaussians.means[i],
        gaussians.log_scales[i].map(|s| s.clamp(-SCALE_LIMIT, SCALE_LIMIT)),
        std::array::from_fn(|channel| 0.5 + SH_C0 * dc[channel]),
    ]
}

/// Lowest and highest of each value in a chunk.
#[derive(Clone, Copy)]
struct Bounds {
    low: Values,
    high: Values,
}

impl Bounds {
    fn of(gaussians: &Gaussians, rows: &[u32]) -> Self {
        let mut bounds = Self { low: [[f32::INFINITY; 3]; 3], high: [[f32::NEG_INFINITY; 3]; 3] };
        for &row in rows {
            let values = values_of(gaussians, row as usize);
            for (kind, values) in values.iter().enumerate() {
                for (axis, value) in values.iter().enumerate() {
                    bounds.low[kind][axis] = bounds.low[kind][axis].min(*value);
                    bounds.high[kind][axis] = bounds.high[kind][axis].max(*value);
                }
            }
        }
        bounds
    }

    /// Where between the bounds the values are, 0 to 1.
    fn share(&self, kind: usize, values: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|axis| {
            let (low, high) = (self.low[kind][axis], self.high[kind][axis]);
            if high > low { (values[axis] - low) / (high - low) } else { 0.0 }
        })
    }
}

pub(in super::super) fn write(
    writer: &mut dyn Write,
    gaussians: &Gaussians,
    options: &SplatWriteOptions,
    path: &Path,
) -> Result<()> {
    let refused = |error| write_error(path, error);
    let order = morton_order(gaussians);
    let chunks: Vec<Bounds> =
        order.par_chunks(CHUNK).map(|rows| Bounds::of(gaussians, rows)).collect();
    writer.write_all(header(gaussians, chunks.len(), options).as_bytes()).map_err(refused)?;
    let write_bounds = |chunks_of: Range<usize>, bytes: &mut Vec<u8>| {
        for bounds in &chunks[chunks_of] {
            for kind in 0..3 {
                let values = bounds.low[kind].into_iter().chain(bounds.high[kind]);
                values.for_each(|value| bytes.extend(value.to_le_bytes()));
            }
        }
    };
    write_blocks(writer, chunks.len(), write_bounds).map_err(refused)?;
    let write_rows = |rows: Range<usize>, bytes: &mut Vec<u8>| {
        for at in rows {
            let packed = packed(gaussians, order[at] as usize, &chunks[at / CHUNK]);
            packed.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        }
    };
    write_blocks(writer, order.len(), write_rows).map_err(refused)?;
    let write_harmonics = |rows: Range<usize>, bytes: &mut Vec<u8>| {
        for &row in &order[rows] {
            let rest = &gaussians.sh_of(row as usize)[3..];
            for channel in 0..3 {
                bytes.extend(rest.chunks_exact(3).map(|rgb| coefficient_byte(rgb[channel])));
            }
        }
    };
    if gaussians.sh_degree > 0 {
        write_blocks(writer, order.len(), write_harmonics).map_err(refused)?;
    }
    Ok(())
}

fn header(gaussians: &Gaussians, chunks: usize, options: &SplatWriteOptions) -> String {
    let mut text = String::from("ply\nformat binary_little_endian 1.0\n");
    for comment in options.ply_comments() {
        let _ = writeln!(text, "comment {comment}");
    }
    let mut element = |name: &str, rows: usize, kind: &str, columns: &[String]| {
        let _ = writeln!(text, "element {name} {rows}");
        for column in columns {
            let _ = writeln!(text, "property {kind} {column}");
        }
    };
    let names = |of: &[&str]| of.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    element("chunk", chunks, "float", &names(&BOUNDS));
    element("vertex", gaussians.len(), "uint", &names(&PACKED));
    let rest = 3 * (gaussians.sh_coefficients() - 1);
    if rest > 0 {
        let columns: Vec<String> = (0..rest).map(|i| format!("f_rest_{i}")).collect();
        element("sh", gaussians.len(), "uchar", &columns);
    }
    text.push_str("end_header\n");
    text
}

fn packed(gaussians: &Gaussians, i: usize, bounds: &Bounds) -> [u32; 4] {
    let [position, scale, color] = values_of(gaussians, i);
    let as_11_10_11 = |[a, b, c]: [f32; 3]| unorm(a, 11) << 21 | unorm(b, 10) << 11 | unorm(c, 11);
    let (largest, others) = smallest_three(unit(gaussians.rotations[i]));
    let rotation = others.iter().fold(largest as u32, |packed, value| {
        packed << 10 | unorm(value * std::f32::consts::FRAC_1_SQRT_2 + 0.5, 10)
    });
    let [r, g, b] = bounds.share(2, color);
    let opacity = sigmoid(gaussians.opacity_logits[i]);
    let color = [r, g, b, opacity].iter().fold(0, |packed, value| packed << 8 | unorm(*value, 8));
    [as_11_10_11(bounds.share(0, position)), rotation, as_11_10_11(bounds.share(1, scale)), color]
}

fn coefficient_byte(value: f32) -> u8 {
    ((value / SH_RANGE + 0.5) * 256.0) as u8 // saturates
}
