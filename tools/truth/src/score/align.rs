//! The factor that photos do not tell.

use serde::{Deserialize, Serialize};

/// What is taken out before scoring.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "lowercase")]
pub enum Align {
    /// Nothing.
    None,
    /// One factor.
    Scalar,
    /// One factor per channel.
    Channel,
}

impl Align {
    /// From strict to lenient.
    pub const ALL: [Self; 3] = [Self::None, Self::Scalar, Self::Channel];

    /// As in flags and documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Scalar => "scalar",
            Self::Channel => "channel",
        }
    }
}

/// Sums of a least-squares fit `truth ≈ factor * ours`, per channel.
#[derive(Clone, Copy, Debug, Default)]
pub struct FactorFit {
    products: [f64; 3],
    squares: [f64; 3],
}

impl FactorFit {
    /// Takes a pixel, linear.
    pub fn add(&mut self, ours: [f32; 3], truth: [f32; 3]) {
        for c in 0..3 {
            self.products[c] += f64::from(ours[c]) * f64::from(truth[c]);
            self.squares[c] += f64::from(ours[c]) * f64::from(ours[c]);
        }
    }

    /// The factor of each channel; 1 where there is nothing to fit.
    pub fn factors(&self, align: Align) -> [f64; 3] {
        let ratio = |p: f64, s: f64| if s > 0.0 && p > 0.0 { p / s } else { 1.0 };
        match align {
            Align::None => [1.0; 3],
            Align::Scalar => [ratio(self.products.iter().sum(), self.squares.iter().sum()); 3],
            Align::Channel => std::array::from_fn(|c| ratio(self.products[c], self.squares[c])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_found_and_leave_nothing_when_there_is_nothing() {
        let mut fit = FactorFit::default();
        assert_eq!(fit.factors(Align::Channel), [1.0; 3]);
        for i in 1..9 {
            let v = i as f32 / 10.0;
            fit.add([v, v * v, 0.3], [2.0 * v, 0.5 * v * v, 0.3]);
        }
        let close = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(close(fit.factors(Align::Channel), [2.0, 0.5, 1.0]));
        let scalar = fit.factors(Align::Scalar)[0];
        assert!(scalar > 0.5 && scalar < 2.0);
        assert_eq!(fit.factors(Align::None), [1.0; 3]);
    }
}
