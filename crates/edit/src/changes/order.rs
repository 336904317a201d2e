//! Order of the Gaussians in the file.

use glam::DVec3;

use crate::EditState;

/// Bits per axis of the Z curve.
const BITS: u32 = 21;

/// Sorts along a Z curve (Morton 1966) through the box of the centers; ties keep their order.
/// Gaussians without a finite center come last.
pub fn morton_order(state: &mut EditState) {
    let codes = morton_codes(&state.gaussians.means);
    let mut rows: Vec<u32> = (0..state.len() as u32).collect();
    rows.sort_by_key(|row| codes[*row as usize]);
    state.gather(&rows);
}

/// Place of every center on the Z curve through their box.
pub(crate) fn morton_codes(means: &[[f32; 3]]) -> Vec<u64> {
    let point = |m: &[f32; 3]| DVec3::from_array(m.map(f64::from));
    let finite = means.iter().map(point).filter(|p| p.is_finite());
    let (low, high) =
        finite.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let side = (high - low).max_element();
    let cells = f64::from((1u32 << BITS) - 1);
    let scale = if side > 0.0 { cells / side } else { 0.0 };
    let code = |m: &[f32; 3]| {
        let p = point(m);
        if !p.is_finite() {
            return u64::MAX;
        }
        let [x, y, z] = ((p - low) * scale).to_array().map(|v| spread(v as u64));
        x | y << 1 | z << 2
    };
    means.iter().map(code).collect()
}

/// Two zero bits between the bits of a number.
fn spread(mut v: u64) -> u64 {
    v &= 0x1f_ffff;
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        v = (v | v << shift) & mask;
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread() {
        assert_eq!(spread(0b1011), 0b1_000_001_001);
        assert_eq!(spread(0x1f_ffff).count_ones(), 21);
    }

    #[test]
    fn neighbors_in_the_file_are_neighbors_in_space() {
        let mut gaussians = motes_testkit::random_gaussians(3, 2000, 0);
        gaussians.means[7] = [f32::NAN; 3];
        let mut state = EditState::new("t", gaussians, None, None, DVec3::Z);
        let steps = |state: &EditState| {
            let point = |i: usize| DVec3::from_array(state.gaussians.means[i].map(f64::from));
            (1..1999)
                .map(|i| point(i).distance(point(i - 1)))
                .filter(|d| d.is_finite())
                .sum::<f64>()
        };
        let before = steps(&state);
        morton_order(&mut state);
        assert!(steps(&state) < 0.35 * before, "{} {before}", steps(&state));
        assert_eq!(state.origins[1999].row, 7);
        let once = state.gaussians.means[..1999].to_vec();
        morton_order(&mut state);
        assert_eq!(state.gaussians.means[..1999], once);
    }
}
