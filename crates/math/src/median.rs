//! The middle of values and other shares of them, by one rule everywhere.

/// The median: the value in the middle, the mean of the two in the middle of an even count. Values that are not finite are left
/// out; `None` if none is left.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
    let middle = values.len() / 2;
    let is_even = values.len().is_multiple_of(2);
    if values.is_empty() {
        return None;
    }
    let (below, upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let upper = *upper;
    let lower = below.iter().copied().max_by(f64::total_cmp).filter(|_| is_even);
    // Halves first: the sum of two large values may not be finite.
    Some(lower.map_or(upper, |lower| 0.5 * lower + 0.5 * upper))
}

/// The upper median: the value in place `n / 2` from the smallest, which is a value of the list also
/// where the count is even. Reorders; `None` if empty.
pub fn upper_median<T: Copy>(
    values: &mut [T],
    compare: impl FnMut(&T, &T) -> std::cmp::Ordering,
) -> Option<T> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, compare).1)
}

/// The median of values with weights, `(value, weight)`: the smallest at which the weights of it and of what is below
/// reach half of all. Values must be numbers and weights not negative; `None` without a weight.
pub fn weighted_median(mut values: Vec<(f32, f32)>) -> Option<f32> {
    values.retain(|(_, weight)| *weight > 0.0);
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * values.iter().map(|(_, weight)| f64::from(*weight)).sum::<f64>();
    let mut sum = 0.0;
    let reached = values.iter().find(|(_, weight)| {
        sum += f64::from(*weight);
        sum >= half
    });
    reached.map(|(value, _)| *value)
}

/// The value that a share of all (0 to 1) lies below: the one in place `share (n - 1)` from the smallest, rounded down. Reorders;
/// `None` if empty.
pub fn quantile(values: &mut [f32], share: f32) -> Option<f32> {
    let last = values.len().checked_sub(1)?;
    let at = (last as f32 * share) as usize;
    Some(*values.select_nth_unstable_by(at.min(last), f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_counted_from_the_smallest() {
        let of = |share| quantile(&mut [5.0, 1.0, 4.0, 2.0, 3.0], share);
        assert_eq!([0.0, 0.5, 0.74, 0.75, 1.0].map(of), [1.0, 3.0, 3.0, 4.0, 5.0].map(Some));
        assert_eq!([-1.0, 2.0, f32::NAN].map(of), [1.0, 5.0, 1.0].map(Some));
        assert_eq!(quantile(&mut [], 0.5), None);
    }

    #[test]
    fn the_middle_is_found_whatever_the_order() {
        assert_eq!(median([3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([3.0, 1.0, 2.0, 10.0]), Some(2.5));
        assert_eq!(median([f64::NAN, 4.0, f64::INFINITY]), Some(4.0));
        assert_eq!(median([f64::MAX, f64::MAX]), Some(f64::MAX));
        assert_eq!(median([f64::NAN]), None);
    }

    #[test]
    fn the_upper_median_is_a_value_of_the_list() {
        assert_eq!(upper_median(&mut [3.0, 1.0, 2.0, 10.0], f64::total_cmp), Some(3.0));
        assert_eq!(upper_median(&mut [3.0f32], f32::total_cmp), Some(3.0));
        assert_eq!(upper_median(&mut [], f32::total_cmp), None);
    }

    #[test]
    fn weights_count_as_repetitions() {
        let values = vec![(5.0, 1.0), (1.0, 3.0), (9.0, 1.0)];
        assert_eq!(weighted_median(values), Some(1.0));
        assert_eq!(weighted_median(vec![(2.0, 1.0), (1.0, 1.0)]), Some(1.0));
        assert_eq!(weighted_median(vec![(2.0, 0.0)]), None);
    }
}
