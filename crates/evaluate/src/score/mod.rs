//! How close renders are to photos: scores of one view, their means, bounds on them.

mod gate;
mod summary;
mod view_score;

pub use gate::{Gate, GateMetric, ParseGateError};
pub use summary::{ViewRow, bounded_value, mean_scores, spread};
pub use view_score::{PSNR_CAP_DB, Photo, ScoreOptions, ViewScore, score_view};

/// Mean and sample standard deviation (n - 1; 0 for one value) of the finite values.
///
/// `None` when there is none.
pub fn mean_and_deviation(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let values: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (!values.is_empty()).then(|| (mean, (squares / (n - 1.0).max(1.0)).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_deviations() {
        assert_eq!(mean_and_deviation([]), None);
        assert_eq!(mean_and_deviation([f64::NAN]), None);
        assert_eq!(mean_and_deviation([3.0]), Some((3.0, 0.0)));
        let (mean, deviation) = mean_and_deviation([1.0, 2.0, 3.0, f64::INFINITY]).unwrap();
        assert!((mean - 2.0).abs() < 1e-12 && (deviation - 1.0).abs() < 1e-12);
    }
}
