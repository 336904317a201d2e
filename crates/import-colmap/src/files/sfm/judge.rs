//! Whether a solution can be believed, and which of two is better.
//!
//! Structure from motion can be wrong and still end without complaint: a wrong focal length
//! bends the scene, and the reprojection error hardly shows it. What shows it is a focal length
//! that left its prior, a mean error well above half a pixel, and few photos.

use super::{FocalPrior, SfmOptions, Solution};

/// Mean reprojection error, pixels, above which poses are doubted: good photo sets end at 0.4 to 0.7, with faint keypoints, whose places
/// are known less well, at 0.6 to 1.
const HIGH_ERROR_PX: f64 = 0.8;
const HIGH_ERROR_FAINT_PX: f64 = 1.2;
/// Relative distance of the refined focal length from its prior above which one of the two is
/// wrong; EXIF values are rounded by a few percent.
const FOCAL_DRIFT: f64 = 0.10;
/// Median triangulation angle, degrees, below which depth is badly known.
const THIN_PARALLAX_DEGREES: f64 = 3.0;
/// Share of photos with a pose below which the set is in pieces.
const FEW_REGISTERED: f64 = 0.8;
/// Share of photos with a pose below which most of what was photographed is not in the capture.
const MOST_REGISTERED: f64 = 0.5;
/// Keypoints per photo from which faint ones add little and cost much: matching grows with their square.
const MANY_KEYPOINTS: f64 = 6000.0;
/// Source of a focal length prior that nobody said.
pub(super) const GUESSED: &str = "guess";
/// Focal length over long side when nothing is known (COLMAP's factor; 43 mm equivalent).
const FOCAL_GUESS: f64 = 1.2;

impl Solution {
    fn focal_drift(&self) -> Option<f64> {
        self.report.focal_prior_px.map(|prior| self.report.focal_px / prior - 1.0)
    }

    fn high_error_px(&self) -> f64 {
        if self.faint { HIGH_ERROR_FAINT_PX } else { HIGH_ERROR_PX }
    }

    fn is_doubtful(&self) -> bool {
        self.report.mean_reprojection_error_px.is_none_or(|error| error > self.high_error_px())
            || (self.registered as f64) < FEW_REGISTERED * self.photos as f64
    }
}

/// The focal length prior with which a second run may do better; `None` when the first one can be believed, or the user chose the
/// focal length.
pub(super) fn second_prior(first: &Solution, options: &SfmOptions) -> Option<FocalPrior> {
    if options.focal.is_some() {
        return None;
    }
    match (first.focal_drift(), first.report.focal_prior_px) {
        // The photos' own focal length was left: hold on to it, for all photos.
        (Some(drift), Some(prior)) => {
            (drift.abs() > FOCAL_DRIFT).then_some(FocalPrior::Pixels(prior))
        }
        _ => first.is_doubtful().then_some(FocalPrior::Guess(FOCAL_GUESS * first.long_side)),
    }
}

/// Whether photos are left without a pose that faint keypoints may give one.
pub(super) fn may_gain_photos(solution: &Solution) -> bool {
    solution.registered < solution.photos && solution.keypoints.is_none_or(|k| k < MANY_KEYPOINTS)
}

/// Whether a solution is better than another: more photos, then a smaller error.
pub(super) fn is_better(solution: &Solution, than: &Solution) -> bool {
    let error = |s: &Solution| s.report.mean_reprojection_error_px.unwrap_or(f64::INFINITY);
    let as_many = solution.registered == than.registered;
    solution.registered > than.registered || (as_many && error(solution) < error(than))
}

/// What a run was told.
pub(super) fn name(focal_prior_px: Option<f64>, faint: bool) -> String {
    let prior = match focal_prior_px {
        Some(prior) => format!("focal length prior {prior:.0} px"),
        None => "no focal length prior".into(),
    };
    format!("run with {prior}{}", if faint { " and faint keypoints" } else { "" })
}

/// What a run came to.
pub(super) fn describe(solution: &Solution) -> String {
    let Solution { report, registered, photos, faint, .. } = solution;
    let error =
        report.mean_reprojection_error_px.map_or("unknown".into(), |e| format!("{e:.2} px"));
    let contradicted = match solution.contradicted {
        0 => String::new(),
        count => format!(", {count} more placed against what their matches say and left out"),
    };
    format!(
        "{}: {registered} of {photos} photos{contradicted}, reprojection error {error}, focal length {:.0} px",
        name(report.focal_prior_px, *faint),
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
    let high = solution.high_error_px();
    if let Some(error) = solution.report.mean_reprojection_error_px.filter(|&e| e > high) {
        warnings.push(format!(
            "the mean reprojection error is {error:.2} px (good sets end below {high}): poses or focal length \
             may be wrong; remove blurred photos and moving subjects, or give --focal"
        ));
    }
    // A guess is no focal length that the photos say.
    match solution.focal_drift().filter(|_| solution.report.focal_prior_source != GUESSED) {
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
            Self::Pixels(focal) | Self::Guess(focal) => Some(focal),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::SfmReport;
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
        assert_eq!(again(&solution(20, 0.5, Some(800.0), 990.0)), Some(FocalPrior::Pixels(800.0)));
        assert_eq!(again(&solution(20, 0.5, None, 990.0)), None);
        assert_eq!(again(&solution(20, 1.1, None, 990.0)), Some(FocalPrior::Guess(1200.0)));
        assert_eq!(again(&solution(9, 0.5, None, 990.0)), Some(FocalPrior::Guess(1200.0)));
        let chosen = SfmOptions { focal: Some(700.0), ..SfmOptions::default() };
        assert_eq!(second_prior(&solution(9, 2.0, Some(700.0), 990.0), &chosen), None);
    }

    #[test]
    fn more_photos_are_better_than_a_smaller_error() {
        let run = |registered, error| solution(registered, error, None, 700.0);
        assert!(is_better(&run(20, 0.6), &run(20, 1.1)));
        assert!(is_better(&run(20, 1.1), &run(12, 0.6)));
        assert!(!is_better(&run(12, 0.6), &run(20, 1.1)));
        assert!(!is_better(&run(20, 0.6), &run(20, 0.6)), "the first is kept");
        let told = describe(&Solution { faint: true, ..run(12, 0.6) });
        let whole = "run with no focal length prior and faint keypoints: 12 of 20 photos";
        assert!(told.starts_with(whole) && told.contains("0.60 px"), "{told}");
    }

    #[test]
    fn faint_keypoints_are_for_photos_that_have_few() {
        let with = |registered, keypoints| {
            may_gain_photos(&Solution { keypoints, ..solution(registered, 0.5, None, 700.0) })
        };
        assert!(with(15, Some(600.0)) && with(15, None));
        assert!(!with(20, Some(600.0)) && !with(15, Some(12_000.0)));
        let faint = |error| Solution { faint: true, ..solution(20, error, Some(800.0), 810.0) };
        assert!(warnings(&faint(0.9)).is_empty());
        assert!(warnings(&faint(1.3))[0].contains("good sets end below 1.2"));
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
        let mut guessed = solution(20, 0.5, Some(800.0), 500.0);
        guessed.report.focal_prior_source = GUESSED.into();
        assert!(warnings(&guessed)[0].contains("do not say their focal length"));
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
