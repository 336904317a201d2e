//! Whether a solution can be believed, and which of two is better.
//!
//! Structure from motion can be wrong and still end without complaint: a wrong focal length
//! bends the scene, and the reprojection error hardly shows it. What shows it is a focal length
//! that left its prior, a mean error well above half a pixel, and few photos.

use super::{FocalPrior, SfmOptions, SfmReport, Solution};
use crate::error::{IngestError, Result};

/// Mean reprojection error, pixels, above which poses are doubted: good photo sets end at 0.4 to
/// 0.7.
const HIGH_ERROR_PX: f64 = 0.8;
/// Relative distance of the refined focal length from its prior above which one of the two is
/// wrong; EXIF values are rounded by a few percent.
const FOCAL_DRIFT: f64 = 0.10;
/// Median triangulation angle, degrees, below which depth is badly known.
const THIN_PARALLAX_DEGREES: f64 = 3.0;
/// Share of photos with a pose below which the set is in pieces.
const FEW_REGISTERED: f64 = 0.8;
/// Share of photos with a pose below which most of what was photographed is not in the capture.
const MOST_REGISTERED: f64 = 0.5;
/// Focal length over long side when nothing is known (COLMAP's factor; 43 mm equivalent).
const FOCAL_GUESS: f64 = 1.2;

impl Solution {
    fn focal_drift(&self) -> Option<f64> {
        self.report.focal_prior_px.map(|prior| self.report.focal_px / prior - 1.0)
    }

    fn is_doubtful(&self) -> bool {
        self.report.mean_reprojection_error_px.is_none_or(|error| error > HIGH_ERROR_PX)
            || (self.registered as f64) < FEW_REGISTERED * self.photos as f64
    }
}

/// The focal length prior, pixels, with which a second run may do better; `None` when the first
/// one can be believed, or the user chose the focal length.
pub(super) fn second_prior(first: &Solution, options: &SfmOptions) -> Option<f64> {
    if options.focal.is_some() {
        return None;
    }
    match first.focal_drift() {
        // The photos' own focal length was left: hold on to it, for all photos.
        Some(drift) => (drift.abs() > FOCAL_DRIFT).then_some(first.report.focal_prior_px)?,
        None => first.is_doubtful().then_some(FOCAL_GUESS * first.long_side),
    }
}

/// Keeps the better of two runs: the one with more photos, then the smaller error. The attempts
/// of both are told.
pub(super) fn better(first: Solution, second: Result<Solution>, prior: f64) -> Result<Solution> {
    let mut attempts = vec![describe(&first.report, first.registered, first.photos)];
    let mut kept = first;
    match second {
        Err(IngestError::Interrupted) => return Err(IngestError::Interrupted),
        Err(error) => {
            attempts.push(format!(
                "a second run with a focal length prior of {prior:.0} px failed: {error}"
            ));
        }
        Ok(mut second) => {
            if kept.report.focal_prior_px.is_none() {
                second.report.focal_prior_source = "guess".into();
            }
            attempts.push(describe(&second.report, second.registered, second.photos));
            let error = |s: &Solution| s.report.mean_reprojection_error_px.unwrap_or(f64::INFINITY);
            let more = second.registered > kept.registered;
            let as_many = second.registered == kept.registered;
            let second_wins = more || (as_many && error(&second) < error(&kept));
            attempts.push(format!("the {} was kept", if second_wins { "second" } else { "first" }));
            let seconds = kept.report.seconds + second.report.seconds;
            if second_wins {
                kept = second;
            }
            kept.report.seconds = seconds;
        }
    }
    kept.report.attempts = attempts;
    Ok(kept)
}

fn describe(report: &SfmReport, registered: usize, photos: usize) -> String {
    let prior = match report.focal_prior_px {
        Some(prior) => format!("focal length prior {prior:.0} px"),
        None => "no focal length prior".into(),
    };
    let error =
        report.mean_reprojection_error_px.map_or("unknown".into(), |e| format!("{e:.2} px"));
    format!(
        "run with {prior}: {registered} of {photos} photos, reprojection error {error}, focal length {:.0} px",
        report.focal_px
    )
}

/// What is wrong with a capture that most photos are not in; `None` of any other.
pub(crate) fn failure(registered: usize, photos: usize) -> Option<String> {
    (photos > 0 && (registered as f64) < MOST_REGISTERED * photos as f64).then(|| {
        format!(
            "only {registered} of {photos} photos have a pose, and what the others show is not in the capture; add photos from \
             between the places, with more overlap, and leave out blurred ones, or give only photos of one place"
        )
    })
}

/// What the user should doubt, with what to do about it.
pub(super) fn warnings(solution: &Solution) -> Vec<String> {
    let mut warnings = Vec::new();
    let (registered, photos) = (solution.registered, solution.photos);
    if registered < photos && failure(registered, photos).is_none() {
        let weight =
            if (registered as f64) < FEW_REGISTERED * photos as f64 { "only " } else { "" };
        warnings.push(format!(
            "{weight}{registered} of {photos} photos have a pose; photos from between the places, with more overlap, \
             would join the others, and blurred photos should go"
        ));
    }
    if let Some(error) = solution.report.mean_reprojection_error_px.filter(|&e| e > HIGH_ERROR_PX) {
        warnings.push(format!(
            "the mean reprojection error is {error:.2} px (good sets end below {HIGH_ERROR_PX}): poses or focal length \
             may be wrong; remove blurred photos and moving subjects, or give --focal"
        ));
    }
    match solution.focal_drift() {
        Some(drift) if drift.abs() > FOCAL_DRIFT => warnings.push(format!(
            "the focal length moved by {:+.0} % from its prior, to {:.0} px: one of the two is wrong; if you know it, \
             give --focal, and take photos from more places",
            100.0 * drift,
            solution.report.focal_px
        )),
        None => warnings.push(format!(
            "the photos do not say their focal length; {:.0} px was found from the photos alone and can be wrong \
             without any other sign; if you know it, give --focal",
            solution.report.focal_px
        )),
        _ => {}
    }
    if let Some(angle) = solution.median_parallax_degrees.filter(|&a| a < THIN_PARALLAX_DEGREES) {
        warnings.push(format!(
            "the median parallax is {angle:.1} degrees: depth is badly known; step sideways between photos instead of \
             turning on the spot"
        ));
    }
    warnings
}

impl FocalPrior {
    /// The number, when it is one.
    pub(super) fn pixels(self) -> Option<f64> {
        match self {
            Self::Exif => None,
            Self::Pixels(focal) => Some(focal),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solution(registered: usize, error: f64, prior: Option<f64>, focal: f64) -> Solution {
        Solution {
            registered,
            photos: 20,
            long_side: 1000.0,
            median_parallax_degrees: Some(20.0),
            report: SfmReport {
                focal_prior_px: prior,
                focal_px: focal,
                mean_reprojection_error_px: Some(error),
                seconds: 5.0,
                ..SfmReport::default()
            },
            ..Solution::default()
        }
    }

    #[test]
    fn a_second_run_is_made_only_with_a_reason() {
        let options = SfmOptions::default();
        let again = |s: &Solution| second_prior(s, &options);
        assert_eq!(again(&solution(20, 0.5, Some(800.0), 820.0)), None);
        assert_eq!(again(&solution(20, 0.5, Some(800.0), 990.0)), Some(800.0));
        assert_eq!(again(&solution(20, 0.5, None, 990.0)), None);
        assert_eq!(again(&solution(20, 1.1, None, 990.0)), Some(1200.0));
        assert_eq!(again(&solution(9, 0.5, None, 990.0)), Some(1200.0));
        let chosen = SfmOptions { focal: Some(700.0), ..SfmOptions::default() };
        assert_eq!(second_prior(&solution(9, 2.0, Some(700.0), 990.0), &chosen), None);
    }

    #[test]
    fn the_better_run_is_kept_and_both_are_told() {
        let first = || solution(20, 1.1, None, 700.0);
        let kept = better(first(), Ok(solution(20, 0.6, Some(1200.0), 1010.0)), 1200.0).unwrap();
        assert_eq!((kept.report.focal_px, kept.report.seconds), (1010.0, 10.0));
        assert_eq!(kept.report.focal_prior_source, "guess");
        assert_eq!(kept.report.attempts.len(), 3);
        let kept = better(first(), Ok(solution(12, 0.6, Some(1200.0), 1010.0)), 1200.0).unwrap();
        assert_eq!(kept.report.focal_px, 700.0);
        let failure = IngestError::bad_input("no", "no");
        let kept = better(first(), Err(failure), 1200.0).unwrap();
        assert!(kept.report.attempts[1].contains("failed"));
        assert!(better(first(), Err(IngestError::Interrupted), 1.0).is_err());
    }

    #[test]
    fn doubts_are_spoken() {
        assert!(warnings(&solution(20, 0.5, Some(800.0), 810.0)).is_empty());
        let mut bad = solution(10, 0.9, Some(800.0), 1000.0);
        bad.median_parallax_degrees = Some(1.0);
        let text = warnings(&bad).join("\n");
        for part in ["only 10 of 20", "0.90 px", "+25 %", "1.0 degrees"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(warnings(&solution(20, 0.5, None, 810.0))[0].contains("--focal"));
    }

    #[test]
    fn a_capture_without_most_photos_has_failed() {
        assert!([(10, 20), (20, 20), (0, 0)].iter().all(|&(r, p)| failure(r, p).is_none()));
        let text = failure(7, 20).unwrap();
        assert!(text.starts_with("only 7 of 20 photos"), "{text}");
        let also = warnings(&solution(7, 0.5, Some(800.0), 810.0));
        assert!(also.is_empty(), "said once: {also:?}");
    }
}
