//! Ranges of the numbers in the steps of a selection.

use motes_formats::selectors::{ObjectPrompt, PostDocument, SelectStep, Selector};

use super::ranges::{Fault, direction, finite, positive, range};

/// Largest difference of two colors in CIE L*a*b* that means anything, and more.
const MOST_DIFFERENT: f64 = 1e3;

pub(crate) fn check_steps(steps: &[SelectStep]) -> Result<(), Fault> {
    if steps.is_empty() {
        return Err(("/steps".into(), "nothing is selected: there are no steps".into(), None));
    }
    steps.iter().enumerate().try_for_each(|(i, step)| {
        let at = |key: &str| format!("/steps/{i}/{key}");
        match step {
            SelectStep::Select(step) => check_selector(&step.selector, &at),
            SelectStep::Post(PostDocument::Invert) => Ok(()),
            SelectStep::Post(
                PostDocument::Grow { distance } | PostDocument::Shrink { distance },
            ) => not_negative(&at("distance"), *distance),
        }
    })
}

fn check_selector(selector: &Selector, at: &dyn Fn(&str) -> String) -> Result<(), Fault> {
    let tolerance = |value: f64| range(&at("tolerance"), value, 0.0, MOST_DIFFERENT);
    match selector {
        Selector::Object(prompt) => check_prompt(prompt, at),
        Selector::Rectangle { pixels, .. } => finite(&at("pixels"), pixels),
        Selector::Polygon { points, .. } => all_finite(&at("points"), points),
        Selector::Brush { points, radius, .. } => {
            all_finite(&at("points"), points)?;
            positive(&at("radius"), *radius)
        }
        Selector::Sphere { center, radius } => {
            finite(&at("center"), center)?;
            positive(&at("radius"), *radius)
        }
        Selector::Box { center, half_size, rotation } => {
            finite(&at("center"), center)?;
            finite(&at("half_size"), half_size)?;
            direction(&at("rotation"), rotation)
        }
        Selector::HalfSpace { normal, point } => {
            direction(&at("normal"), normal)?;
            finite(&at("point"), point)
        }
        Selector::GroundPlane { thickness, .. } => {
            thickness.map_or(Ok(()), |t| positive(&at("thickness"), t))
        }
        Selector::Color { rgb, tolerance: t } => {
            finite(&at("rgb"), rgb)?;
            tolerance(*t)
        }
        Selector::Eyedropper { pixel, tolerance: t, .. } => {
            finite(&at("pixel"), pixel)?;
            tolerance(*t)
        }
        Selector::Connected { seed, distance, tolerance: t } => {
            finite(&at("seed"), seed)?;
            distance.map_or(Ok(()), |d| positive(&at("distance"), d))?;
            t.map_or(Ok(()), tolerance)
        }
        // Stored values may be anything.
        Selector::Property { value, .. } if value.is_nan() => {
            Err((at("value"), "NaN compares with nothing".into(), None))
        }
        Selector::Ids { ids } if ids.is_empty() => {
            Err((at("ids"), "no Gaussian is named".into(), None))
        }
        Selector::Property { .. }
        | Selector::Ids { .. }
        | Selector::Masks { .. }
        | Selector::File { .. }
        | Selector::Label { .. }
        | Selector::All => Ok(()),
    }
}

fn check_prompt(prompt: &ObjectPrompt, at: &dyn Fn(&str) -> String) -> Result<(), Fault> {
    for (k, click) in prompt.clicks.iter().enumerate() {
        finite(&at(&format!("clicks/{k}/pixel")), &click.pixel)?;
    }
    for (k, region) in prompt.boxes.iter().enumerate() {
        finite(&at(&format!("boxes/{k}/pixels")), &region.pixels)?;
    }
    for (k, scribble) in prompt.scribbles.iter().enumerate() {
        all_finite(&at(&format!("scribbles/{k}/points")), &scribble.points)?;
    }
    Ok(())
}

fn all_finite(place: &str, points: &[[f64; 2]]) -> Result<(), Fault> {
    points.iter().enumerate().try_for_each(|(k, point)| finite(&format!("{place}/{k}"), point))
}

fn not_negative(place: &str, value: f64) -> Result<(), Fault> {
    if value < 0.0 {
        return Err((place.into(), format!("{value:?} is below 0"), None));
    }
    finite(place, &[value])
}
