//! Bytes to a plan, with a JSON pointer to the first mistake.

use std::path::Path;

use motes_formats::documents::pointer::pointer_of;
use motes_formats::documents::{Parsed, brief, check_opening, syntax_error};
use motes_formats::error::{FormatError, Result, quoted};
use serde_json::{Map, Value};

use super::{EditPlanDocument, MAX_OPS, check_plan};
use crate::ops::{OP_NAMES, OpDocument};

/// Parses and checks a plan that is in memory; `name` stands for the file in errors.
///
/// # Errors
/// It is not JSON, is another document, has more than [`MAX_OPS`] operations, or an operation is unknown, lacks a key, has
/// one that it does not know, or a value out of range. The place is a JSON pointer.
pub fn parse_edit_plan(bytes: &[u8], name: &Path) -> Result<Parsed<EditPlanDocument>> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.trim_ascii().is_empty() {
        return Err(FormatError::invalid(name, "byte 0", "the file is empty"));
    }
    let value: Value =
        serde_json::from_slice(bytes).map_err(|error| syntax_error(bytes, name, &error))?;
    let Value::Object(mut keys) = value else {
        let cause = "this is not a JSON object, so not a motes/edit-plan document";
        return Err(FormatError::invalid(name, "byte 0", cause));
    };
    let (format, version) = (keys.remove("format"), keys.remove("version"));
    check_opening::<EditPlanDocument>(format.as_ref(), version.as_ref(), name)?;
    let mut plan = EditPlanDocument::new(0, Vec::new());
    plan.seed = part(&mut keys, "seed", name)?.unwrap_or_default();
    plan.up_in_world = part(&mut keys, "up_in_world", name)?;
    plan.shadow = part(&mut keys, "shadow", name)?.unwrap_or_default();
    plan.refit_steps = part(&mut keys, "refit_steps", name)?;
    plan.reshade_samples = part(&mut keys, "reshade_samples", name)?;
    plan.record = part(&mut keys, "record", name)?;
    plan.ops = match keys.remove("ops") {
        Some(Value::Array(ops)) => operations(ops, name)?,
        Some(_) => return Err(FormatError::invalid(name, "/ops", "the operations are not a list")),
        None => return Err(FormatError::invalid(name, "/ops", "the key \"ops\" is missing")),
    };
    let mut warnings = Vec::new();
    if !keys.is_empty() {
        let names: Vec<String> = keys.keys().take(5).map(quoted).collect();
        let shown = name.display();
        warnings.push(format!("unknown keys in {shown} were ignored: {}", names.join(", ")));
    }
    check_plan(&plan, name)?;
    Ok(Parsed { document: plan, warnings })
}

fn part<T: serde::de::DeserializeOwned>(
    keys: &mut Map<String, Value>,
    key: &str,
    name: &Path,
) -> Result<Option<T>> {
    let Some(value) = keys.remove(key) else { return Ok(None) };
    serde_path_to_error::deserialize(value).map(Some).map_err(|error| {
        let place = format!("/{key}{}", pointer_of(error.path()));
        FormatError::invalid(name, place, brief(error.inner()))
    })
}

fn operations(ops: Vec<Value>, name: &Path) -> Result<Vec<OpDocument>> {
    if ops.len() > MAX_OPS {
        let cause =
            format!("{} operations are more than the {MAX_OPS} that a plan may have", ops.len());
        return Err(FormatError::not_supported(name, format!("/ops/{MAX_OPS}"), cause)
            .with_remedy("split the plan"));
    }
    ops.into_iter().enumerate().map(|(i, op)| parse_op(op, &format!("/ops/{i}"), name)).collect()
}

/// One operation; `pointer` is its place in `name`.
///
/// # Errors
/// It is not an object, has no known `op`, lacks a key or has one that it does not know. Values are
/// checked by [`check_plan`].
pub fn parse_op(value: Value, pointer: &str, name: &Path) -> Result<OpDocument> {
    let Value::Object(mut keys) = value else {
        return Err(FormatError::invalid(name, pointer, "an operation is a JSON object"));
    };
    let at_op = format!("{pointer}/op");
    let op = match keys.remove("op") {
        Some(Value::String(op)) => op,
        Some(_) => {
            return Err(FormatError::invalid(name, at_op, "the name of an operation is a text"));
        }
        None => {
            return Err(FormatError::invalid(name, at_op, "the key \"op\" is missing")
                .with_remedy(known_ops()));
        }
    };
    match OpDocument::from_keys(&op, keys) {
        Some(Ok(op)) => Ok(op),
        Some(Err((path, cause))) => {
            Err(FormatError::invalid(name, format!("{pointer}{}", pointer_of(&path)), cause)
                .with_remedy("edit --print-schema describes every operation"))
        }
        None => {
            let cause = format!("there is no operation {}", quoted(&op));
            Err(FormatError::invalid(name, at_op, cause).with_remedy(known_ops()))
        }
    }
}

fn known_ops() -> String {
    format!("the operations are {}", OP_NAMES.join(", "))
}
