//! Options of the model that several steps share.

use clap::{ArgMatches, Args, Command};
use motes_scene::{Lobes, Switch};
use serde::{Deserialize, Serialize};

/// Terms of the image formation, and the usual range of base colors.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct ModelOptions {
    /// BRDF lobes of the materials
    #[arg(long, value_enum, default_value_t = Lobes::Burley, help_heading = "Model")]
    pub lobes: Lobes,

    /// Specular reflection of dielectrics
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub specular: Switch,

    /// Metallic materials
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub metallic: Switch,

    /// One bounce of indirect light
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub indirect: Switch,

    /// Sky in the photos: it is part of the light, and relight shows the new light there
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub sky: Switch,

    /// Shadows; turning them off measures their effect
    #[arg(long, default_value_t = true, action = clap::ArgAction::Set, value_name = "BOOL", help_heading = "Model")]
    pub visibility: bool,

    /// One base color per metallic segment. Without it, each pixel has its own, which fits the
    /// photos better and bakes reflections into it where normals are wrong
    #[arg(long, default_value_t = true, action = clap::ArgAction::Set, value_name = "BOOL", help_heading = "Model")]
    pub uniform_metal: bool,

    /// Weight of the prior that base colors stay in a usual range, around a mean of 0.35
    #[arg(long, default_value_t = 1.0, value_name = "WEIGHT", help_heading = "Priors (expert)")]
    pub weight_albedo_range: f32,

    /// Mean base color that sets the scale of the light when nothing else does
    #[arg(long, default_value_t = 0.35, value_name = "VALUE", help_heading = "Priors (expert)")]
    pub typical_base_color: f32,
}

impl Default for ModelOptions {
    fn default() -> Self {
        defaults()
    }
}

/// The defaults of a group of flags: they are written once, in the attributes.
pub(crate) fn defaults<T: Args>() -> T {
    let command = T::augment_args(Command::new("defaults").no_binary_name(true));
    let parsed = |matches: ArgMatches| T::from_arg_matches(&matches);
    match command.try_get_matches_from([""; 0]).and_then(parsed) {
        Ok(options) => options,
        Err(error) => unreachable!("a flag without a default: {error}"),
    }
}
