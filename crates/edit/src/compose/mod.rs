//! Putting an asset into a scene so that it belongs there: its size, its place, its light, and what it does to the light around.
//!
//! - `scale`: how long a unit of the scene is, from something whose size is known.
//! - `contact`: the ground below the asset, and the gap that is left.
//! - `local_light`: on a splat without decomposition, the light at the place, estimated from the splat; the asset is shaded by it.
//! - [`cast_shadow`]: its shadow and bounce on that splat, as the ratio of light with and without it.
//!
//! On a decomposed scene [`crate::reshade`] does the last two, with the scene's own surface and light.

mod contact;
mod local_light;
mod scale;
mod shadow;

pub use contact::{Contact, contact, heights};
pub use local_light::{LightAt, LocalLight, ground_patch, lit_asset};
pub use scale::{ScaleClue, meters_per_unit};
pub use shadow::{ShadowNumbers, cast_shadow};
