//! Does a sampler draw from the density that it claims?

/// How far observed counts are from expected ones, in standard deviations of a normal variable.
///
/// Pearson's sum over bins; neighboring bins are pooled until 10 samples are expected in each;
/// the sum is turned into a z-score by Wilson and Hilferty (1931). Above 4, a correct sampler is
/// seen once in 30000 tests.
///
/// # Panics
/// When the slices differ in length, or a bin that expects nothing was hit.
pub fn chi_square_z(observed: &[u64], expected: &[f64]) -> f64 {
    assert_eq!(observed.len(), expected.len(), "bins");
    let (mut sum, mut bins) = (0.0, 0u32);
    let (mut seen, mut due) = (0.0, 0.0);
    for (&o, &e) in observed.iter().zip(expected) {
        assert!(o == 0 || e > 0.0, "{o} samples where the density is 0");
        seen += o as f64;
        due += e;
        if due >= 10.0 {
            sum += (seen - due) * (seen - due) / due;
            bins += 1;
            (seen, due) = (0.0, 0.0);
        }
    }
    if due > 0.0 {
        sum += (seen - due) * (seen - due) / due.max(10.0);
    }
    let k = f64::from(bins.max(2) - 1);
    let spread = 2.0 / (9.0 * k);
    ((sum / k).cbrt() - (1.0 - spread)) / spread.sqrt()
}

#[cfg(test)]
mod tests {
    use super::chi_square_z;

    #[test]
    fn equal_counts_pass_and_skewed_ones_fail() {
        let expected = [1000.0; 20];
        let fair: Vec<u64> =
            (0..20).map(|i| 1000 + [25, 0, 0, 0][i % 4] - [0, 31, 0, 0][i % 4]).collect();
        assert!(chi_square_z(&fair, &expected).abs() < 4.0);
        let skewed: Vec<u64> = (0..20).map(|i| 900 + 10 * i).collect();
        assert!(chi_square_z(&skewed, &expected) > 4.0);
    }
}
