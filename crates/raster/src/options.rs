//! Constants of the image formation and the parameters of a rendering.

use crate::parameters::RasterParameters;

/// Side of a square tile, pixels. Larger tiles sort less and test more pixels in vain.
pub const TILE: usize = 16;
/// Alpha never reaches 1, so that `1 / (1 - alpha)` stays bounded (Kerbl et al. 2023).
pub const ALPHA_MAX: f32 = 0.99;
/// Fainter contributions are dropped: one step of an 8-bit image.
pub const ALPHA_MIN: f32 = 1.0 / 255.0;
/// A pixel is finished once its transmittance falls below this.
pub const TRANSMITTANCE_MIN: f32 = 1e-4;
/// Variance added to every projected Gaussian, px², so that none is thinner than a pixel.
pub const BLUR_VARIANCE_PX2: f32 = 0.3;

/// How the pixel footprint enters the projected Gaussian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Antialias {
    /// Blur only, opacity unchanged: what INRIA-compatible viewers show.
    #[default]
    Classic,
    /// Blur with the opacity scaled by `sqrt(det Σ / det(Σ + blur))`, so that a small Gaussian
    /// keeps its energy (Yu et al. 2024, Mip-Splatting, 2D filter).
    Mip,
}

/// What a rendering may vary.
#[derive(Clone, Debug)]
pub struct RenderOptions {
    /// Color behind everything, sRGB-encoded like the Gaussians' colors.
    pub background: [f32; 3],
    /// Use at most this SH degree.
    pub sh_degree_limit: Option<u8>,
    /// Gaussians nearer than this are not drawn, world units along the view axis.
    pub near: f32,
    /// Pixel footprint model.
    pub antialias: Antialias,
    /// Also produce depth and normals.
    pub aovs: bool,
    /// Time against accuracy.
    pub parameters: RasterParameters,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            background: [0.0; 3],
            sh_degree_limit: None,
            near: 0.0,
            antialias: Antialias::Classic,
            aovs: false,
            parameters: RasterParameters::default(),
        }
    }
}

/// Per-Gaussian factors that belong to the fitting, not to the model.
#[derive(Clone, Copy, Debug, Default)]
pub struct Modifiers<'a> {
    /// 3D smoothing filter, standard deviation in world units per Gaussian (Mip-Splatting).
    pub filter_3d: Option<&'a [f32]>,
    /// Factor on the opacity per Gaussian; 0 drops it (Gaussian dropout).
    pub opacity_gain: Option<&'a [f32]>,
}

impl<'a> Modifiers<'a> {
    /// With these widths of the 3D smoothing filter; none when there are none.
    pub fn with_filter(filter_3d: &'a [f32]) -> Self {
        Self { filter_3d: (!filter_3d.is_empty()).then_some(filter_3d), opacity_gain: None }
    }
}

impl Modifiers<'_> {
    #[inline]
    pub(crate) fn filter_3d(&self, i: usize) -> f32 {
        self.filter_3d.map_or(0.0, |values| values[i])
    }

    #[inline]
    pub(crate) fn opacity_gain(&self, i: usize) -> f32 {
        self.opacity_gain.map_or(1.0, |values| values[i])
    }
}
