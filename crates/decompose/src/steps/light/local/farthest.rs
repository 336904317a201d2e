//! Farthest points (Gonzalez 1985).

/// The first of these, then always the one farthest from those chosen, until each has one within a distance or there are enough; the first
/// of equals. `squared` is the square of a distance.
pub(super) fn farthest<T>(
    all: &[T],
    squared: impl Fn(&T, &T) -> f32,
    within: f32,
    most: usize,
) -> Vec<usize> {
    let mut nearest = vec![f32::INFINITY; all.len()];
    let (mut chosen, mut next) = (Vec::new(), 0);
    while chosen.len() < most {
        let Some(seed) = all.get(next) else { break };
        chosen.push(next);
        nearest.iter_mut().zip(all).for_each(|(d, one)| *d = d.min(squared(one, seed)));
        let far = nearest.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(&a.0)));
        match far {
            Some((k, d)) if *d > within * within => next = k,
            _ => break,
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_has_one_within_reach_as_far_as_there_are_enough() {
        let all: Vec<f32> = (0..11).map(|k| k as f32).collect();
        let chosen = |within, most| farthest(&all, |a, b| (a - b) * (a - b), within, most);
        assert_eq!(chosen(2.6, 100), [0, 10, 5]);
        assert_eq!(chosen(1.6, 100), [0, 10, 5, 2, 7]);
        assert_eq!(chosen(0.0, 2), [0, 10]);
        assert!(farthest(&[] as &[f32], |_, _| 0.0, 1.0, 9).is_empty());
    }
}
