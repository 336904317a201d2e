//! Putting an asset into a scene so that it belongs there.

use glam::DVec3;
use motes_scene::Convention;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::insert::is_default;
use super::operation::{Flag, Operation, Short};
use crate::EditState;
use crate::changes::insert::{Asset, AssetSize};
use crate::changes::materials::material_named;
use crate::compose::{ScaleClue, heights, meters_per_unit};
use crate::run::{
    EditError, Fault, LightWanted, Outcome, PlaceDocument, Run, SurroundingsDocument, Wanted,
    direction, finite, flat, mesh_count, positive,
};

/// Two points whose distance is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnownLengthDocument {
    /// The one: a point, or what a pixel of a view shows.
    pub from: PlaceDocument,
    /// The other.
    pub to: PlaceDocument,
    /// Their distance, meters, above 0.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub meters: f64,
}

/// Add an asset at its size, on the ground, under the light of its place, with its shadow and bounce.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ComposeOp {
    /// A splat, a scene folder, or a triangle mesh (PLY with faces, glTF, OBJ).
    pub file: String,
    /// Name of the selection of what was inserted.
    #[serde(default, rename = "as", skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Where its base comes to stand: a point in world units, or the pixel of a view that shows it; default: free ground nearest to the
    /// middle of the scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<PlaceDocument>,
    /// Its own direction up. Default: what its scene folder says, +y for glTF and OBJ, else +z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// Degrees about the scene's up, counter-clockwise seen from above.
    #[serde(default)]
    pub rotate_deg: f64,
    /// Height that it gets, world units, above 0. Not together with `height_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub height: Option<f64>,
    /// Height that it gets, meters, above 0. Needs the length of a unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub height_m: Option<f64>,
    /// Length of a world unit, meters. Without a height the asset's own units are meters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub meters_per_unit: Option<f64>,
    /// Two points whose distance is known, such as foot and lintel of a door, instead of `meters_per_unit`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub known_length: Option<KnownLengthDocument>,
    /// Median height of the cameras of the capture above the ground, meters, instead of `meters_per_unit`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub camera_height_m: Option<f64>,
    /// Move it up or down so that it touches the ground below it.
    #[serde(default = "yes")]
    pub touch: bool,
    /// On a plain splat: a lat-long map of the light at the place, in linear camera units; default: estimated from splat and capture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub environment: Option<String>,
    /// Axes of that map, whose zenith is the scene's up.
    #[serde(default, skip_serializing_if = "is_own")]
    pub convention: Convention,
    /// Number of Gaussians that a mesh becomes; default: as fine as the photos show it at its place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 10_000_000))]
    pub gaussians: Option<u64>,
    /// Material of a mesh or splat that has none: a name of the library.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// What happens to ground that a splat brings along.
    #[serde(default, skip_serializing_if = "is_default")]
    pub surroundings: SurroundingsDocument,
}

fn yes() -> bool {
    true
}

fn is_own(convention: &Convention) -> bool {
    *convention == Convention::default()
}

impl Operation for ComposeOp {
    const FLAGS: &'static [Flag] = &[Flag::of(
        "compose",
        Short::Text("file"),
        "FILE",
        "Insert an asset at its size, touching the ground, lit as its place is; JSON for a scale in meters",
    )];
    const SHARED: &'static [&'static str] = &["at", "height", "surroundings"];

    fn check(&self) -> Result<(), Fault> {
        check_place("/at", self.at.as_ref())?;
        self.up.as_ref().map_or(Ok(()), |up| direction("/up", up))?;
        finite("/rotate_deg", &[self.rotate_deg])?;
        for (place, value) in [
            ("/height", self.height),
            ("/height_m", self.height_m),
            ("/meters_per_unit", self.meters_per_unit),
            ("/camera_height_m", self.camera_height_m),
            ("/known_length/meters", self.known_length.as_ref().map(|k| k.meters)),
        ] {
            value.map_or(Ok(()), |v| positive(place, v))?;
        }
        if let Some(known) = &self.known_length {
            check_place("/known_length/from", Some(&known.from))?;
            check_place("/known_length/to", Some(&known.to))?;
        }
        let clues = [
            self.meters_per_unit.is_some(),
            self.known_length.is_some(),
            self.camera_height_m.is_some(),
        ];
        let clues = clues.into_iter().filter(|given| *given).count();
        let fault = |place: &str, cause: &str| Err((place.into(), cause.into(), None));
        if clues > 1 {
            return fault(
                "",
                "one of \"meters_per_unit\", \"known_length\" and \"camera_height_m\" is enough",
            );
        }
        if self.height.is_some() && self.height_m.is_some() {
            return fault("/height_m", "\"height\" and \"height_m\" exclude each other");
        }
        if self.height_m.is_some() && clues == 0 {
            let cause = "a height in meters needs the length of a unit";
            let remedy = "give \"meters_per_unit\", \"known_length\" or \"camera_height_m\"";
            return Err(("/height_m".into(), cause.into(), Some(remedy.into())));
        }
        mesh_count(self.gaussians)
    }

    fn defines(&self) -> Option<(&'static str, &str)> {
        self.name.as_deref().map(|name| ("as", name))
    }

    fn files(&mut self) -> Vec<(String, &mut String)> {
        let light = self.environment.as_mut().map(|file| ("/environment".into(), file));
        std::iter::once(("/file".into(), &mut self.file)).chain(light).collect()
    }

    fn material(&self) -> Option<(&'static str, &str)> {
        self.material.as_deref().map(|name| ("material", name))
    }

    fn apply(
        &self,
        run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let material = self.material.as_deref();
        let surroundings = self.surroundings;
        let wanted =
            Wanted { file: &self.file, up: self.up, count: self.gaussians, material, surroundings };
        let mut asset = run.asset(&wanted, at)?;
        let meters = self.meters_per_unit(run, state, at)?;
        let size = self.size(run, state, &asset, meters, at);
        let to = match &self.at {
            Some(PlaceDocument::Point(to)) => DVec3::from_array(*to),
            Some(PlaceDocument::Pixel(pixel)) => run.shown_at(state, pixel, at)?,
            None => run.free_ground(state, &asset, size, at),
        };
        let placement = asset.placement(to, state.up_in_world, self.rotate_deg, size);
        let placement = placement.ok_or_else(|| flat(at))?;
        let pixel = run.pixel_at(&asset, &placement);
        if self.gaussians.is_none()
            && let Some(count) = asset.count_for_pixels(pixel)
        {
            asset.remake(count, material.and_then(material_named));
        }
        asset.pixel = pixel;
        let light = LightWanted {
            file: self.environment.as_deref(),
            convention: self.convention,
            touch: self.touch,
            meters_per_unit: meters,
        };
        run.compose(state, asset, placement, self.name.as_deref(), &light, at)
    }
}

impl ComposeOp {
    /// The length of a world unit, where something says it.
    fn meters_per_unit(
        &self,
        run: &Run<'_>,
        state: &EditState,
        at: &str,
    ) -> Result<Option<f64>, EditError> {
        let (clue, key) = if let Some(meters) = self.meters_per_unit {
            (ScaleClue::MetersPerUnit(meters), "meters_per_unit")
        } else if let Some(known) = &self.known_length {
            let from = run.point_of(state, &known.from, &format!("{at}/known_length/from"))?;
            let to = run.point_of(state, &known.to, &format!("{at}/known_length/to"))?;
            (ScaleClue::Length { from, to, meters: known.meters }, "known_length")
        } else if let Some(meters) = self.camera_height_m {
            (ScaleClue::CameraHeight(meters), "camera_height_m")
        } else {
            return Ok(None);
        };
        let (cameras, ground) = run.cameras_and_ground(state);
        let found = meters_per_unit(&clue, &cameras, state.up_in_world, ground);
        found.map(Some).ok_or_else(|| {
            EditError::plan(format!("{at}/{key}"), "this says nothing about the size of the scene")
                .remedy("points have to differ; camera heights need --capture and ground below the cameras")
        })
    }

    fn size(
        &self,
        run: &mut Run<'_>,
        state: &EditState,
        asset: &Asset,
        meters: Option<f64>,
        at: &str,
    ) -> AssetSize {
        match (self.height, self.height_m, meters) {
            (Some(height), _, _) => exactly(asset, height),
            (None, Some(height), Some(meters)) => exactly(asset, height / meters),
            (None, _, Some(meters)) => AssetSize::Factor(1.0 / meters),
            (None, _, None) => {
                run.tell_size(asset, state, at);
                AssetSize::Factor(1.0)
            }
        }
    }
}

/// The size that gives an asset a height: of its surface to the last vertex, of Gaussians but for strays.
fn exactly(asset: &Asset, height: f64) -> AssetSize {
    let own =
        asset.surface.as_ref().and_then(|s| heights(s, asset.up)).map(|(low, high)| high - low);
    match own.filter(|own| *own > 0.0) {
        Some(own) => AssetSize::Factor(height / own),
        None => AssetSize::Height(height),
    }
}

fn check_place(key: &str, place: Option<&PlaceDocument>) -> Result<(), Fault> {
    match place {
        Some(PlaceDocument::Point(at)) => finite(key, at),
        Some(PlaceDocument::Pixel(at)) => finite(&format!("{key}/pixel"), &at.pixel),
        None => Ok(()),
    }
}
