//! One picture with its AOVs.

use motes_scene::{Gaussians, ImageF32, Pinhole, Pose};

use crate::aovs::tile_aovs;
use crate::frame::Frame;
use crate::options::{Modifiers, RenderOptions};
use crate::project::ViewTransform;

/// Depth and normals of a rendering.
#[derive(Clone, Debug, PartialEq)]
pub struct Aovs {
    /// Mean depth weighted by contribution, `[h, w, 1]`: camera z, world units; 0 where nothing is.
    pub depth_expected: ImageF32,
    /// Depth at which the transmittance passes 1/2, same units; 0 where it never does.
    pub depth_median: ImageF32,
    /// Unit normal in world axes, `[h, w, 3]`: shortest axes of the Gaussians, facing the camera,
    /// weighted by contribution; 0 where nothing is.
    pub normal_in_world: ImageF32,
}

/// A rendered view.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendering {
    /// `[h, w, 3]`, sRGB-encoded, over the background, may exceed 1.
    pub color: ImageF32,
    /// `[h, w, 1]` in [0, 1].
    pub alpha: ImageF32,
    /// Present when asked for.
    pub aovs: Option<Aovs>,
}

/// Renders `gaussians` through `camera` placed at `camera_from_world`.
///
/// Zero Gaussians, Gaussians with non-finite values and empty images are fine: what cannot be
/// drawn is left out.
pub fn render(
    gaussians: &Gaussians,
    camera: &Pinhole,
    camera_from_world: &Pose,
    options: &RenderOptions,
) -> Rendering {
    let view = ViewTransform::new(camera, camera_from_world);
    let mut frame = Frame::new();
    let planes = frame.forward(gaussians, &view, &Modifiers::default(), options);
    let color = planes.to_image(0, 3);
    let mut alpha = planes.to_image(3, 1);
    for value in &mut alpha.data {
        *value = 1.0 - *value;
    }
    let aovs = options.aovs.then(|| tile_aovs(&frame, gaussians, &view, &options.dials));
    Rendering { color, alpha, aovs }
}
