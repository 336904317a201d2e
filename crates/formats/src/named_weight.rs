//! `NAME=WEIGHT`: an entry of a list and its weight, as flags and configuration files spell it.

/// Largest weight that a sum with a default of about one survives in f32.
const MAX_WEIGHT: f32 = 1e6;

/// Index and weight, 0 to 1e6, of `NAME=WEIGHT`. `example` is shown when there is no `=`; `find` returns the index of a
/// name, or a sentence that names what there is.
///
/// # Errors
/// One sentence about the mistake.
pub fn parse_named_weight(
    text: &str,
    example: &str,
    find: impl Fn(&str) -> Result<usize, String>,
) -> Result<(usize, f32), String> {
    let (name, weight) = text
        .split_once('=')
        .ok_or_else(|| format!("expected NAME=WEIGHT, for example {example}: {text}"))?;
    let index = find(name)?;
    let parsed = weight.parse().ok().filter(|w| (0.0..=MAX_WEIGHT).contains(w));
    let weight = parsed
        .ok_or_else(|| format!("the weight {weight} is not a number from 0 to {MAX_WEIGHT:e}"))?;
    Ok((index, weight))
}
