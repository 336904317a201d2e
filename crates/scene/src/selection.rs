//! Which Gaussians are meant.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A set of `N` Gaussians, and how sure each answer is.
///
/// `confidence` is `[N]`, 0 to 1: the believed probability that the Gaussian belongs to the set.
/// It belongs from [`Selection::THRESHOLD`] on; NaN does not belong.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// Probability of belonging.
    pub confidence: Vec<f32>,
}

/// How a new selection changes the one that is there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Combine {
    /// The new one alone.
    #[default]
    Set,
    /// In either.
    Add,
    /// In the old one, not in the new one.
    Subtract,
    /// In both.
    Intersect,
}

impl Selection {
    /// A Gaussian belongs from here on.
    pub const THRESHOLD: f32 = 0.5;

    /// None of `n`.
    pub fn none(n: usize) -> Self {
        Self { confidence: vec![0.0; n] }
    }

    /// All of `n`.
    pub fn all(n: usize) -> Self {
        Self { confidence: vec![1.0; n] }
    }

    /// Those of `n` for which `belongs` holds.
    pub fn where_true(n: usize, belongs: impl Fn(usize) -> bool) -> Self {
        Self { confidence: (0..n).map(|i| f32::from(u8::from(belongs(i)))).collect() }
    }

    /// Number of Gaussians, selected or not.
    pub fn len(&self) -> usize {
        self.confidence.len()
    }

    /// Whether there are no Gaussians to select from.
    pub fn is_empty(&self) -> bool {
        self.confidence.is_empty()
    }

    /// Whether Gaussian `i` belongs.
    pub fn contains(&self, i: usize) -> bool {
        self.confidence[i] >= Self::THRESHOLD
    }

    /// Number of those that belong.
    pub fn count(&self) -> usize {
        (0..self.len()).filter(|&i| self.contains(i)).count()
    }

    /// Indices of those that belong, ascending.
    pub fn rows(&self) -> Vec<u32> {
        (0..self.len()).filter(|&i| self.contains(i)).map(|i| i as u32).collect()
    }

    /// Everything that did not belong.
    #[must_use]
    pub fn inverted(&self) -> Self {
        // Exactly half belongs; its complement must not, so it goes just below.
        let flip = |&c: &f32| match 1.0 - c {
            f if c == Self::THRESHOLD => f.next_down(),
            f if f.is_nan() => 1.0,
            f => f,
        };
        Self { confidence: self.confidence.iter().map(flip).collect() }
    }

    /// This one changed by `other`, as sets of independent answers: the larger, the smaller, or the
    /// complement's smaller confidence.
    ///
    /// # Panics
    /// When the numbers of Gaussians differ.
    #[must_use]
    pub fn combined(&self, how: Combine, other: &Self) -> Self {
        assert_eq!(self.len(), other.len(), "selections of the same Gaussians");
        let zip = |f: fn(f32, f32) -> f32, other: &Self| Self {
            confidence: self
                .confidence
                .iter()
                .zip(&other.confidence)
                .map(|(&a, &b)| f(a, b))
                .collect(),
        };
        match how {
            Combine::Set => other.clone(),
            Combine::Add => zip(f32::max, other),
            Combine::Subtract => zip(f32::min, &other.inverted()),
            Combine::Intersect => zip(f32::min, other),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_obey_their_laws() {
        let a = Selection { confidence: vec![1.0, 0.5, 0.4, 0.0, 0.5] };
        let b = Selection { confidence: vec![0.0, 0.5, 0.9, f32::NAN, 0.2] };
        let rows = |how| a.combined(how, &b).rows();
        assert_eq!(rows(Combine::Set), [1, 2]);
        assert_eq!(rows(Combine::Add), [0, 1, 2, 4]);
        assert_eq!(rows(Combine::Subtract), [0, 4]);
        assert_eq!(rows(Combine::Intersect), [1]);
        for s in [&a, &b] {
            let not = s.inverted();
            assert!((0..s.len()).all(|i| s.contains(i) != not.contains(i)), "{s:?} {not:?}");
        }
        assert_eq!(Selection::where_true(3, |i| i == 2).rows(), [2]);
        assert_eq!((Selection::all(2).count(), Selection::none(2).count()), (2, 0));
    }
}
