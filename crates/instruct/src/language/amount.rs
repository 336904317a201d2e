//! How far, how much, how often.

use super::cursor::Cursor;
use super::error::{Misread, shown};

/// A distance as it was said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Length {
    /// Meters.
    Metric(f64),
    /// World units.
    World(f64),
    /// Of the object's own width.
    Own(f64),
    /// Of the object's own height.
    OwnHeight(f64),
}

/// "a bit" is this share of the width of the object.
const A_BIT: f64 = 0.25;
/// "far" is this many widths.
const FAR: f64 = 2.0;

/// Meters of the units of length.
const UNITS: &[(&[&str], f64)] = &[
    (&["mm", "millimeter", "millimeters", "millimetre", "millimetres"], 0.001),
    (&["cm", "centimeter", "centimeters", "centimetre", "centimetres"], 0.01),
    (&["dm", "decimeter", "decimeters"], 0.1),
    (&["m", "meter", "meters", "metre", "metres"], 1.0),
    (&["inch", "inches"], 0.0254),
    (&["foot", "feet", "ft"], 0.3048),
];

/// Numbers in words.
const NUMBERS: &[(&str, f64)] = &[
    ("one", 1.0),
    ("two", 2.0),
    ("three", 3.0),
    ("four", 4.0),
    ("five", 5.0),
    ("six", 6.0),
    ("seven", 7.0),
    ("eight", 8.0),
    ("nine", 9.0),
    ("ten", 10.0),
    ("twelve", 12.0),
    ("fifteen", 15.0),
    ("twenty", 20.0),
    ("thirty", 30.0),
    ("forty", 40.0),
    ("fifty", 50.0),
    ("sixty", 60.0),
    ("ninety", 90.0),
    ("hundred", 100.0),
];

/// A number in digits or words, above 0.
///
/// # Errors
/// It is 0 or below.
pub(crate) fn number(cursor: &mut Cursor<'_>) -> Result<Option<f64>, Misread> {
    if let Some(value) = cursor.number() {
        let from = cursor.at;
        cursor.step();
        return match value > 0.0 && value <= 1e6 {
            true => Ok(Some(value)),
            false => Err(Misread::new(
                format!("{} is no amount here", cursor.since(from)),
                "amounts are above 0 and at most a million; for the other way say the other direction",
            )),
        };
    }
    let word = cursor.word().and_then(|word| NUMBERS.iter().find(|(name, _)| *name == word));
    Ok(word.map(|(_, value)| {
        cursor.step();
        *value
    }))
}

/// A distance, as in "20 cm", "a bit", "half a meter", "twice its width"; none when none comes next.
///
/// # Errors
/// A number that is not above 0, or one without a unit.
pub(crate) fn length(cursor: &mut Cursor<'_>) -> Result<Option<Length>, Misread> {
    let start = cursor.clone();
    if cursor
        .eat_any(&[
            "a little bit",
            "a tiny bit",
            "a bit",
            "a little",
            "a tad",
            "a touch",
            "slightly",
        ])
        .is_some()
    {
        return Ok(Some(Length::Own(A_BIT)));
    }
    if cursor.eat_any(&["a lot", "far", "a long way"]).is_some() {
        return Ok(Some(Length::Own(FAR)));
    }
    let factor = match () {
        () if cursor.eat("half a") || cursor.eat("half an") || cursor.eat("half") => 0.5,
        () if cursor.eat("a quarter of a") || cursor.eat("a quarter of") => 0.25,
        () if cursor.eat("twice") => 2.0,
        () => match number(cursor)? {
            Some(value) => {
                cursor.eat("times");
                value
            }
            None => {
                cursor.eat_any(&["a", "an"]);
                1.0
            }
        },
    };
    let from = cursor.at;
    cursor.eat_any(&["its own", "its", "their own", "their"]);
    if cursor.eat("width") || cursor.eat("widths") {
        return Ok(Some(Length::Own(factor)));
    }
    if cursor.eat("height") || cursor.eat("heights") {
        return Ok(Some(Length::OwnHeight(factor)));
    }
    cursor.at = from;
    if cursor.eat("unit") || cursor.eat("units") || cursor.eat("world units") {
        return Ok(Some(Length::World(factor)));
    }
    let unit = cursor.word().and_then(|word| UNITS.iter().find(|(names, _)| names.contains(&word)));
    if let Some((_, meters)) = unit {
        cursor.step();
        return Ok(Some(Length::Metric(factor * meters)));
    }
    let (counted, said) = (start.number().is_some(), cursor.since(start.at));
    *cursor = start;
    match counted {
        true => Err(Misread::new(
            format!("{said} has no unit of length"),
            "say mm, cm, m, inches, feet or units (of the world), as in \"20 cm\"",
        )),
        false => Ok(None),
    }
}

/// Degrees of a turn, as in "30 degrees", "a quarter turn"; none when none comes next.
///
/// # Errors
/// A number that is not above 0, or one that is not followed by "degrees".
pub(crate) fn degrees(cursor: &mut Cursor<'_>) -> Result<Option<f64>, Misread> {
    const TURNS: [(&str, f64); 6] = [
        ("a quarter turn", 90.0),
        ("quarter turn", 90.0),
        ("a half turn", 180.0),
        ("half a turn", 180.0),
        ("a full turn", 360.0),
        ("around", 180.0),
    ];
    if let Some((_, degrees)) = TURNS.iter().find(|(words, _)| cursor.eat(words)) {
        return Ok(Some(*degrees));
    }
    let from = cursor.at;
    let Some(value) = number(cursor)? else { return Ok(None) };
    if cursor.eat_any(&["degrees", "degree", "deg"]).is_some() {
        return Ok(Some(value));
    }
    Err(Misread::new(
        format!("{} is no angle", cursor.since(from)),
        "say the angle in degrees, as in \"30 degrees\"",
    ))
}

/// A factor on a size, as in "twice", "3 times", "150 %", "by half"; none when none comes next.
///
/// # Errors
/// A number that is not above 0.
pub(crate) fn factor(cursor: &mut Cursor<'_>) -> Result<Option<Factor>, Misread> {
    if cursor.eat_any(&["twice", "two times", "double"]).is_some() {
        return Ok(Some(Factor::Times(2.0)));
    }
    if cursor.eat_any(&["thrice", "triple"]).is_some() {
        return Ok(Some(Factor::Times(3.0)));
    }
    if cursor.eat("half") {
        return Ok(Some(Factor::Times(0.5)));
    }
    if cursor.eat("a third") {
        return Ok(Some(Factor::Times(1.0 / 3.0)));
    }
    let before = cursor.clone();
    let Some(value) = number(cursor)? else { return Ok(None) };
    if cursor.eat_mark('%') || cursor.eat_any(&["percent", "per cent"]).is_some() {
        return Ok(Some(Factor::Percent(value)));
    }
    if cursor.eat_any(&["times", "x", "fold"]).is_some() {
        return Ok(Some(Factor::Times(value)));
    }
    if cursor.word().is_none_or(|word| !UNITS.iter().any(|(names, _)| names.contains(&word))) {
        return Ok(Some(Factor::Times(value)));
    }
    *cursor = before;
    Ok(None)
}

/// A factor as it was said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Factor {
    /// "twice".
    Times(f64),
    /// "20 %": of what it was, or more than it, as the words around say.
    Percent(f64),
}

/// World units of a metric length.
///
/// # Errors
/// It is not known how long a unit is.
pub(crate) fn world_units(meters: f64, meters_per_unit: Option<f64>) -> Result<f64, Misread> {
    let scale = meters_per_unit.filter(|scale| *scale > 0.0 && scale.is_finite());
    scale.map(|scale| meters / scale).ok_or_else(|| {
        let said = shown(&format!("{meters} m"));
        Misread::new(
            format!("{said} cannot be measured: nothing says how long a world unit is"),
            "give --meters-per-unit METERS, or say \"a bit\", \"its own width\", \"0.2 units\"",
        )
    })
}
