//! Steps as people type them: `[COMBINE:]KIND[=VALUES]`.

use super::{
    Candidate, Click, Comparison, MaskPrompt, ObjectPrompt, PlaneSide, PostDocument, SelectStep,
    Selector, SelectorStep,
};
use motes_scene::Combine;

/// Reads a step: `[set:|add:|subtract:|intersect:]KIND[=VALUES]`, or `invert`, `grow=D`, `shrink=D`.
///
/// # Errors
/// A sentence that says what was expected.
pub fn parse_step(text: &str) -> Result<SelectStep, String> {
    let (head, values) = match text.split_once('=') {
        Some((head, values)) => (head.trim(), Some(values.trim())),
        None => (text.trim(), None),
    };
    let (combine, kind) = match head.split_once(':') {
        None => (None, head),
        Some((how, kind)) => (Some(combine(how.trim())?), kind.trim()),
    };
    if let Some(post) = post(kind, values)? {
        return match combine {
            None => Ok(SelectStep::Post(post)),
            Some(_) => Err(format!("\"{kind}\" changes the selection and is not combined")),
        };
    }
    let selector = selector(kind, values.unwrap_or(""))?;
    Ok(SelectStep::Select(SelectorStep { combine: combine.unwrap_or_default(), selector }))
}

fn combine(text: &str) -> Result<Combine, String> {
    match text {
        "set" => Ok(Combine::Set),
        "add" => Ok(Combine::Add),
        "subtract" => Ok(Combine::Subtract),
        "intersect" => Ok(Combine::Intersect),
        _ => Err(format!("\"{text}\" is none of set, add, subtract, intersect")),
    }
}

fn post(kind: &str, values: Option<&str>) -> Result<Option<PostDocument>, String> {
    let distance = || match numbers::<1>(kind, values.unwrap_or(""), "DISTANCE")? {
        [d] if d >= 0.0 => Ok(d),
        _ => Err(format!("the distance of \"{kind}\" must not be negative")),
    };
    match kind {
        "invert" if values.is_none() => Ok(Some(PostDocument::Invert)),
        "invert" => Err("\"invert\" takes no values".into()),
        "grow" => Ok(Some(PostDocument::Grow { distance: distance()? })),
        "shrink" => Ok(Some(PostDocument::Shrink { distance: distance()? })),
        _ => Ok(None),
    }
}

/// The kinds of selectors and their values, for messages and manuals.
pub(super) const KINDS: &str = "click=VIEW,X,Y[,-], mask=VIEW,FILE, rectangle=VIEW,X0,Y0,X1,Y1, \
polygon=VIEW,X,Y,X,Y,X,Y,.., brush=VIEW,RADIUS,X,Y,.., sphere=X,Y,Z,RADIUS, box=X0,Y0,Z0,X1,Y1,Z1, \
oriented-box=CX,CY,CZ,HX,HY,HZ,QW,QX,QY,QZ, half-space=NX,NY,NZ,X,Y,Z, ground[=on|above|below[,THICKNESS]], \
color=R,G,B,TOLERANCE, eyedropper=VIEW,X,Y,TOLERANCE, connected=X,Y,Z[,DISTANCE[,TOLERANCE]], \
property=NAME,lt|lte|gt|gte|eq|neq,VALUE, ids=I,I-J,.., file=SELECTION, label=[COLUMN,]VALUE, all, \
invert, grow=DISTANCE, shrink=DISTANCE";

fn selector(kind: &str, values: &str) -> Result<Selector, String> {
    for family in [of_view, of_space, of_rows] {
        if let Some(selector) = family(kind, values)? {
            return Ok(selector);
        }
    }
    Err(format!("\"{kind}\" is not a selector; they are {KINDS}"))
}

/// Selectors by what a view shows.
fn of_view(kind: &str, values: &str) -> Result<Option<Selector>, String> {
    Ok(Some(match kind {
        "click" => {
            let click = parse_click(values)?;
            Selector::Object(ObjectPrompt { clicks: vec![click], ..Default::default() })
        }
        "mask" => {
            // As the flag spells it, or with a comma as all other steps do.
            let flag = values.split_once('=').filter(|(view, _)| !view.contains(','));
            let (view, path) = match flag {
                Some((view, path)) if !view.is_empty() && !path.is_empty() => {
                    (view.trim().to_owned(), path)
                }
                _ => named(kind, values, "VIEW,FILE")?,
            };
            Selector::Masks { masks: vec![MaskPrompt { view, path: path.into() }] }
        }
        "rectangle" => {
            let (view, rest) = named(kind, values, "VIEW,X0,Y0,X1,Y1")?;
            Selector::Rectangle { view, pixels: numbers(kind, rest, "X0,Y0,X1,Y1")? }
        }
        "polygon" => {
            let (view, rest) = named(kind, values, "VIEW,X,Y,X,Y,X,Y,..")?;
            let points = points(kind, &list(kind, rest)?)?;
            if points.len() < 3 {
                return Err("a polygon has three corners or more".into());
            }
            Selector::Polygon { view, points }
        }
        "brush" => {
            let (view, rest) = named(kind, values, "VIEW,RADIUS,X,Y,..")?;
            let all = list(kind, rest)?;
            match all.split_first() {
                Some((&radius, rest)) if radius > 0.0 && !rest.is_empty() => {
                    Selector::Brush { view, radius, points: points(kind, rest)? }
                }
                _ => return Err("expected brush=VIEW,RADIUS,X,Y,.. with RADIUS above 0".into()),
            }
        }
        "eyedropper" => {
            let (view, rest) = named(kind, values, "VIEW,X,Y,TOLERANCE")?;
            let [x, y, tolerance] = numbers(kind, rest, "X,Y,TOLERANCE")?;
            positive(kind, &[tolerance])?;
            Selector::Eyedropper { view, pixel: [x, y], tolerance }
        }
        _ => return Ok(None),
    }))
}

/// Selectors by place.
fn of_space(kind: &str, values: &str) -> Result<Option<Selector>, String> {
    Ok(Some(match kind {
        "sphere" => {
            let [x, y, z, radius] = numbers(kind, values, "X,Y,Z,RADIUS")?;
            positive(kind, &[radius])?;
            Selector::Sphere { center: [x, y, z], radius }
        }
        "box" => {
            let v: [f64; 6] = numbers(kind, values, "X0,Y0,Z0,X1,Y1,Z1")?;
            let center = [0, 1, 2].map(|k| 0.5 * (v[k] + v[k + 3]));
            let half_size = [0, 1, 2].map(|k| 0.5 * (v[k] - v[k + 3]).abs());
            Selector::Box { center, half_size, rotation: super::no_rotation() }
        }
        "oriented-box" => {
            let v: [f64; 10] = numbers(kind, values, "CX,CY,CZ,HX,HY,HZ,QW,QX,QY,QZ")?;
            positive(kind, &v[3..6])?;
            Selector::Box {
                center: [v[0], v[1], v[2]],
                half_size: [v[3], v[4], v[5]],
                rotation: [v[6], v[7], v[8], v[9]],
            }
        }
        "half-space" => {
            let v: [f64; 6] = numbers(kind, values, "NX,NY,NZ,X,Y,Z")?;
            Selector::HalfSpace { normal: [v[0], v[1], v[2]], point: [v[3], v[4], v[5]] }
        }
        "ground" => ground(values)?,
        "connected" => {
            let v = list(kind, values)?;
            if !(3..=5).contains(&v.len()) {
                return Err("expected connected=X,Y,Z[,DISTANCE[,TOLERANCE]]".into());
            }
            positive(kind, &v[3..])?;
            let (distance, tolerance) = (v.get(3).copied(), v.get(4).copied());
            Selector::Connected { seed: [v[0], v[1], v[2]], distance, tolerance }
        }
        _ => return Ok(None),
    }))
}

/// Selectors by what is stored of a Gaussian.
fn of_rows(kind: &str, values: &str) -> Result<Option<Selector>, String> {
    Ok(Some(match kind {
        "color" => {
            let [r, g, b, tolerance] = numbers(kind, values, "R,G,B,TOLERANCE")?;
            positive(kind, &[tolerance])?;
            Selector::Color { rgb: [r, g, b], tolerance }
        }
        "property" => property(values)?,
        "ids" => Selector::Ids { ids: ids(values)? },
        "file" if !values.is_empty() => Selector::File { path: values.into() },
        "label" => {
            let (column, value) = values.rsplit_once(',').unwrap_or(("object_id", values));
            let expected = |_| "expected label=[COLUMN,]VALUE with a whole VALUE".to_owned();
            Selector::Label {
                column: column.trim().into(),
                value: value.trim().parse().map_err(expected)?,
            }
        }
        "all" if values.is_empty() => Selector::All,
        _ => return Ok(None),
    }))
}

/// Reads `VIEW,X,Y` or `VIEW,X,Y,-`.
///
/// # Errors
/// A sentence that says what was expected.
pub fn parse_click(text: &str) -> Result<Click, String> {
    let expected = || "expected VIEW,X,Y or, beside the object, VIEW,X,Y,-".to_owned();
    let (rest, positive) = match text.rsplit_once(',') {
        Some((rest, "-")) => (rest, false),
        Some((rest, "+")) => (rest, true),
        _ => (text, true),
    };
    let (rest, y) = rest.rsplit_once(',').ok_or_else(expected)?;
    let (view, x) = rest.rsplit_once(',').ok_or_else(expected)?;
    let number = |text: &str| text.trim().parse().ok().filter(|v: &f64| v.is_finite());
    let (Some(x), Some(y)) = (number(x), number(y)) else { return Err(expected()) };
    if view.is_empty() {
        return Err(expected());
    }
    Ok(Click { view: view.into(), pixel: [x, y], positive })
}

/// Reads the name of a candidate.
///
/// # Errors
/// A sentence that says what was expected.
pub fn parse_candidate(text: &str) -> Result<Candidate, String> {
    match text {
        "whole" => Ok(Candidate::Whole),
        "part" => Ok(Candidate::Part),
        "subpart" => Ok(Candidate::Subpart),
        _ => Err("expected whole, part or subpart".into()),
    }
}

fn ground(values: &str) -> Result<Selector, String> {
    let (side, thickness) = match values.split_once(',') {
        Some((side, thickness)) => (side, Some(numbers::<1>("ground", thickness, "THICKNESS")?[0])),
        None => (values, None),
    };
    positive("ground", thickness.as_slice())?;
    let side = match side {
        "" | "on" => PlaneSide::On,
        "above" => PlaneSide::Above,
        "below" => PlaneSide::Below,
        _ => return Err("expected ground=on, ground=above or ground=below".into()),
    };
    Ok(Selector::GroundPlane { side, thickness })
}

fn property(values: &str) -> Result<Selector, String> {
    let parts: Vec<&str> = values.split(',').map(str::trim).collect();
    let expected = || "expected property=NAME,lt|lte|gt|gte|eq|neq,VALUE".to_owned();
    let [name, compare, value] = parts[..] else { return Err(expected()) };
    let compare = match compare {
        "lt" => Comparison::Lt,
        "lte" => Comparison::Lte,
        "gt" => Comparison::Gt,
        "gte" => Comparison::Gte,
        "eq" => Comparison::Eq,
        "neq" => Comparison::Neq,
        _ => return Err(expected()),
    };
    let value = value.parse().ok().filter(|v: &f64| !v.is_nan()).ok_or_else(expected)?;
    Ok(Selector::Property { name: name.into(), compare, value })
}

fn ids(values: &str) -> Result<Vec<u32>, String> {
    /// More are a mistake of typing; a selection file holds any number.
    const MAX: u64 = 10_000_000;
    let expected = |part: &str| format!("expected ids=I,I-J,.. and not \"{part}\"");
    let mut ids = Vec::new();
    for part in values.split(',').map(str::trim) {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (Ok(first), Ok(last)) = (first.parse::<u32>(), last.parse::<u32>()) else {
            return Err(expected(part));
        };
        if last < first || ids.len() as u64 + u64::from(last - first) >= MAX {
            return Err(expected(part));
        }
        ids.extend(first..=last);
    }
    Ok(ids)
}

fn named<'a>(kind: &str, values: &'a str, shape: &str) -> Result<(String, &'a str), String> {
    match values.split_once(',') {
        Some((view, rest)) if !view.is_empty() && !rest.is_empty() => Ok((view.into(), rest)),
        _ => Err(format!("expected {kind}={shape}")),
    }
}

fn list(kind: &str, values: &str) -> Result<Vec<f64>, String> {
    let number = |part: &str| match part.trim().parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err(format!("\"{}\" in {kind} is not a finite number", part.trim())),
    };
    values.split(',').map(number).collect()
}

fn numbers<const N: usize>(kind: &str, values: &str, shape: &str) -> Result<[f64; N], String> {
    let found = list(kind, values).map_err(|error| format!("{error}; expected {kind}={shape}"))?;
    found.try_into().map_err(|_| format!("expected {kind}={shape}"))
}

fn points(kind: &str, values: &[f64]) -> Result<Vec<[f64; 2]>, String> {
    if !values.len().is_multiple_of(2) {
        return Err(format!("the corners of {kind} are pairs X,Y"));
    }
    Ok(values.chunks_exact(2).map(|p| [p[0], p[1]]).collect())
}

fn positive(kind: &str, values: &[f64]) -> Result<(), String> {
    match values.iter().all(|v| *v > 0.0) {
        true => Ok(()),
        false => Err(format!("lengths and tolerances of {kind} must be above 0")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_read_as_they_are_typed() {
        let step = |text: &str| serde_json::to_value(parse_step(text).unwrap()).unwrap();
        let json = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
        for (typed, document) in [
            (
                "sphere=0,1,2,0.5",
                r#"{"combine":"set","by":"sphere","center":[0.0,1.0,2.0],"radius":0.5}"#,
            ),
            (
                "subtract:property=opacity,lt,0.1",
                r#"{"combine":"subtract","by":"property","name":"opacity","compare":"lt","value":0.1}"#,
            ),
            (
                "add:box=1,1,1,0,0,0",
                r#"{"combine":"add","by":"box","center":[0.5,0.5,0.5],"half_size":[0.5,0.5,0.5],"rotation":[1.0,0.0,0.0,0.0]}"#,
            ),
            ("intersect:ids=3,5-7", r#"{"combine":"intersect","by":"ids","ids":[3,5,6,7]}"#),
            (
                "ground=above,0.01",
                r#"{"combine":"set","by":"ground-plane","side":"above","thickness":0.01}"#,
            ),
            ("label=4", r#"{"combine":"set","by":"label","column":"object_id","value":4}"#),
            (
                "mask=v.png,m.png",
                r#"{"combine":"set","by":"masks","masks":[{"view":"v.png","path":"m.png"}]}"#,
            ),
            (
                "mask=v.png=m,1.png",
                r#"{"combine":"set","by":"masks","masks":[{"view":"v.png","path":"m,1.png"}]}"#,
            ),
            ("invert", r#"{"post":"invert"}"#),
            ("grow=0.5", r#"{"post":"grow","distance":0.5}"#),
        ] {
            assert_eq!(step(typed), json(document), "{typed}");
            let back: SelectStep = serde_json::from_value(step(typed)).unwrap();
            assert_eq!(back, parse_step(typed).unwrap());
        }
    }

    #[test]
    fn clicks_name_views_that_may_contain_commas() {
        let click = parse_click("a,b.png,3,4.5,-").unwrap();
        assert_eq!(
            (click.view.as_str(), click.pixel, click.positive),
            ("a,b.png", [3.0, 4.5], false)
        );
        assert!(parse_click("v,1,2").unwrap().positive);
        for wrong in ["", "v", "v,1", "v,1,x", ",1,2", "v,nan,1", "v,1,2,*"] {
            assert!(parse_click(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (text, part) in [
            ("blob=1", "not a selector"),
            ("sphere=1,2,3", "X,Y,Z,RADIUS"),
            ("sphere=1,2,3,nan", "finite"),
            ("sphere=1,2,3,-1", "above 0"),
            ("both:all", "set, add"),
            ("add:invert", "not combined"),
            ("ids=5-3", "ids="),
            ("ids=0-4294967295", "ids="),
            ("property=x,like,3", "lt|lte"),
            ("polygon=v,1,2,3,4", "three corners"),
            ("grow=-1", "negative"),
        ] {
            let error = parse_step(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
