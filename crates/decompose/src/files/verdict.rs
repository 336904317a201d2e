//! Whether a decomposition is usable, in plain words.

use motes_formats::decomposition::TermDocument;

/// Share of the surface that three photos have to see.
const LEAST_SEEN: f64 = 0.1;
/// Share of what the Gaussians show that has to have a surface.
const LEAST_ON_SURFACE: f64 = 0.2;

/// A number of the term `confidence`.
pub(super) fn number(terms: &[TermDocument], name: &str) -> Option<f64> {
    let term = terms.iter().find(|term| term.name == "confidence")?;
    *term.numbers.get(name)?
}

/// Why a decomposition by so many photos has failed; none when it has not.
pub(super) fn failure(terms: &[TermDocument], photos: usize) -> Option<String> {
    let below = |name: &str, least: f64| number(terms, name).filter(|share| *share < least);
    let what = if let Some(share) = below("on_surface_share", LEAST_ON_SURFACE) {
        format!(
            "only {:.0} % of what the Gaussians show in the photos has a surface",
            100.0 * share
        )
    } else {
        let share = below("seen_by_three_share", LEAST_SEEN).filter(|_| photos >= 3)?;
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
        assert_eq!(failure(&terms(Some(0.62), Some(0.9)), 20), None);
        let unseen = failure(&terms(Some(0.04), Some(0.9)), 20).unwrap_or_default();
        assert!(unseen.contains("three photos see only 4 % of the surface"), "{unseen}");
        assert_eq!(failure(&terms(Some(0.0), Some(0.9)), 2), None, "there are not three photos");
        let missed = failure(&terms(Some(0.62), Some(0.12)), 20).unwrap_or_default();
        assert!(missed.contains("only 12 % of what the Gaussians show"), "{missed}");
        assert_eq!(failure(&terms(None, None), 20), None);
        assert_eq!(failure(&[], 20), None);
    }
}
