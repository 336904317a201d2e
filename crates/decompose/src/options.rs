//! Dials of inverse rendering.

use clap::{Args, ValueEnum};
use motes_shading::brdf::Lobes;
use serde::{Deserialize, Serialize};

use crate::residual::ResidualOptions;

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

/// Whether a term of the image formation is modelled.
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

/// What `decompose` may vary.
#[derive(Clone, Debug, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct DecomposeOptions {
    /// Points of the surface that light and material are fitted to
    #[arg(long, default_value_t = 8000, value_name = "COUNT", help_heading = "Fit")]
    pub samples: usize,

    /// Rays per point and direction of view where materials are compared; two thirds towards the light
    #[arg(long, default_value_t = 96, value_name = "COUNT", help_heading = "Fit")]
    pub material_rays: u32,

    /// Rays per pixel of the photos where base colour is read off
    #[arg(long, default_value_t = 48, value_name = "COUNT", help_heading = "Fit")]
    pub pixel_rays: u32,

    /// Rays per side of a cell of the light; finer cells take fewer
    #[arg(long, default_value_t = 2, value_name = "COUNT", help_heading = "Fit")]
    pub light_rays: u32,

    /// How often cells of the light that matter are divided: 0 smooth light only (11 degrees), 3 a sun (1.4 degrees)
    #[arg(long, default_value_t = 3, value_name = "LEVELS", help_heading = "Fit")]
    pub light_levels: u32,

    /// Rounds that fit the light to what glossy things and metals reflect, as long as materials then explain the photos better; 0
    /// leaves it as shading tells
    #[arg(long, default_value_t = 2, value_name = "COUNT", help_heading = "Fit")]
    pub reflected_light_rounds: u32,

    /// Passes over the photos that bring base colours into the Gaussians
    #[arg(long, default_value_t = 12, value_name = "COUNT", help_heading = "Fit")]
    pub color_passes: u32,

    /// Steps, one photo each, that fit shapes, opacities and base colours of the Gaussians to the photos through the shading that
    /// was found, and the captured colours with them. 0 leaves shapes and captured colours as they are
    #[arg(long, default_value_t = 600, value_name = "COUNT", help_heading = "Fit")]
    pub photo_steps: u32,

    /// Steps, one photo each, that put what the model leaves unexplained onto the Gaussians, as a factor that depends on the
    /// direction of view. 0 leaves it out
    #[arg(long, default_value_t = 400, value_name = "COUNT", help_heading = "Fit")]
    pub residual_steps: u32,

    /// Degree of the spherical harmonics of that factor
    #[arg(long, default_value_t = 3, value_name = "DEGREE", help_heading = "Fit",
        value_parser = clap::value_parser!(u8).range(0..=4))]
    pub residual_degree: u8,

    /// Rounds that move the surface of what is not metal to where its shading is that of the photos; 0 leaves it as it was extracted
    #[arg(long, default_value_t = 3, value_name = "COUNT", help_heading = "Fit")]
    pub relief_rounds: u32,

    /// Rounds that turn the surface of metals to where it mirrors what the photos show; 0 leaves it as it was extracted
    #[arg(long, default_value_t = 1, value_name = "COUNT", help_heading = "Fit")]
    pub mirror_rounds: u32,

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

    /// One base colour per part of metal. Off, each pixel has its own, which fits the photos better and bakes reflections
    /// into it where the normals are wrong
    #[arg(long, default_value_t = true, action = clap::ArgAction::Set, value_name = "BOOL", help_heading = "Model")]
    pub uniform_metal: bool,

    /// Weight: neighbouring points of like chromaticity have one base colour
    #[arg(long, default_value_t = 1.0, value_name = "WEIGHT", help_heading = "Priors")]
    pub weight_base_color: f32,

    /// Weight: the light is smooth, but for few edges
    #[arg(long, default_value_t = 0.05, value_name = "WEIGHT", help_heading = "Priors")]
    pub weight_smooth_light: f32,

    /// Weight: the light is nearly white, on the whole
    #[arg(long, default_value_t = 0.1, value_name = "WEIGHT", help_heading = "Priors")]
    pub weight_white_light: f32,

    /// Weight: the light is what glossy things and metals reflect (--reflected-light-rounds)
    #[arg(long, default_value_t = 1.0, value_name = "WEIGHT", help_heading = "Priors")]
    pub weight_reflected_light: f32,

    /// Weight: base colours are in a usual range, 0.35 in the mean
    #[arg(long, default_value_t = 1.0, value_name = "WEIGHT", help_heading = "Priors")]
    pub weight_albedo_range: f32,

    /// What one more part of a roughness of its own costs (smooth roughness)
    #[arg(long, default_value_t = 20.0, value_name = "PRICE", help_heading = "Priors")]
    pub weight_smooth_roughness: f32,

    /// What calling a part metal costs (sparse metal)
    #[arg(long, default_value_t = 10.0, value_name = "PRICE", help_heading = "Priors")]
    pub weight_sparse_metal: f32,

    /// Weight: normals of metals are smooth, where they are told by what is mirrored
    #[arg(long, default_value_t = 8.0, value_name = "WEIGHT", help_heading = "Priors")]
    pub weight_smooth_normals: f32,

    /// Weight: what shading moves, it moves smoothly
    #[arg(long, default_value_t = 5.0, value_name = "WEIGHT", help_heading = "Priors")]
    pub weight_smooth_relief: f32,

    /// How far predicted normals (--prior-images) replace the surface's own, 0 to 1
    #[arg(long, default_value_t = 1.0, value_name = "WEIGHT", help_heading = "Priors")]
    pub weight_prior_normals: f32,

    /// Typical base colour, where nothing tells the scale of the light
    #[arg(long, default_value_t = 0.35, value_name = "VALUE", help_heading = "Priors")]
    pub typical_base_color: f32,
}

impl DecomposeOptions {
    /// How the residual is fitted.
    pub fn residual(&self, seed: u64) -> ResidualOptions {
        ResidualOptions { degree: self.residual_degree, steps: self.residual_steps, seed }
    }
}

impl Default for DecomposeOptions {
    fn default() -> Self {
        #[derive(clap::Parser)]
        struct Defaults {
            #[command(flatten)]
            options: DecomposeOptions,
        }
        // The defaults are written once, for the command line.
        <Defaults as clap::Parser>::parse_from([""]).options
    }
}
