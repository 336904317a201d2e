//! Options of the model that several steps share.

use clap::{ArgMatches, Args, Command, ValueEnum};
use motes_shading::brdf::Lobes;
use serde::{Deserialize, Serialize};

/// Lobes of the materials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LobesChoice {
    /// Diffuse only
    Lambert,
    /// Diffuse under a coat that keeps the books
    Principled,
    /// The same coat over Burley's diffuse lobe, as Blender, Mitsuba and engines have it
    #[default]
    Burley,
}

impl From<LobesChoice> for Lobes {
    fn from(choice: LobesChoice) -> Self {
        match choice {
            LobesChoice::Lambert => Self::Lambert,
            LobesChoice::Principled => Self::Principled,
            LobesChoice::Burley => Self::Burley,
        }
    }
}

/// Whether a term of the image formation is modeled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TermChoice {
    /// As the photos ask for
    #[default]
    Auto,
    /// Always
    On,
    /// Never
    Off,
}

/// Terms of the image formation, and the usual range of base colors.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[group(skip)]
pub struct ModelOptions {
    /// Lobes of the materials
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub lobes: LobesChoice,

    /// Specular lobe
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub specular: TermChoice,

    /// Metals
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub metallic: TermChoice,

    /// One bounce of light from the surface itself
    #[arg(long, value_enum, default_value_t, help_heading = "Model")]
    pub indirect: TermChoice,

    /// Shadows; off is for measuring what they are worth
    #[arg(long, default_value_t = true, action = clap::ArgAction::Set, value_name = "BOOL", help_heading = "Model")]
    pub visibility: bool,

    /// One base color per part of metal. Off, each pixel has its own, which fits the photos better and bakes reflections
    /// into it where the normals are wrong
    #[arg(long, default_value_t = true, action = clap::ArgAction::Set, value_name = "BOOL", help_heading = "Model")]
    pub uniform_metal: bool,

    /// Weight: base colors are in a usual range, 0.35 in the mean
    #[arg(long, default_value_t = 1.0, value_name = "WEIGHT", help_heading = "Priors")]
    pub weight_albedo_range: f32,

    /// Typical base color, where nothing tells the scale of the light
    #[arg(long, default_value_t = 0.35, value_name = "VALUE", help_heading = "Priors")]
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
