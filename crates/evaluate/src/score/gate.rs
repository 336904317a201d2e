//! Bounds on scores that turn a measurement into an exit code: `psnr>=25`.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

/// Which mean a [`Gate`] bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GateMetric {
    /// Mean of per-view PSNRs from 8-bit renders, dB.
    Psnr,
    /// The same before rounding, dB.
    PsnrFloat,
    /// The same after color correction, dB.
    PsnrColorCorrected,
    /// Structural similarity.
    Ssim,
    /// Perceptual distance.
    Lpips,
    /// Train PSNR minus test PSNR, dB.
    Gap,
}

const METRICS: [(&str, GateMetric); 6] = [
    ("psnr", GateMetric::Psnr),
    ("psnr_float", GateMetric::PsnrFloat),
    ("psnr_color_corrected", GateMetric::PsnrColorCorrected),
    ("ssim", GateMetric::Ssim),
    ("lpips", GateMetric::Lpips),
    ("gap", GateMetric::Gap),
];

/// `metric>=bound` or `metric<=bound`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gate {
    /// What is bounded.
    pub metric: GateMetric,
    /// Whether the bound is a lower one.
    pub at_least: bool,
    /// The bound, in the unit of the metric.
    pub bound: f64,
}

/// The text is not a gate.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "\"{0}\" is not METRIC>=NUMBER or METRIC<=NUMBER with METRIC one of psnr, psnr_float, psnr_color_corrected, ssim, lpips, gap"
)]
pub struct ParseGateError(String);

impl Gate {
    /// Whether a value meets the bound; NaN meets none.
    pub fn is_met_by(&self, value: f64) -> bool {
        if self.at_least { value >= self.bound } else { value <= self.bound }
    }
}

impl FromStr for Gate {
    type Err = ParseGateError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let error = || ParseGateError(text.to_owned());
        let (name, bound, at_least) = if let Some((name, bound)) = text.split_once(">=") {
            (name, bound, true)
        } else {
            let (name, bound) = text.split_once("<=").ok_or_else(error)?;
            (name, bound, false)
        };
        let metric = METRICS.iter().find(|(known, _)| *known == name.trim()).ok_or_else(error)?.1;
        let bound: f64 = bound.trim().parse().map_err(|_| error())?;
        if bound.is_finite() { Ok(Self { metric, at_least, bound }) } else { Err(error()) }
    }
}

impl fmt::Display for GateMetric {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = METRICS.iter().find(|(_, metric)| metric == self).map_or("", |(name, _)| name);
        f.write_str(name)
    }
}

impl fmt::Display for Gate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.at_least { ">=" } else { "<=" };
        write!(f, "{}{sign}{}", self.metric, self.bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gates_are_read_and_written() {
        for (text, metric, met, missed) in [
            ("psnr>=25", GateMetric::Psnr, 25.0, 24.999),
            ("lpips<=0.2", GateMetric::Lpips, 0.1, 0.3),
            ("gap<=-1.5", GateMetric::Gap, -2.0, 0.0),
            ("psnr_float>=30", GateMetric::PsnrFloat, 30.0, f64::NAN),
        ] {
            let gate: Gate = text.parse().unwrap();
            assert_eq!(gate.metric, metric);
            assert!(gate.is_met_by(met) && !gate.is_met_by(missed), "{text}");
            assert_eq!(gate.to_string(), text);
        }
        assert_eq!(" ssim >= 0.9".parse::<Gate>().unwrap().to_string(), "ssim>=0.9");
    }

    #[test]
    fn what_is_no_gate_is_refused() {
        for text in ["", "psnr", "psnr>25", "psnr>=", "psnr>=NaN", "psnr>=inf", "mse<=1", ">=3"] {
            assert!(text.parse::<Gate>().is_err(), "{text}");
        }
    }
}
