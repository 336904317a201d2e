//! Moving, rotating and scaling.

use glam::{DQuat, DVec3, EulerRot};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation, Short};
use crate::changes::measure::Bounds;
use crate::changes::transform::transform;
use crate::run::{
    AxisAngleDocument, EditError, Fault, Fill, Outcome, PivotDocument, PivotName, Run, applied,
    direction, extent_of, finite, positive, rows_of, skipped, some_place, within_range,
};
use crate::{EditState, Similarity};

/// Move, rotate and scale about a pivot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransformOp {
    /// What to move.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// World units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub translate: Option<[f64; 3]>,
    /// Rotation about an axis. At most one rotation per operation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate_axis: Option<AxisAngleDocument>,
    /// Degrees about the world's x, then y, then z axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate_euler_deg: Option<[f64; 3]>,
    /// Quaternion `w, x, y, z` of any length above 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate_quaternion: Option<[f64; 4]>,
    /// Uniform factor above 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<f64>,
    /// What rotation and scale leave in place: `origin`, `centroid` (default), `base` or `[x, y, z]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pivot: Option<PivotDocument>,
    /// What fills the place that the target leaves; the plane it stood on when nothing is said.
    #[serde(default)]
    pub fill: Fill,
}

impl Operation for TransformOp {
    const FLAGS: &'static [Flag] = &[
        Flag::of("translate", Short::Numbers("translate", 3), "X,Y,Z", "Translate, world units"),
        Flag::of(
            "rotate-axis",
            Short::AxisAngle,
            "X,Y,Z,DEG",
            "Rotate about an axis through the pivot",
        ),
        Flag::of(
            "rotate-euler",
            Short::Numbers("rotate_euler_deg", 3),
            "X,Y,Z",
            "Rotate about x, then y, then z, degrees",
        ),
        Flag::of(
            "rotate-quaternion",
            Short::Numbers("rotate_quaternion", 4),
            "W,X,Y,Z",
            "Rotate by a quaternion",
        ),
        Flag::of("scale", Short::Number("scale"), "FACTOR", "Scale about the pivot"),
        Flag::switch("transform", "Translate, rotate and scale at once"),
    ];
    const SHARED: &'static [&'static str] = &["pivot", "fill"];

    fn check(&self) -> Result<(), Fault> {
        self.translate.as_ref().map_or(Ok(()), |t| finite("/translate", t))?;
        let rotations = [
            ("/rotate_axis", self.rotate_axis.is_some()),
            ("/rotate_euler_deg", self.rotate_euler_deg.is_some()),
            ("/rotate_quaternion", self.rotate_quaternion.is_some()),
        ];
        let mut given = rotations.iter().filter(|(_, given)| *given);
        if let (Some(_), Some((place, _))) = (given.next(), given.next()) {
            let cause = "one operation has one rotation".to_owned();
            return Err(((*place).into(), cause, Some("use two operations".into())));
        }
        if let Some(rotation) = &self.rotate_axis {
            direction("/rotate_axis/axis", &rotation.axis)?;
            finite("/rotate_axis/deg", &[rotation.deg])?;
        }
        self.rotate_euler_deg.as_ref().map_or(Ok(()), |e| finite("/rotate_euler_deg", e))?;
        self.rotate_quaternion.as_ref().map_or(Ok(()), |q| direction("/rotate_quaternion", q))?;
        self.scale.map_or(Ok(()), |s| positive("/scale", s))?;
        match &self.pivot {
            Some(PivotDocument::Point(p)) => finite("/pivot", p),
            _ => Ok(()),
        }
    }

    fn refers_to(&self) -> Option<(&'static str, &str)> {
        self.target.as_deref().map(|target| ("target", target))
    }

    fn apply(
        &self,
        run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let rows = rows_of(state, self.target.as_deref(), at)?;
        let rotation = rotation_of(self);
        let scale = self.scale.unwrap_or(1.0);
        let bounds = Bounds::of(&state.gaussians, rows.iter().copied());
        let about_pivot = rotation != DQuat::IDENTITY || scale != 1.0;
        let pivot = match self.pivot.unwrap_or_default() {
            _ if !about_pivot => DVec3::ZERO,
            PivotDocument::Point(p) => DVec3::from_array(p),
            PivotDocument::Named(PivotName::Origin) => DVec3::ZERO,
            PivotDocument::Named(PivotName::Centroid) => some_place(bounds, at)?.centroid,
            PivotDocument::Named(PivotName::Base) => extent_of(state, &rows, at)?.base(),
        };
        let shift = DVec3::from_array(self.translate.unwrap_or_default());
        let motion = Similarity::about(pivot, rotation, scale, shift);
        if motion.is_identity() {
            return skipped("nothing would move");
        }
        within_range(bounds, at, |p| motion.point(p))?;
        let mut shadow = None;
        let is_part = rows.len() < state.len();
        let from = if is_part { some_place(bounds, at)?.centroid } else { DVec3::ZERO };
        if is_part {
            state.vacate(&rows, self.fill);
            run.unlit(state, at, "shadows stay where they were");
            shadow = run.lift_shadow(state, &rows, at);
        }
        transform(state, &rows, &motion);
        if let Some(shadow) = shadow {
            let moved = motion.point(from) - from;
            shadow.apply(&mut state.gaussians, moved, false, &rows);
        }
        applied(rows.len())
    }
}

fn rotation_of(op: &TransformOp) -> DQuat {
    if let Some(rotation) = &op.rotate_axis {
        let axis = DVec3::from_array(rotation.axis).normalize_or(DVec3::Z);
        return DQuat::from_axis_angle(axis, rotation.deg.to_radians());
    }
    if let Some([x, y, z]) = op.rotate_euler_deg.map(|e| e.map(f64::to_radians)) {
        // About the world's x first: the rightmost factor acts first.
        return DQuat::from_euler(EulerRot::ZYX, z, y, x);
    }
    match op.rotate_quaternion {
        Some([w, x, y, z]) => DQuat::from_xyzw(x, y, z, w).normalize(),
        None => DQuat::IDENTITY,
    }
}
