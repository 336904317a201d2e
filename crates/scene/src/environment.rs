//! The environment map: its axes, and what its scale rests on.

use clap::ValueEnum;
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Axes of a lat-long map, see `docs/methods/shading.md`.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
#[value(rename_all = "lower")]
pub enum Convention {
    /// OpenEXR, USD, Mitsuba: +y up, center +z.
    #[default]
    OpenExr,
    /// Blender: +z up, center +x.
    Blender,
    /// three.js: +y up, center +x.
    ThreeJs,
}

impl Convention {
    /// The axis of the world that is up when the map's axes are the world's.
    pub fn up(self) -> DVec3 {
        match self {
            Self::OpenExr | Self::ThreeJs => DVec3::Y,
            Self::Blender => DVec3::Z,
        }
    }
}

/// What the scale of light against base color rests on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ScaleAnchor {
    /// The light was given.
    #[default]
    Environment,
    /// A base color was given.
    AlbedoAnchor,
    /// Highlights: dielectrics reflect a known share.
    Specular,
    /// The sky, as photos show it.
    Sky,
    /// Nothing but what base colors usually are.
    Prior,
}
