//! What was modeled of the camera or left out, and why.

use motes_math::tone_curve::ToneCurve;

use super::response::Response;
use super::{
    Exposures, LEAST_AGREEMENT, LEAST_BALANCE_SPREAD, LEAST_BRIGHTNESS_AGREEMENT, LEAST_SPREAD,
};
use crate::report::{Term, numbers};

pub(super) fn terms(
    exposures: &Exposures,
    are_kept: bool,
    response: Option<Response>,
    curve: ToneCurve,
) -> Vec<Term> {
    vec![exposure(exposures, are_kept), tone_curve(response, curve)]
}

fn exposure(exposures: &Exposures, kept: bool) -> Term {
    let Exposures { spread, balance_spread, agreement, brightness_agreement, .. } = *exposures;
    let percent = |log: f64| 100.0 * log.exp_m1();
    let balance = if balance_spread < LEAST_BALANCE_SPREAD { "left out" } else { "kept" };
    let found = format!(
        "photos of one point differ by {:.0} % in brightness (worth a model from {:.0} % on) and {:.1} % in color; \
         both sides of the scene agree on it by {agreement:.2} (at least {LEAST_AGREEMENT}), dark and bright points by {brightness_agreement:.2} \
         (at least {LEAST_BRIGHTNESS_AGREEMENT})",
        percent(spread),
        percent(LEAST_SPREAD),
        percent(balance_spread),
    );
    let evidence = if kept {
        format!("{found}; every photo is divided by its exposure, white balance is {balance}")
    } else {
        format!("{found}; photos are taken as they are")
    };
    Term {
        name: "exposure".into(),
        kept,
        evidence,
        numbers: numbers([
            ("log_gain_rms", Some(spread)),
            ("white_balance_rms", Some(balance_spread)),
            ("agreement", Some(agreement)),
            ("brightness_agreement", Some(brightness_agreement)),
        ]),
    }
}

fn tone_curve(response: Option<Response>, curve: ToneCurve) -> Term {
    let kept = !curve.is_identity();
    let evidence = match response {
        None => {
            "--tone-curve auto tells it where exposures differ; photos are taken as sRGB".to_owned()
        }
        Some(Response { curve: found, evidence, bins }) => {
            let verdict = if kept { "kept" } else { "left out" };
            format!(
                "{verdict}: {bins} steps of brightness answer most alike to the exposures under a contrast of {:.2} beyond sRGB \
                 (chi square lower by {evidence:.0} than without)",
                found.contrast()
            )
        }
    };
    let found = response.map(|r| f64::from(r.curve.contrast()));
    Term {
        name: "tone-curve".into(),
        kept,
        evidence,
        numbers: numbers([("contrast", found), ("evidence", response.map(|r| r.evidence))]),
    }
}
