//! Sorting 64-bit keys by their upper half.

/// Sorts by the upper 32 bits, stable; the lower ones must ascend already, so that the result is
/// the sorted sequence of the whole keys. `spare` is scratch memory.
///
/// Radix sort, least significant digit first, over the bits in which the keys differ at all:
/// depths of one view share their leading bits.
pub(crate) fn sort_by_high_word(keys: &mut Vec<u64>, spare: &mut Vec<u64>) {
    if keys.len() < 128 {
        keys.sort_unstable();
        return;
    }
    let (low, high) = keys.iter().fold((u32::MAX, 0), |(low, high), &key| {
        let word = (key >> 32) as u32;
        (low.min(word), high.max(word))
    });
    let bits = 32 - (high - low).leading_zeros();
    if bits == 0 {
        return;
    }
    let passes = bits.div_ceil(if keys.len() < 4096 { 8 } else { 11 });
    let digit_bits = bits.div_ceil(passes);
    let mask = (1usize << digit_bits) - 1;
    spare.clear();
    spare.resize(keys.len(), 0);
    for pass in 0..passes {
        let shift = pass * digit_bits;
        let digit = |key: u64| ((((key >> 32) as u32 - low) >> shift) as usize) & mask;
        let mut start = [0u32; 1 << 11];
        for &key in keys.iter() {
            start[digit(key)] += 1;
        }
        let mut sum = 0;
        for slot in &mut start[..=mask] {
            sum += std::mem::replace(slot, sum);
        }
        for &key in keys.iter() {
            let slot = &mut start[digit(key)];
            spare[*slot as usize] = key;
            *slot += 1;
        }
        std::mem::swap(keys, spare);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radix_sort_agrees_with_a_comparison_sort() {
        let mut state = 1u64;
        for (count, distinct, step) in
            [(5000u64, 300, 7_654_321), (400, 90, 1), (200, 1, 5), (9000, 1 << 24, 255), (3, 3, 1)]
        {
            let mut keys: Vec<u64> = (0..count)
                .map(|i| {
                    state =
                        state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                    // Few distinct depths, so that ties occur.
                    (((state >> 33) % distinct * step) << 32) | i
                })
                .collect();
            let mut expected = keys.clone();
            expected.sort_unstable();
            sort_by_high_word(&mut keys, &mut Vec::new());
            assert_eq!(keys, expected);
        }
    }
}
