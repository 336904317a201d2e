//! What composing does to a state: contact, light, shadow, numbers.

use std::collections::BTreeMap;

use estimate_environment::place::{self, PlaceOptions, Splat, training_views};
use glam::{DVec3, Vec3};
use motes_math::luminance::luminance;
use motes_scene::{Convention, Gaussians, ImageF32, Materials, Surface};
use motes_shading::environment::MapAxes;

use super::context::EditError;
use super::targets::{keep, within_range};
use super::values::PlaceDocument;
use super::{Outcome, Run};
use crate::changes::color::shown_linear;
use crate::changes::ground::{find_ground, rows_on};
use crate::changes::insert::{Asset, guessed_materials, insert};
use crate::changes::inset::inset;
use crate::changes::measure::Extent;
use crate::changes::mesh::surface_of;
use crate::changes::transform::transform_gaussians;
use crate::compose::{LightAt, LocalLight, cast_shadow, contact, ground_patch, heights, lit_asset};
use crate::{EditState, Similarity};

/// Height over the ground at which the light of a place is looked at, over the height of the asset.
const LIGHT_HEIGHT: f64 = 0.5;
/// Rows of the map of a place.
const LIGHT_ROWS: usize = 128;
/// A shadow reaches at most this many heights of the asset.
const LONGEST_SHADOW: f64 = 8.0;
/// Half the side of the patch of ground that the asset shades, over its footprint.
const PATCH: f64 = 3.0;

/// What an operation wants of light and contact.
pub(crate) struct LightWanted<'a> {
    /// A map of the light, for a plain splat.
    pub(crate) file: Option<&'a str>,
    /// Its axes.
    pub(crate) convention: Convention,
    /// Whether the gap to the ground is closed.
    pub(crate) touch: bool,
    /// For the numbers.
    pub(crate) meters_per_unit: Option<f64>,
}

type Numbers = BTreeMap<String, Option<f64>>;

fn put(numbers: &mut Numbers, name: &str, value: f64) {
    numbers.insert(name.to_owned(), Some(value).filter(|v| v.is_finite()));
}

impl Run<'_> {
    /// Centers of the cameras of the capture, and the height of the ground.
    pub(crate) fn cameras_and_ground(&self, state: &EditState) -> (Vec<DVec3>, Option<f64>) {
        let views = self.resources.capture.iter().flat_map(|(capture, _)| &capture.views);
        let cameras = views.map(|view| view.camera_from_world.center_in_world()).collect();
        let ground = find_ground(&state.gaussians, state.up_in_world);
        (cameras, ground.map(|ground| ground.height))
    }

    /// The point of a place.
    pub(crate) fn point_of(
        &self,
        state: &EditState,
        place: &PlaceDocument,
        at: &str,
    ) -> Result<DVec3, EditError> {
        match place {
            PlaceDocument::Point(point) => Ok(DVec3::from_array(*point)),
            PlaceDocument::Pixel(pixel) => self.shown_at(state, pixel, at),
        }
    }

    /// Brings an asset in, touching the ground; on a plain splat with light and shadow, which follow later on a decomposed scene.
    pub(crate) fn compose(
        &mut self,
        state: &mut EditState,
        mut asset: Asset,
        mut placement: Similarity,
        name: Option<&str>,
        wanted: &LightWanted<'_>,
        at: &str,
    ) -> Result<Outcome, EditError> {
        within_range(asset.bounds(), at, |p| placement.point(p))?;
        let up = state.up_in_world;
        let mut numbers = Numbers::new();
        let Some(mut extent) = placed(&asset, &placement, up).1 else {
            return Err(super::flat(at));
        };
        let ground = state.parts.as_ref().and_then(|_| state.sources.first()?.surface.clone());
        match contact(&state.gaussians, ground.as_deref(), up, &extent) {
            Some(found) => {
                put(&mut numbers, "gap_before", found.gap);
                let shift = if wanted.touch { found.shift } else { 0.0 };
                if shift != 0.0 {
                    placement.translation += up * shift;
                    extent = placed(&asset, &placement, up).1.unwrap_or(extent);
                }
                put(&mut numbers, "gap", extent.bottom - found.ground);
                if wanted.touch && found.shift == 0.0 && found.gap != 0.0 {
                    self.warn(at, format!("it hangs {:.3} above the ground below it", found.gap));
                }
            }
            None => self.warn(at, "there is no ground below it: the gap is not known"),
        }
        for (axis, value) in ["x", "y", "z"].into_iter().zip(extent.base().to_array()) {
            put(&mut numbers, &format!("base_{axis}"), value);
        }
        put(&mut numbers, "scale", placement.scale);
        put(&mut numbers, "height", extent.height());
        if let Some(meters) = wanted.meters_per_unit {
            put(&mut numbers, "meters_per_unit", meters);
            put(&mut numbers, "height_m", extent.height() * meters);
        }
        // After contact: what shows touches the ground.
        inset(&mut asset);
        let (selection, notes) = if state.parts.is_some() {
            insert(state, asset, &placement)
        } else {
            let moved = placed(&asset, &placement, up).0;
            let surface = moved_surface(&asset, &moved, &placement);
            let lit = self.lit(state, moved, &surface, &extent, wanted, &mut numbers, at)?;
            let lit = Asset { gaussians: lit, surface: None, ..asset };
            insert(state, lit, &Similarity::IDENTITY)
        };
        if state.parts.is_some() {
            self.tell(&notes, state, at);
        }
        let n = selection.count();
        keep(state, name, selection);
        Ok(Outcome::Applied(n as u64, numbers))
    }

    /// The asset's Gaussians (world) as the light of the place shows them; its shadow falls on the state.
    fn lit(
        &mut self,
        state: &mut EditState,
        mut moved: Gaussians,
        surface: &Surface,
        extent: &Extent,
        wanted: &LightWanted<'_>,
        numbers: &mut Numbers,
        at: &str,
    ) -> Result<Gaussians, EditError> {
        let up = state.up_in_world;
        let place = LightAt { base: extent.base(), up };
        let views = self.resources.capture.map(|(capture, _)| training_views(capture));
        let views = views.unwrap_or_default();
        let (map, axes) = self.map_at(state, &views, extent, wanted, numbers, at)?;
        let Some(light) = LocalLight::new(&map, axes, up) else {
            return Err(EditError::plan(format!("{at}/environment"), "the light is black"));
        };
        let radius = 0.5 * extent.footprint();
        let slope = light.to_lamp.dot(up).max(1e-3);
        let run = (1.0 - slope * slope).max(0.0).sqrt() / slope;
        let longest = extent.height() * run.clamp(4.0, LONGEST_SHADOW);
        let reach = radius + longest;
        let splat = Splat {
            gaussians: &state.gaussians,
            antialias: self.resources.antialias,
            views: &views,
            up_in_world: up,
        };
        let shadows = light.lamp_shadows(&splat, place.base, 1.5 * reach);
        let share = shadows.as_ref().map_or(1.0, |map| {
            let points = moved.means.iter().map(|m| Vec3::from(*m).as_dvec3());
            let n = moved.len().max(1) as f64;
            points.map(|p| map.visibility(p, light.to_lamp)).sum::<f64>() / n
        });
        let bad = |e: relight::SceneError| EditError::plan(format!("{at}/file"), e.to_string());
        let ground = ground_color(&state.gaussians, up, &place, 4.0 * radius);
        let mut with_ground = surface.clone();
        append(&mut with_ground, &ground_patch(&place, PATCH * extent.footprint(), ground, &light));
        let Some(environment) = light.with_lamp(share) else {
            return Err(EditError::plan(format!("{at}/environment"), "the light is broken"));
        };
        if Materials::of(&moved).is_err() {
            self.warn(at, "what is composed has no material: its colors are taken for base colors");
            guessed_materials(&moved).attach(&mut moved);
        }
        let baked = lit_asset(&moved, &with_ground, up, &environment, self.seed).map_err(bad)?;
        let half = find_ground(&state.gaussians, up).map_or(0.0, |g| g.half_thickness);
        let bounds = (reach, 2.0 * half.max(0.01 * extent.height()));
        let seed = self.seed;
        let cast = cast_shadow(
            &mut state.gaussians,
            &place,
            surface,
            &light,
            shadows.as_ref(),
            bounds,
            seed,
        );
        let cast = cast.map_err(bad)?;
        put(numbers, "lamp_share", share);
        put(numbers, "shadowed", cast.changed as f64);
        put(numbers, "deepest_shadow", cast.deepest);
        Ok(baked)
    }

    /// The map of the light at the place: of a file, or estimated.
    fn map_at(
        &mut self,
        state: &EditState,
        views: &[(motes_scene::Pinhole, motes_scene::Pose)],
        extent: &Extent,
        wanted: &LightWanted<'_>,
        numbers: &mut Numbers,
        at: &str,
    ) -> Result<(ImageF32, MapAxes), EditError> {
        let up = state.up_in_world;
        if let Some(file) = wanted.file {
            let image = self.resources.environment(file).map_err(EditError::file(at))?;
            return Ok((image, MapAxes::upright(wanted.convention, up)));
        }
        if views.is_empty() {
            let cause = "the light of a plain splat is estimated from the views of its capture";
            return Err(EditError::plan(at, cause)
                .remedy("give --capture, or \"environment\" with a map, or decompose the scene"));
        }
        let splat = Splat {
            gaussians: &state.gaussians,
            antialias: self.resources.antialias,
            views,
            up_in_world: up,
        };
        let axes = MapAxes::upright(Convention::default(), up);
        let options = PlaceOptions { rows: LIGHT_ROWS, seed: self.seed, ..PlaceOptions::default() };
        let point = extent.base() + up * (LIGHT_HEIGHT * extent.height());
        let found = place::estimate(&splat, point, axes, &options);
        put(numbers, "light_coverage", found.report.coverage);
        put(numbers, "clipped_factor", found.report.clipped_factor);
        Ok((found.map, axes))
    }
}

/// The Gaussians of an asset in the world and how far they reach, in height as exactly as its surface tells.
fn placed(asset: &Asset, placement: &Similarity, up: DVec3) -> (Gaussians, Option<Extent>) {
    let mut moved = asset.gaussians.clone();
    let rows: Vec<u32> = (0..moved.len() as u32).collect();
    transform_gaussians(&mut moved, &rows, placement);
    let extent = Extent::of(&moved, &rows, up).map(|extent| {
        let surface = asset.surface.as_ref();
        let exact = surface.and_then(|surface| heights(&in_world(surface, placement), up));
        let (bottom, top) = exact.unwrap_or((extent.bottom, extent.top));
        Extent { bottom, top, ..extent }
    });
    (moved, extent)
}

/// Mean color of the ground around a place, linear.
fn ground_color(gaussians: &Gaussians, up: DVec3, place: &LightAt, reach: f64) -> Vec3 {
    let Some(ground) = find_ground(gaussians, up) else { return Vec3::splat(0.2) };
    let near = rows_on(gaussians, &ground).into_iter().filter(|row| {
        let p = Vec3::from(gaussians.means[*row as usize]).as_dvec3();
        p.distance(place.base) < reach
    });
    let colors: Vec<Vec3> =
        near.map(|row| Vec3::from(shown_linear(gaussians.sh_of(row as usize)))).collect();
    let bright = |c: &Vec3| luminance(c.to_array());
    // The brighter half: the patch is what the light shows, without the shadows that lie on it.
    let mut colors = colors;
    colors.sort_by(|a, b| bright(b).total_cmp(&bright(a)));
    let half = colors.len().div_ceil(2);
    if half == 0 { Vec3::splat(0.2) } else { colors[..half].iter().sum::<Vec3>() / half as f32 }
}

/// The surface of an asset in the world.
fn moved_surface(asset: &Asset, moved: &Gaussians, placement: &Similarity) -> Surface {
    let Some(surface) = &asset.surface else {
        let materials = Materials::of(moved).unwrap_or_else(|_| guessed_materials(moved));
        return surface_of(moved, &materials);
    };
    in_world(surface, placement)
}

fn in_world(surface: &Surface, placement: &Similarity) -> Surface {
    let mut surface = surface.clone();
    for vertex in &mut surface.vertices {
        *vertex = placement.point(Vec3::from(*vertex).as_dvec3()).as_vec3().to_array();
    }
    for normal in &mut surface.normals {
        *normal = placement.direction(Vec3::from(*normal).as_dvec3()).as_vec3().to_array();
    }
    surface
}

fn append(surface: &mut Surface, part: &Surface) {
    let first = surface.vertices.len() as u32;
    surface.vertices.extend_from_slice(&part.vertices);
    surface.normals.extend_from_slice(&part.normals);
    surface.base_color_linear.extend_from_slice(&part.base_color_linear);
    surface.roughness.extend_from_slice(&part.roughness);
    surface.metallic.extend_from_slice(&part.metallic);
    surface.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
}
