//! Whether a decomposition is usable, in plain words.

use motes_formats::decomposition::TermDocument;

/// Share of the surface that three photos have to see.
const LEAST_SEEN: f64 = 0.1;
/// Share of what the Gaussians show that has to have a surface.
const LEAST_ON_SURFACE: f64 = 0.2;

/// Why a decomposition has failed; none when it has not.
pub(super) fn failure(terms: &[TermDocument]) -> Option<String> {
    let term = terms.iter().find(|term| term.name == "confidence")?;
    let number = |name: &str| term.numbers.get(name).copied().flatten();
    let below = |name: &str, least: f64| number(name).filter(|share| *share < least);
    let what = if let Some(share) = below("on_surface_share", LEAST_ON_SURFACE) {
        format!(
            "only {:.0} % of what the Gaussians show in the photos has a surface",
            100.0 * share
        )
    } else {
        let share = below("seen_by_three_share", LEAST_SEEN)?;
        format!("three photos see only {:.0} % of the surface", 100.0 * share)
    };
    Some(format!(
        "the decomposition has failed: {what}; likely causes: Gaussians that are fog (look at `evaluate` and at the depth of \
         `render --aov depth`), poses that do not belong to the photos, or too few photos; what relight shows of it is not to be trusted"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::numbers;

    fn terms(seen: Option<f64>, on_surface: Option<f64>) -> Vec<TermDocument> {
        let other = TermDocument {
            name: "sun".into(),
            kept: true,
            evidence: String::new(),
            numbers: numbers([("seen_by_three_share", Some(0.0))]),
        };
        let numbers = numbers([("seen_by_three_share", seen), ("on_surface_share", on_surface)]);
        vec![other.clone(), TermDocument { name: "confidence".into(), numbers, ..other }]
    }

    #[test]
    fn a_surface_that_hardly_any_photo_sees_has_failed() {
        assert_eq!(failure(&terms(Some(0.62), Some(0.9))), None);
        let unseen = failure(&terms(Some(0.04), Some(0.9))).unwrap_or_default();
        assert!(unseen.contains("three photos see only 4 % of the surface"), "{unseen}");
        let missed = failure(&terms(Some(0.62), Some(0.12))).unwrap_or_default();
        assert!(missed.contains("only 12 % of what the Gaussians show"), "{missed}");
        assert_eq!(failure(&terms(None, None)), None);
        assert_eq!(failure(&[]), None);
    }
}
