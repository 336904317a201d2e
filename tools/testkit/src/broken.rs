//! Files of Gaussians with values that are not finite, which the writers refuse to make.

use std::path::Path;

use motes_formats::ply::{PlyWriteOptions, write_gaussians};
use motes_scene::{ColumnValues, Gaussians};

/// Finite stand-ins for NaN and the infinities, and what takes their place.
const STAND_INS: [(f32, f32); 3] =
    [(1.234_567e30, f32::NAN), (2.345_678e30, f32::INFINITY), (-2.345_678e30, f32::NEG_INFINITY)];

/// Writes Gaussians as they are, broken values included.
///
/// # Panics
/// When the file cannot be written.
pub fn write_broken_gaussians(path: &Path, gaussians: &Gaussians) {
    let mut finite = gaussians.clone();
    let replace = |values: &mut [f32]| {
        for value in values.iter_mut().filter(|value| !value.is_finite()) {
            let bits = |v: f32| if v.is_nan() { f32::NAN.to_bits() } else { v.to_bits() };
            let stand_in = STAND_INS.iter().find(|(_, broken)| bits(*broken) == bits(*value));
            *value = stand_in.expect("every value that is not finite has a stand-in").0;
        }
    };
    replace(finite.means.as_flattened_mut());
    replace(finite.log_scales.as_flattened_mut());
    replace(finite.rotations.as_flattened_mut());
    replace(&mut finite.opacity_logits);
    replace(&mut finite.sh);
    for column in &mut finite.extra {
        if let ColumnValues::F32(values) = &mut column.values {
            replace(values);
        }
    }
    write_gaussians(path, &finite, &PlyWriteOptions::default()).expect("finite values");
    let mut bytes = std::fs::read(path).expect("a file that was written");
    for at in 0..bytes.len().saturating_sub(3) {
        for (stand_in, broken) in STAND_INS {
            if bytes[at..at + 4] == stand_in.to_le_bytes() {
                bytes[at..at + 4].copy_from_slice(&broken.to_le_bytes());
            }
        }
    }
    std::fs::write(path, bytes).expect("a file that was written");
}
