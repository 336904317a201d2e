//! The scene card: what is in a scene, measured.

mod frame;
mod light;
mod object;
mod relations;
mod views;

use glam::DVec3;
use motes_formats::documents::Document as _;
use motes_formats::labels::LabelDocument;
use motes_formats::scene_card::SceneCardDocument;
use motes_raster::Antialias;
use motes_scene::{Capture, Gaussians, ImageF32, Selection};
use motes_shading::environment::MapAxes;

use crate::language::named_lights;

/// An object with a name.
#[derive(Clone, Debug)]
pub struct Labeled {
    /// What it is called.
    pub label: LabelDocument,
    /// Its Gaussians.
    pub selection: Selection,
    /// Height along up of what it stands on, world units, where its selection says so.
    pub ground: Option<f64>,
}

/// What a card is made from.
pub struct CardInput<'a> {
    /// The scene.
    pub gaussians: &'a Gaussians,
    /// Whether its materials are known.
    pub decomposed: bool,
    /// Unit vector away from the ground.
    pub up: DVec3,
    /// The footprint to draw the Gaussians with.
    pub antialias: Antialias,
    /// Cameras, and the view that says what left and right are.
    pub capture: Option<(&'a Capture, usize)>,
    /// The objects.
    pub labeled: &'a [Labeled],
    /// The light of a decomposed scene.
    pub environment: Option<(&'a ImageF32, MapAxes)>,
    /// Meters per world unit.
    pub meters_per_unit: Option<f64>,
    /// Files that may be inserted.
    pub assets: Vec<String>,
}

/// Measures a scene.
///
/// # Errors
/// An object has no Gaussian with a place: its name.
pub fn scene_card(input: &CardInput<'_>) -> Result<SceneCardDocument, String> {
    let frame = frame::frame(input.capture, input.up);
    let mut objects = object::objects(input, &frame)?;
    views::best_views(input, &mut objects);
    let relations = relations::relations(&objects, &frame);
    Ok(SceneCardDocument {
        format: SceneCardDocument::FORMAT.into(),
        version: SceneCardDocument::version(),
        made_by: concat!("motes instruct ", env!("CARGO_PKG_VERSION")).into(),
        decomposed: input.decomposed,
        meters_per_unit: input.meters_per_unit,
        relations,
        light: input.environment.and_then(|(map, axes)| light::light(map, axes, &frame)),
        frame,
        objects,
        lights: named_lights(),
        assets: input.assets.clone(),
    })
}
