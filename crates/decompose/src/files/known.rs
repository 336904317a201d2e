//! What is known beforehand, as flags and files.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::{BaseColorAnchor, Known, Photo};
use clap::Args;
use motes_formats::environment::read_environment;
use motes_formats::ply::read_surface;
use motes_protocol::{ProviderFlags, ProviderUse};
use motes_scene::view_among;
use motes_shading::environment::{Convention, Environment, EnvironmentMap, MapOptions};
use motes_stage::{Context, StageError};
use relight::EnvUp;
use serde::{Serialize, Serializer};

use super::predictions::{Predicted, predict};
use super::priors::{NormalFrame, Priors};
use crate::prior_agreement::{LEAST_CORRELATION, edge_correlation};

/// `VIEW,X,Y=R,G,B`: the base color at a pixel of a view.
#[derive(Clone, Debug, PartialEq)]
pub struct AlbedoAnchor {
    view: String,
    x: f32,
    y: f32,
    base_color_linear: [f32; 3],
}

impl Serialize for AlbedoAnchor {
    /// As it is typed: a dumped configuration can be read again.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self { view, x, y, base_color_linear: [r, g, b] } = self;
        serializer.collect_str(&format_args!("{view},{x},{y}={r},{g},{b}"))
    }
}

impl FromStr for AlbedoAnchor {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let form = "expected VIEW,X,Y=V or VIEW,X,Y=R,G,B with linear values from 0 to 1";
        let (place, values) = text.split_once('=').ok_or(form)?;
        let mut parts = place.rsplitn(3, ',');
        let mut number = || parts.next()?.trim().parse::<f32>().ok().filter(|v| v.is_finite());
        let (y, x) = (number().ok_or(form)?, number().ok_or(form)?);
        let view = parts.next().ok_or(form)?.to_owned();
        let values: Vec<f32> = values
            .split(',')
            .map(|v| v.trim().parse().map_err(|_| form))
            .collect::<Result<_, _>>()?;
        let base_color_linear = match values[..] {
            [v] => [v; 3],
            [r, g, b] => [r, g, b],
            _ => return Err(form.into()),
        };
        if !base_color_linear.iter().all(|v| *v > 0.0 && *v <= 1.0) {
            return Err(format!("base colors are above 0 and at most 1: {form}"));
        }
        Ok(Self { view, x, y, base_color_linear })
    }
}

/// What is known beforehand, as flags.
#[derive(Clone, Debug, Args, Serialize)]
pub struct KnownArgs {
    /// Known capture illumination (EXR or HDR, lat-long), once per --capture; it resolves the
    /// ambiguity between light and base color
    #[arg(long, value_name = "FILE", help_heading = "Known quantities")]
    pub environment: Vec<PathBuf>,

    /// Axes of --environment
    #[arg(long, value_enum, default_value_t, help_heading = "Known quantities")]
    pub env_convention: Convention,

    /// Where the zenith of --environment is: scene (the up that is found), map (the up axis of the convention,
    /// no axis moves), an axis of the world (z, -y, ...) or a vector X,Y,Z
    #[arg(
        long,
        value_name = "UP",
        default_value = "scene",
        allow_hyphen_values = true,
        help_heading = "Known quantities"
    )]
    pub env_up: EnvUp,

    /// Rotation of --environment about its up axis in degrees, counterclockwise seen from above
    #[arg(
        long,
        visible_alias = "env-heading",
        default_value_t = 0.0,
        value_name = "DEGREES",
        allow_negative_numbers = true,
        help_heading = "Known quantities"
    )]
    pub env_rotate: f64,

    /// Linear photo value per unit of radiance of --environment
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR", help_heading = "Known quantities")]
    pub env_exposure: f32,

    /// Known base color at a pixel, VIEW,X,Y=R,G,B (linear): sets the scale between light and base
    /// color; repeatable
    #[arg(
        long,
        value_name = "ANCHOR",
        conflicts_with = "environment",
        help_heading = "Known quantities"
    )]
    pub albedo_anchor: Vec<AlbedoAnchor>,

    /// Folder of predictions by other tools: VIEW_albedo.png or .exr, which tell only what points of a
    /// photo differ, and VIEW_normal.png (0 to 255 for -1 to 1) or .exr; VIEW is the name of a
    /// photo without its suffix
    #[arg(long, value_name = "DIR", help_heading = "Known quantities")]
    pub prior_images: Option<PathBuf>,

    /// Program that predicts them, in place of --prior-images
    #[command(flatten)]
    #[serde(flatten)]
    pub provider: ProviderFlags,

    /// What --provider predicts
    #[arg(
        long,
        value_enum,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "normal,base-color",
        help_heading = "Provider (expert)"
    )]
    pub predict: Vec<Predicted>,

    /// Axes of the normals in --prior-images
    #[arg(long, value_enum, default_value_t, help_heading = "Known quantities")]
    pub prior_normal_frame: NormalFrame,
}

/// Reads what the flags name.
///
/// # Errors
/// When a file cannot be read, the numbers of captures and lights differ, or an anchor names no view.
pub(super) fn load_known(
    args: &KnownArgs,
    surface: Option<&Path>,
    captures: usize,
    photos: &[Photo],
    context: &Context,
) -> anyhow::Result<(Known, Option<ProviderUse>)> {
    let mut known = Known::default();
    if let Some(path) = surface {
        context.input("surface", path)?;
        known.surface = Some(read_surface(path)?);
    }
    if !args.environment.is_empty() && args.environment.len() != captures {
        let text = format!("{} captures and {} lights", captures, args.environment.len());
        return Err(StageError::usage(text)
            .help("give --environment once per --capture, or not at all")
            .into());
    }
    let convention = args.env_convention;
    if args.env_up == EnvUp::Scene {
        known.upright_lights = Some((convention, args.env_rotate));
    }
    for path in &args.environment {
        context.input("environment", path)?;
        let image = read_environment(path)?;
        let axes = args.env_up.axes(convention, convention.up());
        let orientation = axes.orientation().rotated(args.env_rotate);
        let options = MapOptions { exposure: args.env_exposure, orientation };
        let map =
            EnvironmentMap::new(&image, &options).map_err(|e| StageError::usage(e.to_string()))?;
        known.lights.push(Environment::new(Some(map), None));
    }
    for anchor in &args.albedo_anchor {
        known.anchors.push(anchor.among(photos)?);
    }
    let (priors, used) = load_priors(args, photos, context)?;
    if let Some(mut priors) = priors {
        leave_out_unrelated(&mut priors, photos, context);
        known.base_color_priors = priors.base_color;
        known.normal_priors = priors.normals;
    }
    Ok((known, used))
}

/// What other tools predicted, from files or from a provider. A dry run starts none.
fn load_priors(
    args: &KnownArgs,
    photos: &[Photo],
    context: &Context,
) -> anyhow::Result<(Option<Priors>, Option<ProviderUse>)> {
    let command = args.provider.command(context)?;
    match (&args.prior_images, command) {
        (Some(_), Some(_)) => {
            let text = "--prior-images and --provider both say what was predicted";
            Err(StageError::usage(text).help("give one of them").into())
        }
        (Some(folder), None) => {
            let priors = Priors::load(folder, photos, args.prior_normal_frame)?;
            Ok((Some(priors), None))
        }
        (None, Some(command)) if !context.dry_run() => {
            let (priors, used) = predict(command, &args.provider, &args.predict, photos, context)?;
            Ok((Some(priors), Some(used)))
        }
        (None, _) => Ok((None, None)),
    }
}

/// Predicted base colors whose edges are not those of their photo.
fn leave_out_unrelated(priors: &mut Priors, photos: &[Photo], context: &Context) {
    let mut left_out = 0;
    for (prior, photo) in priors.base_color.iter_mut().zip(photos) {
        let Some(base_color) = prior else { continue };
        let correlation =
            edge_correlation(base_color, &photo.radiance_linear.image(), &photo.usable);
        if correlation.is_some_and(|c| c < LEAST_CORRELATION) {
            *prior = None;
            left_out += 1;
        }
    }
    if left_out > 0 {
        context.warn(format!(
            "predicted base colors of {left_out} of {} photos have other edges than the photos and are left out",
            photos.len()
        ));
    }
}

impl KnownArgs {
    /// Views that are named, which have to be looked at.
    pub(super) fn anchored_views(&self) -> Vec<&str> {
        self.albedo_anchor.iter().map(|anchor| anchor.view.as_str()).collect()
    }
}

impl AlbedoAnchor {
    fn among(&self, photos: &[Photo]) -> Result<BaseColorAnchor, StageError> {
        let Self { view, x, y, base_color_linear } = self;
        let Some(photo) = view_among(photos.iter().map(|p| p.name.as_str()), view) else {
            let text =
                format!("--albedo-anchor names the view \"{view}\", which is not a training photo");
            return Err(StageError::usage(text));
        };
        Ok(BaseColorAnchor {
            label: format!("--albedo-anchor {view},{x},{y}"),
            photo,
            pixel: [*x, *y],
            base_color_linear: (*base_color_linear).into(),
        })
    }
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
