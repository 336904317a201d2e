//! What types cannot say: ranges, names that refer backwards, keys that exclude each other.

use std::collections::BTreeSet;
use std::path::Path;

use super::check_steps::check_steps;
use super::ops::{InsertOp, OpDocument, SetMaterialOp, StylizeOp, TransformOp};
use super::values::{BoxDocument, ColorModeDocument, PivotDocument, SphereDocument};
use super::{EditPlanDocument, LARGEST, MAX_FIT_STEPS, MAX_OPS, MAX_RESHADE_SAMPLES};
use crate::error::{FormatError, Result, quoted};

/// Copies that one operation may make, and steps that one may undo.
const MAX_COUNT: u64 = 10_000;
/// Gaussians that a mesh may become.
const MAX_MESH_GAUSSIANS: u64 = 10_000_000;
/// The target that is always there.
const ALL: &str = "all";

/// Pointer to an operation of a plan.
pub fn op_pointer(index: usize) -> String {
    format!("/ops/{index}")
}

/// A mistake: the rest of the pointer, the cause, the remedy.
pub(super) type Fault = (String, String, Option<String>);

/// Checks a plan; `name` stands for the file in errors. Whether files exist and selections fit is seen when
/// they are read.
///
/// # Errors
/// A number is not finite or out of range; a target was not selected by an earlier operation; two selections have one
/// name; keys exclude each other; more is undone than was done.
pub fn check_plan(plan: &EditPlanDocument, name: &Path) -> Result<()> {
    let invalid = |place: String, cause: String, remedy: Option<String>| {
        let error = FormatError::invalid(name, place, cause);
        Err(match remedy {
            Some(remedy) => error.with_remedy(remedy),
            None => error,
        })
    };
    if plan.ops.len() > MAX_OPS {
        let cause = format!("{} operations are more than {MAX_OPS}", plan.ops.len());
        return invalid(format!("/ops/{MAX_OPS}"), cause, Some("split the plan".into()));
    }
    if let Some(up) = plan.up_in_world
        && let Err((_, cause, _)) = direction("", &up)
    {
        return invalid("/up_in_world".into(), cause, None);
    }
    if let Some(steps) = plan.refit_steps.filter(|steps| *steps > MAX_FIT_STEPS) {
        let cause = format!("{steps} is not from 0 to {MAX_FIT_STEPS}");
        return invalid("/refit_steps".into(), cause, None);
    }
    if let Some(samples) = plan.reshade_samples.filter(|samples| *samples > MAX_RESHADE_SAMPLES) {
        let cause = format!("{samples} is not from 0 to {MAX_RESHADE_SAMPLES}");
        return invalid("/reshade_samples".into(), cause, None);
    }
    let later = names(plan);
    let mut known = BTreeSet::new();
    // What may be undone, and the names that go with it.
    let mut done: Vec<Option<&str>> = Vec::new();
    let mut taken = BTreeSet::new();
    for (i, op) in plan.ops.iter().enumerate() {
        let checked = check_values(op)
            .and_then(|()| check_target(op, &known, &taken, &later))
            .and_then(|()| check_undo(op, done.len() as u64));
        if let Err((place, cause, remedy)) = checked {
            return invalid(format!("{}{place}", op_pointer(i)), cause, remedy);
        }
        if let Some((key, id)) = defined(op) {
            let place = || format!("{}/{key}", op_pointer(i));
            if id.is_empty() || id == ALL {
                return invalid(place(), format!("{} cannot name a selection", quoted(id)), None);
            }
            if !known.insert(id.to_owned()) {
                let cause = format!("the name {} is given twice", quoted(id));
                return invalid(place(), cause, None);
            }
        }
        if let OpDocument::Undo(undo) = op {
            for name in done.drain(done.len() - undo.steps as usize..).flatten() {
                taken.extend(known.take(name));
            }
        } else {
            done.push(defined(op).map(|(_, id)| id));
        }
    }
    Ok(())
}

/// Names that a plan defines anywhere.
fn names(plan: &EditPlanDocument) -> BTreeSet<String> {
    plan.ops.iter().filter_map(|op| defined(op).map(|(_, id)| id.to_owned())).collect()
}

/// The key and the name of the selection that an operation makes.
fn defined(op: &OpDocument) -> Option<(&'static str, &str)> {
    match op {
        OpDocument::Select(op) => op.id.as_deref().map(|id| ("id", id)),
        OpDocument::Duplicate(op) => op.name.as_deref().map(|id| ("as", id)),
        OpDocument::Insert(op) => op.name.as_deref().map(|id| ("as", id)),
        OpDocument::Swap(op) => op.name.as_deref().map(|id| ("as", id)),
        _ => None,
    }
}

fn check_target(
    op: &OpDocument,
    known: &BTreeSet<String>,
    taken: &BTreeSet<String>,
    later: &BTreeSet<String>,
) -> std::result::Result<(), Fault> {
    for (key, target) in op.references() {
        if target == ALL || known.contains(target) {
            continue;
        }
        let own = defined(op).is_some_and(|(_, id)| id == target);
        let cause = match () {
            () if own => format!("{} refers to itself", quoted(target)),
            () if taken.contains(target) => {
                format!("the operation that makes {} was taken back", quoted(target))
            }
            () if later.contains(target) => {
                format!("{} is made by a later operation", quoted(target))
            }
            () => format!("no earlier operation selects {}", quoted(target)),
        };
        let remedy = "select it first: {\"op\": \"select\", \"id\": ..., ...}";
        return Err((format!("/{key}"), cause, Some(remedy.into())));
    }
    Ok(())
}

fn check_undo(op: &OpDocument, undoable: u64) -> std::result::Result<(), Fault> {
    match op {
        OpDocument::Undo(undo) if undo.steps == 0 || undo.steps > undoable => {
            let cause = format!("{} steps cannot be undone, {undoable} were done", undo.steps);
            Err(("/steps".into(), cause, None))
        }
        _ => Ok(()),
    }
}

fn check_values(op: &OpDocument) -> std::result::Result<(), Fault> {
    match op {
        OpDocument::Select(op) => check_steps(&op.steps),
        OpDocument::Transform(op) => check_transform(op),
        OpDocument::Duplicate(op) => {
            finite("/translate", &op.translate)?;
            bounded("/count", op.count, MAX_COUNT)
        }
        OpDocument::Insert(op) => check_insert(op),
        OpDocument::Swap(op) => {
            finite("/rotate_deg", &[op.rotate_deg])?;
            op.up.as_ref().map_or(Ok(()), |up| direction("/up", up))?;
            mesh_count(op.gaussians)
        }
        OpDocument::Recolor(op) => color("/rgb_linear", op.mode, &op.rgb_linear),
        OpDocument::SetMaterial(op) => check_material(op),
        OpDocument::SetEnvironment(op) => {
            finite("/rotate_deg", &[op.rotate_deg])?;
            positive("/exposure", op.exposure)
        }
        OpDocument::Crop(op) => match (&op.r#box, &op.sphere) {
            (Some(region), None) => check_box(region),
            (None, Some(ball)) => check_sphere(ball),
            _ => Err(("".into(), "exactly one of \"box\" and \"sphere\" is needed".into(), None)),
        },
        OpDocument::RemoveFloaters(op) => {
            bounded("/neighbours", u64::from(op.neighbors), 256)?;
            positive("/deviations", op.deviations)
        }
        OpDocument::KeepLargest(op) => positive("/reach", op.reach),
        OpDocument::Decimate(op) => bounded("/count", op.count, u64::from(u32::MAX)),
        OpDocument::ShReduce(op) if op.degree > 4 => {
            Err(("/degree".into(), format!("{} is not a degree from 0 to 4", op.degree), None))
        }
        OpDocument::Render(op) => {
            finite("/azimuth_deg", &[op.azimuth_deg])?;
            range("/elevation_deg", op.elevation_deg, -89.0, 89.0)?;
            range("/size", f64::from(op.size), 16.0, 8192.0)
        }
        OpDocument::Stylize(op) => check_stylize(op),
        OpDocument::Delete(_)
        | OpDocument::Extract(_)
        | OpDocument::ShadowCatcher(_)
        | OpDocument::DropNan(_)
        | OpDocument::Order(_)
        | OpDocument::ShReduce(_)
        | OpDocument::Measure(_)
        | OpDocument::Undo(_) => Ok(()),
    }
}

fn check_transform(op: &TransformOp) -> std::result::Result<(), Fault> {
    op.translate.as_ref().map_or(Ok(()), |t| finite("/translate", t))?;
    let rotations = [
        ("/rotate_axis", op.rotate_axis.is_some()),
        ("/rotate_euler_deg", op.rotate_euler_deg.is_some()),
        ("/rotate_quaternion", op.rotate_quaternion.is_some()),
    ];
    let mut given = rotations.iter().filter(|(_, given)| *given);
    if let (Some(_), Some((place, _))) = (given.next(), given.next()) {
        let cause = "one operation has one rotation".to_owned();
        return Err(((*place).into(), cause, Some("use two operations".into())));
    }
    if let Some(rotation) = &op.rotate_axis {
        direction("/rotate_axis/axis", &rotation.axis)?;
        finite("/rotate_axis/deg", &[rotation.deg])?;
    }
    op.rotate_euler_deg.as_ref().map_or(Ok(()), |e| finite("/rotate_euler_deg", e))?;
    op.rotate_quaternion.as_ref().map_or(Ok(()), |q| direction("/rotate_quaternion", q))?;
    op.scale.map_or(Ok(()), |s| positive("/scale", s))?;
    match &op.pivot {
        Some(PivotDocument::Point(p)) => finite("/pivot", p),
        _ => Ok(()),
    }
}

fn check_insert(op: &InsertOp) -> std::result::Result<(), Fault> {
    op.at.as_ref().map_or(Ok(()), |at| finite("/at", at))?;
    op.up.as_ref().map_or(Ok(()), |up| direction("/up", up))?;
    finite("/rotate_deg", &[op.rotate_deg])?;
    op.scale.map_or(Ok(()), |s| positive("/scale", s))?;
    op.height.map_or(Ok(()), |s| positive("/height", s))?;
    if op.scale.is_some() && op.height.is_some() {
        return Err(("/height".into(), "\"scale\" and \"height\" exclude each other".into(), None));
    }
    mesh_count(op.gaussians)
}

fn check_material(op: &SetMaterialOp) -> std::result::Result<(), Fault> {
    let nothing = op.name.is_none()
        && op.base_color.is_none()
        && op.roughness.is_none()
        && op.metallic.is_none();
    if nothing {
        let cause = "nothing is set: \"name\", \"base_color\", \"roughness\" or \"metallic\"";
        return Err((String::new(), cause.into(), None));
    }
    if let Some(change) = &op.base_color {
        color("/base_color/rgb_linear", change.mode, &change.rgb_linear)?;
    }
    op.roughness.map_or(Ok(()), |v| range("/roughness", v, 0.0, 1.0))?;
    op.metallic.map_or(Ok(()), |v| range("/metallic", v, 0.0, 1.0))
}

fn check_stylize(op: &StylizeOp) -> std::result::Result<(), Fault> {
    for word in ["{input}", "{output}"] {
        if !op.editor.contains(word) {
            let cause = format!("the command has no {word}");
            return Err((
                "/editor".into(),
                cause,
                Some("for example: python3 edit.py {input} {output} {prompt}".into()),
            ));
        }
    }
    bounded("/rounds", u64::from(op.rounds), 100)?;
    bounded("/steps", u64::from(op.steps), u64::from(MAX_FIT_STEPS))
}

fn check_box(region: &BoxDocument) -> std::result::Result<(), Fault> {
    finite("/box/min", &region.min)?;
    finite("/box/max", &region.max)?;
    if region.min.iter().zip(&region.max).any(|(a, b)| a > b) {
        return Err(("/box".into(), "a smallest coordinate is above the largest".into(), None));
    }
    Ok(())
}

fn check_sphere(ball: &SphereDocument) -> std::result::Result<(), Fault> {
    finite("/sphere/center", &ball.center)?;
    positive("/sphere/radius", ball.radius)
}

fn mesh_count(count: Option<u64>) -> std::result::Result<(), Fault> {
    count.map_or(Ok(()), |count| bounded("/gaussians", count, MAX_MESH_GAUSSIANS))
}

fn color(place: &str, mode: ColorModeDocument, rgb: &[f64]) -> std::result::Result<(), Fault> {
    let most = if mode == ColorModeDocument::Gain { 1e6 } else { 1.0 };
    for (i, v) in rgb.iter().enumerate() {
        range(&format!("{place}/{i}"), *v, 0.0, most)?;
    }
    Ok(())
}

pub(super) fn finite(place: &str, values: &[f64]) -> std::result::Result<(), Fault> {
    let Some(i) = values.iter().position(|v| !(v.abs() <= LARGEST)) else { return Ok(()) };
    let place = if values.len() > 1 { format!("{place}/{i}") } else { place.into() };
    let cause = match values[i].is_finite() {
        true => format!("{:e} is farther from 0 than {LARGEST:e}", values[i]),
        false => format!("{} is not a finite number", values[i]),
    };
    Err((place, cause, None))
}

pub(super) fn direction(place: &str, values: &[f64]) -> std::result::Result<(), Fault> {
    finite(place, values)?;
    let length = values.iter().map(|v| v * v).sum::<f64>();
    if length > 0.0 && length.is_finite() {
        return Ok(());
    }
    Err((place.into(), format!("{values:?} has no direction"), None))
}

pub(super) fn positive(place: &str, value: f64) -> std::result::Result<(), Fault> {
    if value > 0.0 && value.is_finite() {
        return range(place, value, 1.0 / LARGEST, LARGEST);
    }
    Err((place.into(), format!("{value} is not a number above 0"), None))
}

pub(super) fn range(
    place: &str,
    value: f64,
    low: f64,
    high: f64,
) -> std::result::Result<(), Fault> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err((place.into(), format!("{value:?} is not from {low:?} to {high:?}"), None))
}

fn bounded(place: &str, value: u64, most: u64) -> std::result::Result<(), Fault> {
    if (1..=most).contains(&value) {
        return Ok(());
    }
    Err((place.into(), format!("{value} is not from 1 to {most}"), None))
}
