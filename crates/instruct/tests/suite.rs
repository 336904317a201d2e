//! Instructions with the plans that they mean: those of development, and those that were written after the code was done.
#![expect(clippy::unwrap_used, reason = "a test that cannot read its data has failed")]

use std::path::{Path, PathBuf};

use edit::plan::check_plan;
use instruct::language::{color_name, interpret};
use motes_formats::documents::read_document;
use motes_formats::scene_card::SceneCardDocument;
use serde_json::{Map, Value};

/// Share of the instructions of the last set that became their plan when they were first read, before any change for them.
const HELD_OUT_FLOOR: f64 = 0.72;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/instruct").join(name)
}

fn card() -> SceneCardDocument {
    read_document(&data("kitchen.json")).unwrap().document
}

/// Keys that say what is usual anyway.
fn is_usual(key: &str, value: &Value) -> bool {
    match key {
        "fill" => value == "texture",
        "mode" => value == "replace",
        "rotate_deg" => value == 0.0,
        "exposure" => value == 1.0,
        "fit" => value == "height",
        "align" => value == "ground",
        "neighbours" | "deviations" => true,
        _ => value.is_null(),
    }
}

fn without_usual(value: &Value) -> Value {
    match value {
        Value::Object(keys) => {
            let kept = keys.iter().filter(|(key, value)| !is_usual(key, value));
            Value::Object(kept.map(|(key, value)| (key.clone(), without_usual(value))).collect())
        }
        Value::Array(items) => Value::Array(items.iter().map(without_usual).collect()),
        other => other.clone(),
    }
}

/// Equal but for the sixth digit; a color may be given by its name.
fn same(found: &Value, wanted: &Value) -> bool {
    match (found, wanted) {
        (Value::Number(a), Value::Number(b)) => {
            (a.as_f64().unwrap() - b.as_f64().unwrap()).abs() < 1e-5
        }
        (Value::Array(rgb), Value::String(name)) => {
            let rgb: Vec<f64> = rgb.iter().filter_map(Value::as_f64).collect();
            rgb.len() == 3 && color_name([rgb[0], rgb[1], rgb[2]]) == name
        }
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b))
        }
        (Value::Object(a), Value::Object(b)) => {
            let fits =
                |(key, wanted): (&String, &Value)| a.get(key).is_some_and(|v| same(v, wanted));
            a.len() == b.len() && b.iter().all(fits)
        }
        (a, b) => a == b,
    }
}

/// What is wrong with the answer to a case.
fn wrong(card: &SceneCardDocument, case: &Map<String, Value>) -> Option<String> {
    let said = case["say"].as_str().unwrap();
    let found = match (interpret(card, said), case.get("error")) {
        (Err(error), Some(why)) => {
            let fits = error.cause.contains(why.as_str().unwrap()) && !error.help.is_empty();
            return (!fits).then(|| format!("{said}: {error} ({})", error.help));
        }
        (Err(error), None) => return Some(format!("{said}: {error} ({})", error.help)),
        (Ok(found), _) => found,
    };
    let mut shown = Map::new();
    for plan in &found.plans {
        check_plan(&plan.plan, Path::new(said)).unwrap();
        let ops = plan.plan.ops.iter().filter(|op| op.name() != "select");
        let ops: Vec<Value> =
            ops.map(|op| without_usual(&serde_json::to_value(op).unwrap())).collect();
        shown.insert(plan.name.clone().unwrap_or_default(), Value::Array(ops));
    }
    let wanted = match (case.get("ops"), case.get("plans")) {
        (Some(ops), _) => [(String::new(), ops.clone())].into_iter().collect(),
        (None, Some(plans)) => plans.as_object().unwrap().clone(),
        (None, None) => return Some(format!("{said}: becomes {}", Value::Object(shown))),
    };
    let fits = same(&Value::Object(shown.clone()), &Value::Object(wanted));
    (!fits).then(|| format!("{said}: becomes {}", Value::Object(shown)))
}

fn misses(name: &str) -> (usize, Vec<String>) {
    let cases: Vec<Map<String, Value>> =
        serde_json::from_slice(&std::fs::read(data(name)).unwrap()).unwrap();
    let card = card();
    (cases.len(), cases.iter().filter_map(|case| wrong(&card, case)).collect())
}

#[test]
fn every_instruction_of_development_becomes_its_plan() {
    let (cases, misses) = misses("development.json");
    assert!(cases >= 100, "{cases}");
    assert!(misses.is_empty(), "{} of {cases}:\n{}", misses.len(), misses.join("\n"));
}

#[test]
fn the_instructions_that_nothing_was_tuned_to_reach_their_measured_rate() {
    let (cases, misses) = misses("held-out.json");
    assert!(cases >= 50, "{cases}");
    let rate = (cases - misses.len()) as f64 / cases as f64;
    assert!(rate >= HELD_OUT_FLOOR, "{rate}: {} of {cases}:\n{}", misses.len(), misses.join("\n"));
}
