//! The image formation of relighting:
//!
//! `L_o(x, w_o) = ∫ f_r(w_i, w_o) L_i(x, w_i) (n · w_i)⁺ dw_i` (Kajiya 1986).
//!
//! `f_r` is in [`brdf`], `L_i` in [`environment`], visibility in [`tracing`], the integral in
//! [`integrate`]. Everything exists twice: a readable f64 reference, and an f32 path that
//! is tested against it. `docs/methods/shading.md` has conventions, equations with their papers
//! and approximations, `docs/benchmarks/shading.md` the costs.
//!
//! Directions point away from the surface: `w_o` (`to_viewer`) toward the camera, `w_i`
//! (`to_light`) toward the light. Colors and radiances are linear, Rec. 709 primaries.

mod alias;
pub mod brdf;
pub mod emitters;
pub mod environment;
pub mod frame;
pub mod integrate;
pub mod sampling;
pub mod tracing;
