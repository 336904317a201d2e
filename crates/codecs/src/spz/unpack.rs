//! The bytes of spz to Gaussians.

use half::f16;
use motes_scene::Gaussians;

use super::super::axes::Flip;
use super::super::bytes::{u16_at, u32_at};
use super::super::quantize::{from_smallest_three, logit_of_byte};
use super::super::rows::with_room;
use super::{COLOR_SCALE, Packed, stride};

pub(super) fn unpack(packed: &Packed) -> Gaussians {
    let [positions, opacities, colors, scales, rotations, harmonics] = &packed.streams;
    let strides = stride(packed.version, packed.sh_degree);
    let mut gaussians = with_room(packed.rows, packed.sh_degree);
    let scale = (1u32 << packed.fractional_bits) as f32;
    gaussians.means.extend(positions.chunks_exact(strides[0]).map(|row| {
        let value = |axis: usize| match packed.version {
            1 => f16::from_bits(u16_at(row, 2 * axis)).to_f32(),
            _ => {
                let at = 3 * axis;
                // The shift right extends the sign.
                let fixed = i32::from_le_bytes([0, row[at], row[at + 1], row[at + 2]]) >> 8;
                fixed as f32 / scale
            }
        };
        Flip::ABOUT_X.point([value(0), value(1), value(2)])
    }));
    gaussians.opacity_logits.extend(opacities.iter().map(|byte| logit_of_byte(*byte)));
    let log_scale = |byte: u8| f32::from(byte) / 16.0 - 10.0;
    gaussians.log_scales.extend(scales.chunks_exact(3).map(|s| [s[0], s[1], s[2]].map(log_scale)));
    gaussians.rotations.extend(rotations.chunks_exact(strides[4]).map(|row| {
        let rotation = if packed.version < 3 { first_three(row) } else { smallest_three(row) };
        Flip::ABOUT_X.rotation(rotation)
    }));
    for i in 0..packed.rows {
        let dc = &colors[3 * i..3 * i + 3];
        gaussians.sh.extend(dc.iter().map(|c| (f32::from(*c) / 255.0 - 0.5) / COLOR_SCALE));
        let rest = &harmonics[i * strides[5]..(i + 1) * strides[5]];
        for (k, rgb) in rest.chunks_exact(3).enumerate() {
            let sign = Flip::ABOUT_X.sh_sign(k + 1);
            gaussians.sh.extend(rgb.iter().map(|byte| sign * (f32::from(*byte) - 128.0) / 128.0));
        }
    }
    gaussians
}

fn first_three(row: &[u8]) -> [f32; 4] {
    let [x, y, z] = [row[0], row[1], row[2]].map(|byte| f32::from(byte) / 127.5 - 1.0);
    [(1.0 - x * x - y * y - z * z).max(0.0).sqrt(), x, y, z]
}

fn smallest_three(row: &[u8]) -> [f32; 4] {
    let packed = u32_at(row, 0);
    let others = [20, 10, 0].map(|shift| {
        let value = packed >> shift;
        let magnitude = (value & 511) as f32 / 511.0 * std::f32::consts::FRAC_1_SQRT_2;
        if value & 512 == 0 { magnitude } else { -magnitude }
    });
    let [x, y, z, w] = from_smallest_three((packed >> 30) as usize, others);
    [w, x, y, z]
}
