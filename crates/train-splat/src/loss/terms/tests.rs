use super::*;
use crate::loss::photometric::tests::{Case, cases, planes_of};

const BACKGROUND: [f32; 3] = [0.3, 0.6, 0.1];

fn evaluate(term: WeightedTerm, case: &Case) -> (LossValue, Planes) {
    let mut gradient = Planes::new(case.target.width, case.target.height, 4);
    let mut value = LossValue::default();
    add_terms(
        &[term],
        &planes_of(&case.render),
        &case.target,
        BACKGROUND,
        case.transform,
        &mut value,
        &mut gradient,
    );
    (value, gradient)
}

/// The difference quotient, unless the function bends within the step.
fn slope(f: &mut dyn FnMut(f32) -> f64) -> Option<f64> {
    let mut quotient = |h: f32| (f(h) - f(-h)) / f64::from(2.0 * h);
    let (a, b) = (quotient(2e-3), quotient(4e-3));
    let one_sided = (f(2e-3) - f(0.0)) / 2e-3;
    let tolerance = 1e-4 * a.abs().max(1e-6);
    ((a - b).abs() <= tolerance.max(2e-2 * a.abs()) && (one_sided - a).abs() <= 0.1 * a.abs())
        .then_some(a)
}

#[test]
fn gradients_of_all_terms_match_finite_differences() {
    for (index, term) in LOSS_TERMS.iter().enumerate() {
        let (name, weighted) = (term.name(), WeightedTerm { term: index, weight: 0.7 });
        let (mut checked, mut tried) = (0, 0);
        for mut case in cases() {
            let (value, gradient) = evaluate(weighted, &case);
            assert!(value.loss > 0.0, "{name}");
            let (width, n) = (case.target.width, case.render.data.len());
            for k in (0..n).step_by(n / 40 + 1) {
                let keep = case.render.data[k];
                let numeric = slope(&mut |h| {
                    case.render.data[k] = keep + h;
                    evaluate(weighted, &case).0.loss
                });
                case.render.data[k] = keep;
                tried += 1;
                let Some(numeric) = numeric else { continue };
                checked += 1;
                let got = f64::from(gradient.row(k % 3, k / 3 / width)[k / 3 % width]);
                let scale = 1.0 / n as f64;
                assert!(
                    (got - numeric).abs() < 2e-2 * scale + 0.02 * numeric.abs(),
                    "{name} {k}: {got} {numeric}"
                );
            }
            for c in 0..3 {
                for (offset, got) in [(false, value.d_gain[c]), (true, value.d_offset[c])] {
                    let keep = case.transform;
                    let mut side = |step: f32| {
                        let t = &mut case.transform;
                        let field = if offset { &mut t.offset } else { &mut t.gain };
                        field[c] += step;
                        let loss = evaluate(weighted, &case).0.loss;
                        case.transform = keep;
                        loss
                    };
                    let numeric = (side(1e-3) - side(-1e-3)) / 2e-3;
                    assert!(
                        (got - numeric).abs() < 0.02 * numeric.abs() + 4e-3,
                        "{name}: {got} {numeric}"
                    );
                }
            }
        }
        assert!(2 * checked > tried, "{name}: {checked} of {tried} slopes could be compared");
    }
}

#[test]
fn nothing_is_lost_where_the_rendering_is_the_photo() {
    for (index, term) in LOSS_TERMS.iter().enumerate() {
        let mut case = cases().remove(0);
        case.transform = ColorTransform::IDENTITY;
        let pixels = case.target.width * case.target.height;
        for (k, value) in case.render.data.iter_mut().enumerate() {
            *value = f32::from(case.target.rgb[(k % 3) * pixels + k / 3]) * (1.0 / 255.0);
        }
        let (value, gradient) = evaluate(WeightedTerm { term: index, weight: 1.0 }, &case);
        assert_eq!(
            (value.loss, gradient.data.iter().all(|g| *g == 0.0)),
            (0.0, true),
            "{}",
            term.name()
        );
    }
}

#[test]
fn terms_are_read_from_text() {
    let term: WeightedTerm = "edge=0.25".parse().unwrap();
    assert_eq!((term.term().name(), term.to_string()), ("edge", "edge=0.25".to_owned()));
    let text = serde_json::to_string(&term).unwrap();
    assert_eq!(serde_json::from_str::<WeightedTerm>(&text).unwrap(), term);
    for (text, says) in [
        ("edge", "NAME=WEIGHT"),
        ("sharp=1", "there are edge, huber"),
        ("edge=NaN", "is not a number"),
        ("edge=-1", "is not a number"),
        ("edge=inf", "is not a number"),
    ] {
        let error = text.parse::<WeightedTerm>().unwrap_err();
        assert!(error.contains(says), "{text}: {error}");
    }
}

#[test]
fn the_manual_lists_every_term() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/stages/train-splat.md");
    let page = std::fs::read_to_string(page).unwrap();
    for term in LOSS_TERMS {
        let row = format!("| `{}` | {} |", term.name(), term.about());
        assert!(page.contains(&row), "docs/stages/train-splat.md lacks {row}");
    }
}
