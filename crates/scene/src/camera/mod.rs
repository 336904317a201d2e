//! Intrinsics: how camera-frame directions map to pixels.
//!
//! To add a model: one arm in [`CameraModel`] with its COLMAP id, name and parameter count, and
//! its equations in a file of this folder.

mod pinhole;

pub use pinhole::Pinhole;

/// Camera model, with COLMAP's names and parameter orders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "names are COLMAP's; parameters are listed by `parameter_names`")]
pub enum CameraModel {
    SimplePinhole,
    Pinhole,
    SimpleRadial,
    Radial,
    Opencv,
    OpencvFisheye,
    FullOpencv,
    Fov,
    SimpleRadialFisheye,
    RadialFisheye,
    ThinPrismFisheye,
    RadTanThinPrismFisheye,
    SimpleDivision,
    Division,
    SimpleFisheye,
    Fisheye,
    Eucm,
    Equirectangular,
}

/// Intrinsics of one physical camera; no pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Projection and distortion model.
    pub model: CameraModel,
    /// Image width, pixels.
    pub width: usize,
    /// Image height, pixels.
    pub height: usize,
    /// Parameters in the model's order; lengths in pixels.
    pub params: Vec<f64>,
}

impl Camera {
    /// A pinhole camera.
    pub fn from_pinhole(p: Pinhole) -> Self {
        Self {
            model: CameraModel::Pinhole,
            width: p.width,
            height: p.height,
            params: vec![p.fx, p.fy, p.cx, p.cy],
        }
    }

    /// The intrinsics as a pinhole, when the model has no distortion.
    pub fn as_pinhole(&self) -> Option<Pinhole> {
        let (width, height) = (self.width, self.height);
        match (self.model, self.params.as_slice()) {
            (CameraModel::Pinhole, &[fx, fy, cx, cy]) => {
                Some(Pinhole { fx, fy, cx, cy, width, height })
            }
            (CameraModel::SimplePinhole, &[f, cx, cy]) => {
                Some(Pinhole { fx: f, fy: f, cx, cy, width, height })
            }
            _ => None,
        }
    }
}
