//! How the brightness of photos follows the exposure that their metadata names.

/// Gain of a photo's sRGB-encoded colors over those of the model: `exp(slope (stops - reference))`.
///
/// In encoded values a gain is nearly a gain of the light (the transfer function is close to a
/// power), so one factor serves all channels. A camera that did nothing but expose would have a
/// slope of about `ln 2 / 2.4`; automatic exposure also follows the scene, and what a
/// phone does afterwards evens photos out, so the slope is fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExposureResponse {
    /// Natural log of the gain per stop.
    pub slope_per_stop: f64,
    /// Exposure that the model's colors stand for, stops (see
    /// [`View::exposure_stops`](crate::View::exposure_stops)).
    pub reference_stops: f64,
}

/// No camera exposes more or less than one second at f/1 and ISO 100 by more stops than this.
pub const MAX_EXPOSURE_STOPS: f64 = 60.0;
/// A stop doubles the light: ln 2 in linear values, less in encoded ones.
const MAX_SLOPE: f64 = 2.0;
/// Gains stay within this factor of 1, whatever a document says.
const MAX_GAIN: f64 = 16.0;

impl ExposureResponse {
    /// Whether the numbers can be those of a camera; false for NaN.
    pub fn is_plausible(&self) -> bool {
        self.slope_per_stop.abs() <= MAX_SLOPE && self.reference_stops.abs() <= MAX_EXPOSURE_STOPS
    }

    /// Gain of a photo taken at `stops`; 1 where that is unknown. Within [1/16, 16].
    pub fn gain(&self, stops: Option<f64>) -> f32 {
        let log_gain = stops.map_or(0.0, |s| self.slope_per_stop * (s - self.reference_stops));
        if log_gain.is_nan() {
            return 1.0;
        }
        log_gain.clamp(-MAX_GAIN.ln(), MAX_GAIN.ln()).exp() as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_follow_stops_and_stay_bounded() {
        let response = ExposureResponse { slope_per_stop: 0.25, reference_stops: -7.0 };
        assert_eq!(response.gain(Some(-7.0)), 1.0);
        assert_eq!(response.gain(None), 1.0);
        assert!((response.gain(Some(-5.0)) - 0.5f32.exp()).abs() < 1e-6);
        assert!(response.gain(Some(1e9)) <= 16.001 && response.gain(Some(-1e9)) >= 0.062);
        assert_eq!(response.gain(Some(f64::NAN)), 1.0);
    }
}
