//! Gaussians to the bytes of spz.

use motes_math::median::upper_median;
use std::path::Path;

use motes_scene::Gaussians;
use rayon::prelude::*;

use super::super::axes::Flip;
use super::super::options::SpzOptions;
use super::super::quantize::{sigmoid, unit, unorm8};
use super::{COLOR_SCALE, Packed, USUAL_FRACTIONAL_BITS, stride};
use motes_formats::error::{FormatError, Result};

/// Coordinates have 24 bits with their sign.
const MOST_FIXED: f64 = ((1 << 23) - 1) as f64;
/// The usual bits are enough when half of the Gaussians are this far from the origin.
const USUAL_SIZE: f64 = 0.25;

pub(super) fn pack(
    gaussians: &Gaussians,
    options: &SpzOptions,
    flags: u8,
    path: &Path,
) -> Result<Packed> {
    let fractional_bits = fractional_bits(gaussians, options.fractional_bits, path)?;
    let version = u32::from(options.version);
    let rows = gaussians.len();
    let strides = stride(version, gaussians.sh_degree);
    let filled = |stream: usize, fill: &(dyn Fn(usize, &mut [u8]) + Sync)| -> Vec<u8> {
        let mut bytes = vec![0; rows * strides[stream]];
        if strides[stream] > 0 {
            bytes.par_chunks_mut(strides[stream]).enumerate().for_each(|(i, row)| fill(i, row));
        }
        bytes
    };
    let scale = f64::from(1u32 << fractional_bits);
    let positions = filled(0, &|i, row| {
        let mean = Flip::ABOUT_X.point(gaussians.means[i]);
        for (value, bytes) in mean.iter().zip(row.chunks_exact_mut(3)) {
            let fixed = (f64::from(*value) * scale).round().clamp(-MOST_FIXED, MOST_FIXED) as i32;
            bytes.copy_from_slice(&fixed.to_le_bytes()[..3]);
        }
    });
    let opacities = filled(1, &|i, row| row[0] = unorm8(sigmoid(gaussians.opacity_logits[i])));
    let colors = filled(2, &|i, row| {
        for (byte, dc) in row.iter_mut().zip(gaussians.sh_of(i)) {
            *byte = unorm8(COLOR_SCALE * dc + 0.5);
        }
    });
    let scales = filled(3, &|i, row| {
        for (byte, scale) in row.iter_mut().zip(gaussians.log_scales[i]) {
            *byte = ((scale + 10.0) * 16.0).round() as u8; // saturates
        }
    });
    let rotations = filled(4, &|i, row| {
        let [w, x, y, z] = Flip::ABOUT_X.rotation(unit(gaussians.rotations[i]));
        match row.len() {
            3 => first_three([w, x, y, z], row),
            _ => row.copy_from_slice(&smallest_three([x, y, z, w]).to_le_bytes()),
        }
    });
    let harmonics = filled(5, &|i, row| {
        let rest = &gaussians.sh_of(i)[3..];
        for (k, (bytes, rgb)) in row.chunks_exact_mut(3).zip(rest.chunks_exact(3)).enumerate() {
            let bits = if k < 3 { options.sh1_bits } else { options.sh_rest_bits };
            let sign = Flip::ABOUT_X.sh_sign(k + 1);
            for (byte, value) in bytes.iter_mut().zip(rgb) {
                *byte = harmonic(sign * value, bits);
            }
        }
    });
    Ok(Packed {
        version,
        rows,
        sh_degree: gaussians.sh_degree,
        fractional_bits,
        flags,
        streams: [positions, opacities, colors, scales, rotations, harmonics],
    })
}

/// The usual 12 where they fit the unit of the scene, more in smaller scenes as far as the farthest
/// Gaussian leaves room.
fn fractional_bits(gaussians: &Gaussians, given: Option<u8>, path: &Path) -> Result<u8> {
    let mut sizes: Vec<f32> = gaussians
        .means
        .par_iter()
        .map(|m| m.iter().fold(0.0, |a: f32, v| a.max(v.abs())))
        .collect();
    let farthest = f64::from(sizes.iter().copied().fold(0.0, f32::max));
    let most = if farthest > 0.0 { (MOST_FIXED / farthest).log2().floor() } else { 23.0 };
    if most < 0.0 {
        let cause = format!("coordinates of {farthest:e} do not fit into 24 bits");
        return Err(FormatError::not_supported(path, "positions", cause).with_remedy(
            "scale the scene down, or leave out far Gaussians, or take another format",
        ));
    }
    let most = most.min(23.0) as u8;
    if let Some(bits) = given {
        if bits > most {
            let cause = format!("{bits} fractional bits leave no room for {farthest:e}, {most} do");
            return Err(FormatError::not_supported(path, "positions", cause));
        }
        return Ok(bits);
    }
    let typical = upper_median(&mut sizes, f32::total_cmp).map_or(1.0, f64::from);
    let finer = if typical < USUAL_SIZE { (-typical.log2()).ceil().min(23.0) as u8 } else { 0 };
    Ok((USUAL_FRACTIONAL_BITS + finer).min(most))
}

/// Version 2: x, y, z of the rotation with positive w.
fn first_three([w, x, y, z]: [f32; 4], row: &mut [u8]) {
    let sign = if w < 0.0 { -127.5 } else { 127.5 };
    for (byte, value) in row.iter_mut().zip([x, y, z]) {
        *byte = (value * sign + 127.5).round() as u8;
    }
}

/// Version 3: index of the largest of x, y, z, w in the top bits, the others as sign and 9 bits.
fn smallest_three(xyzw: [f32; 4]) -> u32 {
    let (largest, others) = super::super::quantize::smallest_three(xyzw);
    others.iter().fold(largest as u32, |packed, value| {
        let magnitude = (value.abs() * std::f32::consts::SQRT_2 * 511.0 + 0.5) as u32;
        packed << 10 | u32::from(*value < 0.0) << 9 | magnitude.min(511)
    })
}

/// A coefficient from -1 to 1 around 128, rounded to `bits` bits.
fn harmonic(value: f32, bits: u8) -> u8 {
    let step = 1i32 << (8 - bits);
    let byte = (value * 128.0).round() as i32; // saturates
    let byte = byte.clamp(-1 << 16, 1 << 16) + 128;
    ((byte + step / 2).div_euclid(step) * step).clamp(0, 255) as u8
}
