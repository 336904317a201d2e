//! What a schema declares is what the reader checks: every range of every document is tried at both of its ends.

use std::path::Path;

use motes_formats::camera_path::CameraPathDocument;
use motes_formats::capture::CaptureDocument;
use motes_formats::decomposition::DecompositionDocument;
use motes_formats::documents::{Document, parse_document, schema};
use motes_formats::metrics::MetricsDocument;
use motes_formats::run_record::RunRecord;
use motes_formats::selection::SelectionDocument;
use motes_formats::statistics::StatisticsDocument;
use serde_json::{Map, Value, json};

/// A document that has every key, and an item for every alternative of a list.
fn example(root: &Value, schema: &Value) -> Value {
    if let Some(reference) = schema["$ref"].as_str() {
        return example(root, root.pointer(&reference[1..]).expect("a definition"));
    }
    if let Some(constant) = schema.get("const") {
        return constant.clone();
    }
    if let Some(words) = schema["enum"].as_array() {
        return words[0].clone();
    }
    if let Some(part) = alternatives(schema).first() {
        let mut value = example(root, part);
        // What is flattened into the alternatives.
        if let (Value::Object(object), Some(own)) = (&mut value, schema["properties"].as_object()) {
            object.extend(own.iter().map(|(key, own)| (key.clone(), example(root, own))));
        }
        return value;
    }
    let kind = match &schema["type"] {
        Value::Array(kinds) => kinds[0].as_str().unwrap_or_default(),
        kind => kind.as_str().unwrap_or_default(),
    };
    match kind {
        "object" => {
            let keys = schema["properties"].as_object().into_iter().flatten();
            let mut object: Map<_, _> =
                keys.map(|(key, own)| (key.clone(), example(root, own))).collect();
            if schema["additionalProperties"].is_object() {
                object.insert("key".into(), example(root, &schema["additionalProperties"]));
            }
            Value::Object(object)
        }
        "array" => {
            let count = schema["minItems"].as_u64().unwrap_or(1).max(1);
            let items = &schema["items"];
            let target =
                items["$ref"].as_str().and_then(|r| root.pointer(&r[1..])).unwrap_or(items);
            match alternatives(target) {
                [] => (0..count).map(|_| example(root, items)).collect(),
                parts => parts.iter().map(|part| example(root, part)).collect(),
            }
        }
        "string" => match schema["pattern"].as_str() {
            Some(pattern) if pattern.contains("64") => json!("0".repeat(64)),
            _ => json!("x"),
        },
        "number" | "integer" => inside(schema, kind == "integer"),
        "boolean" => json!(true),
        _ => Value::Null,
    }
}

fn alternatives(schema: &Value) -> &[Value] {
    let parts = ["oneOf", "anyOf"].iter().find_map(|key| schema[*key].as_array());
    parts.map_or(&[], Vec::as_slice)
}

fn bound(schema: &Value, key: &str) -> Option<f64> {
    schema[key].as_f64()
}

/// A number that is allowed.
fn inside(schema: &Value, whole: bool) -> Value {
    let low = bound(schema, "minimum").or(bound(schema, "exclusiveMinimum"));
    let high = bound(schema, "maximum").or(bound(schema, "exclusiveMaximum"));
    let value = match (low, high) {
        (Some(low), Some(high)) => (0.5 * (low + high)).floor().max(low),
        (Some(low), None) => low + 1.0,
        (None, Some(high)) => high - 1.0,
        (None, None) => 1.0,
    };
    if whole { json!(value as u64) } else { json!(value) }
}

/// Values that a schema does not allow, with the nearest that it allows.
fn outside(schema: &Value) -> Vec<(Value, Option<Value>)> {
    let is_whole = schema["type"].to_string().contains("integer");
    let number = |v: f64| if is_whole { json!(v as i64) } else { json!(v) };
    let step = |v: f64| if is_whole { 1.0 } else { 1e-9 * v.abs().max(1.0) };
    let mut pairs = Vec::new();
    if let Some(v) = bound(schema, "minimum").filter(|v| !is_whole || *v > 0.0) {
        pairs.push((number(v - step(v)), Some(number(v))));
    }
    // Those of the type itself, such as 2^32 - 1, are errors of the type.
    if let Some(v) = bound(schema, "maximum").filter(|v| !is_whole || *v < 1e9) {
        pairs.push((number(v + step(v)), Some(number(v))));
    }
    if let Some(v) = bound(schema, "exclusiveMinimum") {
        pairs.push((number(v), Some(number(v + step(v)))));
    }
    if let Some(v) = bound(schema, "exclusiveMaximum") {
        pairs.push((number(v), Some(number(v - step(v)))));
    }
    if schema["minItems"].as_u64().is_some_and(|least| least == 1) {
        pairs.push((json!([]), None));
    }
    pairs
}

/// Every place of `value` whose schema has a range: pointer and schema.
fn places(root: &Value, schema: &Value, value: &Value, at: &str, found: &mut Vec<(String, Value)>) {
    if let Some(reference) = schema["$ref"].as_str() {
        places(root, root.pointer(&reference[1..]).expect("a definition"), value, at, found);
    }
    if !outside(schema).is_empty() {
        found.push((at.to_owned(), schema.clone()));
    }
    let parts = alternatives(schema);
    // The value was made of the first alternative; in a list, of each in turn.
    if let Some(first) = parts.first() {
        places(root, first, value, at, found);
    }
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                let own = &schema["properties"][key];
                places(root, own, value, &format!("{at}/{key}"), found);
            }
        }
        Value::Array(items) => {
            let own = &schema["items"];
            let target = own["$ref"].as_str().and_then(|r| root.pointer(&r[1..])).unwrap_or(own);
            for (i, item) in items.iter().enumerate() {
                let own = alternatives(target).get(i).unwrap_or(own);
                places(root, own, item, &format!("{at}/{i}"), found);
            }
        }
        _ => {}
    }
}

fn ranges_hold<T: Document>(least: usize) {
    let schema = schema::<T>().1;
    let mut value = example(&schema, &schema);
    value["version"] = json!(T::version());
    // Selectors declare no ranges; `edit` checks theirs.
    if T::FORMAT == SelectionDocument::FORMAT {
        value["steps"] = json!([]);
    }
    let parse = |value: &Value| {
        let bytes = serde_json::to_vec(value).expect("JSON");
        parse_document::<T>(&bytes, Path::new("d.json")).map(drop).map_err(|e| e.to_string())
    };
    parse(&value).unwrap_or_else(|error| panic!("{}: {error}", T::FORMAT));
    let mut found = Vec::new();
    places(&schema, &schema, &value, "", &mut found);
    assert!(found.len() >= least, "{}: {} ranges, {least} expected", T::FORMAT, found.len());
    for (pointer, own) in found {
        for (bad, good) in outside(&own) {
            let with = |new: &Value| {
                let mut value = value.clone();
                *value.pointer_mut(&pointer).expect("a place") = new.clone();
                parse(&value)
            };
            let error = with(&bad).expect_err(&format!("{} {pointer} = {bad}", T::FORMAT));
            assert!(error.contains(&format!("({pointer}")), "{pointer} = {bad}: {error}");
            if let Some(good) = good {
                with(&good).unwrap_or_else(|error| panic!("{pointer} = {good}: {error}"));
            }
        }
    }
}

#[test]
fn the_reader_checks_every_range_of_the_schemas() {
    ranges_hold::<CameraPathDocument>(6);
    ranges_hold::<CaptureDocument>(4);
    ranges_hold::<DecompositionDocument>(0);
    ranges_hold::<MetricsDocument>(0);
    ranges_hold::<RunRecord>(0);
    ranges_hold::<SelectionDocument>(0);
    ranges_hold::<StatisticsDocument>(0);
}
