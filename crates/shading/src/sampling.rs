//! Points that fill the unit cube evenly, the same for the same (seed, pixel, purpose).
//!
//! Sobol' points with hashed Owen scrambling (Burley, "Practical Hash-based Owen Scrambling",
//! JCGT 2020, after Laine & Karras 2011). Three dimensions are padded from a pair and a single
//! one, each with its own scramble and its own order of points. Counts that are powers of two
//! are stratified best; any count is unbiased.

/// Keyed source of points: the same numbers on every machine, in any order of calls.
#[derive(Clone, Copy, Debug)]
pub struct PointSet {
    key: u32,
    bits: u32,
}

impl PointSet {
    /// The points of `purpose` (say, light or BRDF) at `item` (say, a pixel), of which `count`
    /// will be asked for.
    #[inline]
    pub fn new(seed: u64, item: u64, purpose: u32, count: u32) -> Self {
        let word = |w: u64| mix((w as u32) ^ mix((w >> 32) as u32));
        let key = mix(word(seed) ^ mix(word(item) ^ mix(purpose)));
        Self { key, bits: count.max(1).next_power_of_two().trailing_zeros() }
    }

    /// Point `index`, each coordinate a fraction of 2³².
    #[inline]
    pub fn point(&self, index: u32) -> [u32; 3] {
        let (a, b) = (self.shuffled(index, 1), self.shuffled(index, 2));
        [
            scramble(b.reverse_bits(), mix(self.key ^ 3)),
            scramble(a.reverse_bits(), mix(self.key ^ 4)),
            scramble(second_dimension(a), mix(self.key ^ 5)),
        ]
    }

    /// `index` in the keyed order of the block of `2^bits` points.
    #[inline]
    fn shuffled(&self, index: u32, salt: u32) -> u32 {
        if self.bits == 0 {
            return index;
        }
        let (block, within) = (index >> self.bits, index << (32 - self.bits));
        let within = scramble(within, mix(self.key ^ salt)) >> (32 - self.bits);
        (block << self.bits) | within
    }
}

/// A number in [0, 1) with 24 bits.
#[inline]
pub fn unit_f32(u: u32) -> f32 {
    (u >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A number in [0, 1) with 32 bits.
#[inline]
pub fn unit_f64(u: u32) -> f64 {
    f64::from(u) * (1.0 / 4_294_967_296.0)
}

/// Second Sobol' dimension of `index`: the binary Pascal matrix, one column per step.
#[inline]
fn second_dimension(mut index: u32) -> u32 {
    let (mut result, mut column) = (0, 1u32 << 31);
    while index != 0 {
        if index & 1 != 0 {
            result ^= column;
        }
        index >>= 1;
        column ^= column >> 1;
    }
    result
}

/// Owen scrambling by a hash in which every bit depends on those above it only.
#[inline]
fn scramble(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits().wrapping_add(seed);
    x ^= x.wrapping_mul(0x6c50_b47c);
    x ^= x.wrapping_mul(0xb82f_1e52);
    x ^= x.wrapping_mul(0xc7af_e638);
    x ^= x.wrapping_mul(0x8d22_f6e6);
    x.reverse_bits()
}

/// A 32-bit finalizer with full avalanche (Mueller's, as in public collections of hashes).
#[inline]
fn mix(mut x: u32) -> u32 {
    x = x.wrapping_add(0x9e37_79b9);
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_elementary_interval_of_a_block_holds_one_point() {
        let points = PointSet::new(7, 99, 1, 64);
        for shift in 0..=6 {
            let mut hits = [0; 64];
            for i in 0..64 {
                let p = points.point(i);
                let x = (u64::from(p[1]) << shift) >> 32;
                let y = (u64::from(p[2]) << (6 - shift)) >> 32;
                hits[((x << (6 - shift)) | y) as usize] += 1;
            }
            assert!(hits.iter().all(|&n| n == 1), "shift {shift}");
        }
        let mut rows = [0; 64];
        (0..64).for_each(|i| rows[(points.point(i)[0] >> 26) as usize] += 1);
        assert!(rows.iter().all(|&n| n == 1));
    }

    #[test]
    fn a_point_of_all_keys_together_is_uniform_and_its_coordinates_independent() {
        // 16 bins per pair of coordinates: 15 degrees of freedom, 0.1 % point 37.7.
        let mut counts = [[0u32; 16]; 3];
        for item in 0..32_768 {
            let p = PointSet::new(1, item, 0, 16).point(5);
            for (pair, (a, b)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
                counts[pair][((p[a] >> 30 << 2) | (p[b] >> 30)) as usize] += 1;
            }
        }
        for pair in counts {
            let chi2: f64 = pair.iter().map(|&n| (f64::from(n) - 2048.0).powi(2) / 2048.0).sum();
            assert!(chi2 < 37.7, "chi-square {chi2}");
        }
    }
}
