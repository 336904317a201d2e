//! What `decompose` reads.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::{Known, Photo, TracedSurface, ViewRays};
use clap::{Args, ValueEnum};
use glam::{DVec3, Vec3};
use motes_formats::capture::{read_capture, resolve};
use motes_formats::environment::read_environment;
use motes_formats::images::{read_image, read_mask};
use motes_formats::{FormatError, Result};
use motes_math::srgb;
use motes_scene::{Capture, ImageF32, ImageU8, Split, Surface};
use motes_shading::environment::{
    Convention, Environment, EnvironmentMap, MapOptions, Orientation,
};
use motes_shading::tracing::{Ray, Tracer};
use motes_stage::StageError;
use rayon::prelude::*;
use serde::{Deserialize, Serialize, Serializer};

use super::priors::{NormalFrame, Priors};

/// A channel from here on is clipped.
const CLIPPED: u8 = 254;

/// Axes of an environment map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LightConvention {
    /// OpenEXR, USD, Mitsuba: +y up, centre +z
    #[default]
    Openexr,
    /// Blender: +z up, centre +x
    Blender,
    /// Three.js: +y up, centre +x
    Threejs,
}

impl From<LightConvention> for Convention {
    fn from(convention: LightConvention) -> Self {
        match convention {
            LightConvention::Openexr => Self::OpenExr,
            LightConvention::Blender => Self::Blender,
            LightConvention::Threejs => Self::ThreeJs,
        }
    }
}

/// `VIEW,X,Y=R,G,B`: the base colour at a pixel of a view.
#[derive(Clone, Debug, PartialEq)]
pub struct AlbedoAnchor {
    view: String,
    x: f32,
    y: f32,
    base_color_linear: [f32; 3],
}

impl Serialize for AlbedoAnchor {
    /// As it is typed: a dumped configuration can be read again.
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let Self { view, x, y, base_color_linear: [r, g, b] } = self;
        serializer.collect_str(&format_args!("{view},{x},{y}={r},{g},{b}"))
    }
}

impl FromStr for AlbedoAnchor {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let form = "expected VIEW,X,Y=V or VIEW,X,Y=R,G,B with linear values from 0 to 1";
        let (place, values) = text.split_once('=').ok_or(form)?;
        let mut parts = place.rsplitn(3, ',');
        let mut number = || parts.next()?.trim().parse::<f32>().ok().filter(|v| v.is_finite());
        let (y, x) = (number().ok_or(form)?, number().ok_or(form)?);
        let view = parts.next().ok_or(form)?.to_owned();
        let values: Vec<f32> = values
            .split(',')
            .map(|v| v.trim().parse().map_err(|_| form))
            .collect::<std::result::Result<_, _>>()?;
        let base_color_linear = match values[..] {
            [v] => [v; 3],
            [r, g, b] => [r, g, b],
            _ => return Err(form.into()),
        };
        if !base_color_linear.iter().all(|v| *v > 0.0 && *v <= 1.0) {
            return Err(format!("base colours are above 0 and at most 1: {form}"));
        }
        Ok(Self { view, x, y, base_color_linear })
    }
}

/// What is known beforehand, as flags.
#[derive(Clone, Debug, Args, Serialize)]
pub struct KnownArgs {
    /// The light of the capture, when it is known (EXR or HDR, lat-long); once per --capture. It breaks the
    /// ambiguity of light and base colour
    #[arg(long, value_name = "FILE", help_heading = "Known")]
    pub environment: Vec<PathBuf>,

    /// Axes of --environment
    #[arg(long, value_enum, default_value_t, help_heading = "Known")]
    pub env_convention: LightConvention,

    /// Degrees by which --environment is turned about its up axis, counter-clockwise from above
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "DEGREES",
        allow_negative_numbers = true,
        help_heading = "Known"
    )]
    pub env_rotate: f64,

    /// Linear photo value per radiance of --environment
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR", help_heading = "Known")]
    pub env_exposure: f32,

    /// Base colour at a pixel, VIEW,X,Y=R,G,B (linear): sets the scale of light against base colour; repeatable
    #[arg(long, value_name = "ANCHOR", conflicts_with = "environment", help_heading = "Known")]
    pub albedo_anchor: Vec<AlbedoAnchor>,

    /// Folder of predictions by other tools: VIEW_albedo.png or .exr, of which only ratios within a photo are used, and
    /// VIEW_normal.png (0 to 255 for -1 to 1) or .exr; VIEW is the name of a photo without its suffix
    #[arg(long, value_name = "DIR", help_heading = "Known")]
    pub prior_images: Option<PathBuf>,

    /// Axes of the normals in --prior-images
    #[arg(long, value_enum, default_value_t, help_heading = "Known")]
    pub prior_normal_frame: NormalFrame,
}

/// Photos of one split of a capture, brought to the exposure of the model; `light` names their light.
///
/// # Errors
/// When a file cannot be read, its size is not that of its camera, or a camera is distorted.
pub(super) fn load_photos(
    document: &Path,
    capture: &Capture,
    split: Split,
    light: usize,
) -> Result<Vec<Photo>> {
    let views = capture.views_of(split);
    views.par_iter().map(|&view| load(document, capture, view, light)).collect()
}

fn load(document: &Path, capture: &Capture, view: usize, light: usize) -> Result<Photo> {
    let record = &capture.views[view];
    let camera = capture.cameras[record.camera].as_pinhole().ok_or_else(|| {
        let cause = format!("view \"{}\" has a distorted camera", record.name);
        FormatError::not_supported(document, "cameras", cause)
            .with_remedy("import the photos with import-colmap, which undistorts them")
    })?;
    let read = |path: &Path, image: Result<ImageU8>| {
        let image = image?;
        if (image.width, image.height) == (camera.width, camera.height) {
            return Ok(image);
        }
        let (w, h) = (image.width, image.height);
        let cause = format!(
            "the picture has {w}x{h} pixels and its camera {}x{}",
            camera.width, camera.height
        );
        Err(FormatError::invalid(path, "", cause).with_remedy("import the photos again"))
    };
    let path = resolve(document, &record.image);
    let image = read(&path, read_image(&path))?;
    let mask = match &record.mask {
        Some(mask) => {
            let path = resolve(document, mask);
            Some(read(&path, read_mask(&path))?)
        }
        None => None,
    };
    let gain = capture.exposure_gain(view).max(1e-3);
    let table: Vec<f32> = (0..=255u8).map(|v| srgb::decode(f32::from(v) / 255.0 / gain)).collect();
    // A fourth channel is alpha: what is transparent there tells nothing.
    let usable = |(i, pixel): (usize, &[u8])| {
        let masked = mask.as_ref().is_some_and(|mask| mask.data[i] < 128);
        let transparent = pixel.get(3).is_some_and(|alpha| *alpha < 128);
        f32::from(u8::from(!masked && !transparent && pixel[..3].iter().all(|v| *v < CLIPPED)))
    };
    let pixels = || image.data.chunks_exact(image.channels);
    let weight = pixels().enumerate().map(usable).collect();
    let radiance =
        pixels().flat_map(|p| [p[0], p[1], p[2]]).map(|v| table[usize::from(v)]).collect();
    Ok(Photo {
        name: record.name.clone(),
        camera,
        camera_from_world: record.camera_from_world,
        radiance_linear: ImageF32::from_data(camera.width, camera.height, 3, radiance),
        light,
        weight: ImageF32::from_data(camera.width, camera.height, 1, weight),
    })
}

/// Reads what the flags name.
///
/// # Errors
/// When a file cannot be read, the numbers of captures and lights differ, or an anchor names no view or misses the
/// surface.
pub(super) fn load_known(
    args: &KnownArgs,
    captures: usize,
    photos: &[Photo],
    surface: &Surface,
) -> anyhow::Result<Known> {
    let mut known = Known::default();
    if !args.environment.is_empty() && args.environment.len() != captures {
        let text = format!("{} captures and {} lights", captures, args.environment.len());
        return Err(StageError::usage(text)
            .help("give --environment once per --capture, or not at all")
            .into());
    }
    for path in &args.environment {
        let image = read_environment(path)?;
        let orientation = Orientation::new(args.env_convention.into()).rotated(args.env_rotate);
        let options = MapOptions { exposure: args.env_exposure, orientation };
        let map =
            EnvironmentMap::new(&image, &options).map_err(|e| StageError::usage(e.to_string()))?;
        known.lights.push(Environment::new(Some(map), None));
    }
    if let (Some(first), false) = (args.albedo_anchor.first(), surface.triangles.is_empty()) {
        let traced = TracedSurface::new(surface.clone())?;
        for anchor in &args.albedo_anchor {
            known
                .anchors
                .push((anchor.position(photos, &traced)?, anchor.base_color_linear.into()));
        }
        tracing::debug!("anchored at {first:?}");
    }
    if let Some(folder) = &args.prior_images {
        let priors = Priors::load(folder, photos, args.prior_normal_frame)?;
        known.base_color_priors = priors.base_color;
        known.normal_priors = priors.normals;
    }
    Ok(known)
}

impl AlbedoAnchor {
    fn position(&self, photos: &[Photo], surface: &TracedSurface) -> anyhow::Result<Vec3> {
        let Some(photo) = photos.iter().find(|p| p.name == self.view) else {
            let text = format!(
                "--albedo-anchor names the view \"{}\", which is no training photo",
                self.view
            );
            return Err(StageError::usage(text).into());
        };
        let rays = ViewRays::new(photo);
        let ray = Ray::new(rays.eye, rays.direction(self.x, self.y));
        let hit = surface.tracer.closest_hit(&ray).ok_or_else(|| {
            StageError::usage(format!(
                "--albedo-anchor {},{},{} meets no surface",
                self.view, self.x, self.y
            ))
        })?;
        Ok(ray.at(hit.distance))
    }
}

/// Reads a capture whose world must be that of the first.
///
/// # Errors
/// When it cannot be read, or its origin differs.
pub(super) fn load_capture(path: &Path, origin: Option<DVec3>) -> anyhow::Result<Capture> {
    let capture = read_capture(path)?;
    if origin.is_some_and(|origin| {
        (origin - capture.world_origin).length() > 1e-9 * origin.length().max(1.0)
    }) {
        let cause = "its origin is not that of the first capture";
        return Err(FormatError::invalid(path, "world_origin", cause)
            .with_remedy("import both captures into one world, with one --origin")
            .into());
    }
    Ok(capture)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anchors_are_parsed() {
        let anchor: AlbedoAnchor = "a,b.png,10,20.5=0.5".parse().expect("an anchor");
        assert_eq!((anchor.view.as_str(), anchor.x, anchor.y), ("a,b.png", 10.0, 20.5));
        assert_eq!(anchor.base_color_linear, [0.5; 3]);
        for bad in ["a.png,1,2", "a.png,1=0.5", "a,1,2=0", "a,1,2=1,2", "a,1,x=0.5", "a,1,2=1.5"] {
            assert!(bad.parse::<AlbedoAnchor>().is_err(), "{bad}");
        }
    }
}
