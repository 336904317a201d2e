//! What the operations that bring something else in share.

use estimate_environment::place::training_views;
use glam::DVec3;
use motes_raster::{RenderOptions, render};
use motes_scene::{Capture, Pinhole, Pose};

use super::context::EditError;
use super::preview::whole_extent;
use super::targets::{keep, within_range};
use super::values::{PixelDocument, SurroundingsDocument};
use super::{Outcome, Run, applied};
use crate::changes::free_ground::free_place;
use crate::changes::ground;
use crate::changes::insert::{Asset, AssetSize, InsertNotes, insert};
use crate::changes::measure::Extent;
use crate::changes::surroundings::find_surroundings;
use crate::{EditState, Similarity};

/// What is inserted is usually as large as this times the scene.
const USUAL_SIZE: std::ops::Range<f64> = 0.02..5.0;

/// What an operation says about what it inserts.
pub(crate) struct Wanted<'a> {
    /// As the plan names it.
    pub(crate) file: &'a str,
    /// Its direction up, where the file does not say.
    pub(crate) up: Option<[f64; 3]>,
    /// Gaussians that a mesh becomes.
    pub(crate) count: Option<u64>,
    /// Of the library, for all of it.
    pub(crate) material: Option<&'a str>,
    /// Ground that a splat brings along.
    pub(crate) surroundings: SurroundingsDocument,
}

impl Run<'_> {
    /// Reads what an operation inserts.
    pub(crate) fn asset(&mut self, wanted: &Wanted<'_>, at: &str) -> Result<Asset, EditError> {
        let mut asset = self.resources.asset(wanted, at)?;
        // A mesh is what its maker made, and a scene folder what an edit left.
        if wanted.surroundings == SurroundingsDocument::Keep || asset.surface.is_some() {
            return Ok(asset);
        }
        let Some(found) = find_surroundings(&asset.gaussians, asset.up) else { return Ok(asset) };
        let (n, kept, ratio) = (asset.gaussians.len(), found.object.len(), found.ratio);
        let times = format!("its own ground is {ratio:.1} times as wide as what stands on it");
        if wanted.surroundings == SurroundingsDocument::Refuse {
            let cause = format!("this splat is a whole capture: {times}");
            return Err(EditError::plan(format!("{at}/file"), cause).remedy(
                "take the object out of it first (segment-select, then edit --extract), or give \
                 --surroundings crop, or keep to insert all of it",
            ));
        }
        self.warn(at, format!("{times}: {kept} of {n} Gaussians are inserted"));
        asset.gaussians.gather(&found.object);
        Ok(asset)
    }

    /// Size of a pixel at the place of an asset, in its own units, in the middle one of the photos; 0 where there are none.
    pub(crate) fn pixel_at(&self, asset: &Asset, placement: &Similarity) -> f64 {
        let (Some((capture, _)), Some(extent)) = (self.resources.capture, asset.extent()) else {
            return 0.0;
        };
        let place = placement.point(extent.base());
        let pixel = |(camera, pose): &(Pinhole, Pose)| pose.transform_point(place).z / camera.fx;
        let mut pixels: Vec<f64> =
            training_views(capture).iter().map(pixel).filter(|size| *size > 0.0).collect();
        pixels.sort_by(f64::total_cmp);
        pixels.get(pixels.len() / 2).map_or(0.0, |middle| middle / placement.scale)
    }

    /// Files of different makers have different units: what comes in far too small or too large was hardly meant so.
    pub(crate) fn tell_size(&mut self, asset: &Asset, state: &EditState, at: &str) {
        let size = |extent: Extent| extent.height().max(extent.footprint());
        let scene = whole_extent(&state.gaussians, state.up_in_world).map(size);
        let own = asset.extent().map(size);
        let (Some(scene), Some(own)) = (scene, own) else { return };
        let share = own / scene;
        if share.is_finite() && !USUAL_SIZE.contains(&share) {
            let text = format!(
                "what is inserted has {share:.2e} times the size of the scene: \"height\" or \"scale\" would change that"
            );
            self.warn(at, text);
        }
    }

    /// Brings the asset in and keeps it under its name.
    pub(crate) fn place(
        &mut self,
        state: &mut EditState,
        asset: Asset,
        placement: &Similarity,
        name: Option<&str>,
        at: &str,
    ) -> Result<Outcome, EditError> {
        within_range(asset.bounds(), at, |p| placement.point(p))?;
        let (selection, notes) = insert(state, asset, placement);
        self.tell(&notes, state, at);
        self.drop_ball_shadow(state, &selection.rows(), at);
        let n = selection.count();
        keep(state, name, selection);
        applied(n)
    }

    /// The free ground nearest to the middle of the scene.
    pub(crate) fn free_ground(
        &mut self,
        state: &EditState,
        asset: &Asset,
        size: AssetSize,
        at: &str,
    ) -> DVec3 {
        let up = state.up_in_world;
        let middle = whole_extent(&state.gaussians, up).map_or(DVec3::ZERO, |e| e.base());
        let Some(found) = ground::find_ground(&state.gaussians, up) else {
            self.warn(at, "no ground was found: it stands at the bottom of the scene");
            return middle;
        };
        let middle = middle + up * (found.height - middle.dot(up));
        let (scale, extent) = (asset.scale_for(size), asset.extent());
        let radius = scale.unwrap_or(1.0) * asset.reach();
        let height = scale.unwrap_or(1.0) * extent.map_or(0.0, |e| e.height());
        let free = free_place(&state.gaussians, &found, middle, radius, height);
        free.unwrap_or_else(|| {
            let text = format!(
                "there is no free ground for something {:.3} across: it stands in the middle of the scene, in what is there (\"at\" says where)",
                2.0 * radius
            );
            self.warn(at, text);
            middle
        })
    }

    /// The point that a pixel of a view shows; where its ray meets the ground when it is near it.
    pub(crate) fn shown_at(
        &self,
        state: &EditState,
        place: &PixelDocument,
        at: &str,
    ) -> Result<DVec3, EditError> {
        let fault = |key: &str, cause: String| EditError::plan(format!("{at}/at{key}"), cause);
        let Some((capture, _)) = self.resources.capture else {
            return Err(fault("/view", "a view of a capture needs a capture".into())
                .remedy("give --capture"));
        };
        let (camera, pose) = self.camera_of(capture, &place.view, &format!("{at}/at/view"))?;
        let [x, y] = place.pixel;
        let (width, height) = (camera.width, camera.height);
        if !((0.0..width as f64).contains(&x) && (0.0..height as f64).contains(&y)) {
            let cause = format!("pixel {x},{y} is outside the view, which has {width}x{height}");
            return Err(fault("/pixel", cause));
        }
        let options = RenderOptions {
            antialias: self.resources.antialias,
            aovs: true,
            ..RenderOptions::default()
        };
        let aovs = render(&state.gaussians, &camera, &pose, &options).aovs;
        let depth = aovs.map_or(0.0, |aovs| aovs.depth_median.pixel(x as usize, y as usize)[0]);
        if !(depth > 0.0) {
            return Err(fault("/pixel", "there is nothing at this pixel".into()));
        }
        let ray = DVec3::new((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0);
        let world_from_camera = pose.inverse();
        let along = |depth: f64| world_from_camera.transform_point(ray * depth);
        let point = along(f64::from(depth));
        let up = state.up_in_world;
        let Some(ground) = ground::find_ground(&state.gaussians, up) else { return Ok(point) };
        let (eye, far) = (along(0.0).dot(up), along(1.0).dot(up));
        let to_ground = (ground.height - eye) / (far - eye);
        let is_near =
            (point.dot(up) - ground.height).abs() <= ground::depth_slack(&state.gaussians, &ground);
        Ok(if is_near && to_ground > 0.0 && to_ground.is_finite() {
            along(to_ground)
        } else {
            point
        })
    }

    /// Camera and pose of a view of the capture; `at` leads to its name.
    pub(crate) fn camera_of(
        &self,
        capture: &Capture,
        name: &str,
        at: &str,
    ) -> Result<(Pinhole, Pose), EditError> {
        let view = capture.view_named(name).map(|view| &capture.views[view]).ok_or_else(|| {
            let known: Vec<_> =
                capture.views.iter().take(4).map(|v| format!("\"{}\"", v.name)).collect();
            let (n, known) = (capture.views.len(), known.join(", "));
            EditError::plan(at, format!("there is no view \"{name}\""))
                .remedy(format!("the first of the {n} views of the capture are {known}"))
        })?;
        let camera = capture.cameras[view.camera].as_pinhole();
        let camera = camera
            .ok_or_else(|| EditError::plan(at, "the camera of this view is not a pinhole"))?;
        Ok((camera, view.camera_from_world))
    }

    pub(crate) fn tell(&mut self, notes: &InsertNotes, state: &EditState, at: &str) {
        if notes.guessed_material {
            self.warn(
                at,
                "what was inserted has no material: its colors are taken for base colors",
            );
        }
        if notes.guessed_surface {
            self.warn(
                at,
                "what was inserted has no surface: squares stand for it, which cast its shadow",
            );
        }
        if !notes.filled_columns.is_empty() {
            let names = notes.filled_columns.join(", ");
            self.warn(at, format!("columns that only one side has are zero on the other: {names}"));
        }
        self.unlit(state, at, "what was inserted keeps its own and casts no shadow");
    }
}
