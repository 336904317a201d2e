//! What the page is told again and again.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use edit::changes::measure::Extent;
use serde_json::{Value, json};

use super::manifest::splat_entry;
use crate::session::{Quality, Session};

/// Whether what is drawn is what `edit` would make of the plan.
pub(super) fn is_settled(session: &Session<'_>) -> bool {
    let inner = session.lock();
    inner.shown.revision == inner.revision && inner.shown.quality == Quality::Standard
}

/// All of it but the selected Gaussians.
pub(super) fn state(session: &Session<'_>) -> Value {
    let (shown, mut value) = {
        let inner = session.lock();
        let history = &inner.history;
        let now = history.state();
        let selection = inner.selection().map(|(found, name)| {
            let extent = Extent::of(&now.gaussians, &found.rows(), now.up_in_world);
            json!({
                "count": found.count(),
                "name": name,
                "gestures": inner.pending.as_ref().map_or(0, |pending| pending.gestures),
                "pending": inner.pending.is_some(),
                "seconds": inner.pending.as_ref().map(|pending| pending.seconds),
                "centroid": extent.as_ref().map(|e| e.centroid.to_array()),
                "min": extent.as_ref().map(|e| e.min.to_array()),
                "max": extent.as_ref().map(|e| e.max.to_array()),
            })
        });
        let left = now.selections.iter().filter(|(name, s)| !name.is_empty() && s.count() > 0);
        let views = match &inner.views.index {
            _ if session.scene.capture.is_none() => json!("none"),
            Some(Ok(_)) if inner.views.geometry == Some(inner.geometry) => json!("ready"),
            Some(Err(why)) => json!(why),
            _ => json!("preparing"),
        };
        let steps: Vec<_> = history.steps().iter().map(|step| &step.op).collect();
        let value = json!({
            "serial": inner.serial,
            "revision": inner.revision,
            "settled": inner.shown.revision == inner.revision
                && inner.shown.quality == Quality::Standard,
            "steps": steps,
            "can_redo": history.undone() > 0,
            "selection": selection,
            "selections": left.map(|(name, _)| name).collect::<Vec<_>>(),
            "views": views,
            "views_seconds": inner.views.seconds,
            "failed": inner.failed == Some(inner.revision),
            "notice": inner.notice,
            "command": inner.command,
            "original": inner.original.id,
            "over": inner.over,
        });
        (std::sync::Arc::clone(&inner.shown), value)
    };
    value["drawn"] = json!({
        "id": shown.id,
        "revision": shown.revision,
        "quality": shown.quality,
        "seconds": shown.seconds,
        "warnings": shown.warnings,
        "splat": splat_entry(session, &shown),
    });
    value
}

/// The same with the selected Gaussians: what an act is answered with.
pub(super) fn state_with_mask(session: &Session<'_>) -> Value {
    let mut value = state(session);
    let id = value["drawn"]["id"].as_u64().unwrap_or_default();
    value["mask"] = session.mask(id).map_or(Value::Null, |bits| json!(STANDARD.encode(bits)));
    value
}
