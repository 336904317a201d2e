//! What the page is told once: cameras, directions, what it may do.

use export::html::{ViewerPage, ViewerPhoto, ViewerSplat};
use glam::DVec3;
use serde_json::{Value, json};

use super::{materials, state};
use crate::session::{Scene, Session, Shown};

/// The manifest of the viewer, and beside it what the panel needs.
pub(super) fn manifest(session: &Session<'_>) -> Value {
    let [shown, original] = session.drawn();
    let scene = &session.scene;
    let page = ViewerPage {
        title: scene.title.clone(),
        splat: splat(session, &shown),
        other: None,
        photos: photos(scene),
        lights: Vec::new(),
        up_in_world: up_in_world(session),
        background: [0.0; 3],
    };
    let mut manifest = page.manifest(&[&shown.packed]);
    manifest["session"] = json!({
        "materials": materials(),
        "light": scene.own_light.is_some(),
        "maps": scene.maps.iter().map(|m| json!({"name": m.name, "file": m.file})).collect::<Vec<_>>(),
        "views": scene.capture.is_some(),
        "before": splat_entry(session, &original),
    });
    manifest["state"] = state::state(session);
    manifest
}

/// What the shaders need to know of Gaussians that are drawn.
pub(super) fn splat_entry(session: &Session<'_>, shown: &Shown) -> Value {
    let page = ViewerPage {
        title: String::new(),
        splat: splat(session, shown),
        other: None,
        photos: Vec::new(),
        lights: Vec::new(),
        up_in_world: DVec3::Z,
        background: [0.0; 3],
    };
    page.manifest(&[&shown.packed])["splats"][0].take()
}

fn splat<'s>(session: &Session<'_>, shown: &'s Shown) -> ViewerSplat<'s> {
    ViewerSplat { gaussians: &shown.gaussians, antialias: session.scene.antialias }
}

fn up_in_world(session: &Session<'_>) -> DVec3 {
    session.lock().history.state().up_in_world
}

/// Cameras of the views; the page asks for their pictures. Those with lens distortion are not drawn.
fn photos(scene: &Scene) -> Vec<ViewerPhoto> {
    let Some((capture, _)) = &scene.capture else { return Vec::new() };
    let photo = |view: usize| {
        let view = &capture.views[view];
        let camera = capture.cameras[view.camera].as_pinhole()?;
        Some(ViewerPhoto {
            name: view.name.clone(),
            camera,
            size: [camera.width, camera.height],
            camera_from_world: view.camera_from_world,
            jpeg: Vec::new(),
        })
    };
    scene.pinhole_views().into_iter().filter_map(photo).collect()
}
