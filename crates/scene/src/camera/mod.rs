//! Intrinsics: how camera-frame directions map to pixels.
//!
//! To add a model: one row in the table of `model.rs` and its equations in `projection.rs`
//! (a distortion of the image plane goes to `distortion.rs`).

mod distortion;
mod model;
mod pinhole;
mod projection;

pub use model::CameraModel;
pub use pinhole::Pinhole;

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

    /// Focal lengths and principal point `[fx, fy, cx, cy]`, pixels; `None` for a panorama,
    /// which has none.
    ///
    /// # Panics
    /// When the number of parameters is not the model's.
    pub fn affine(&self) -> Option<[f64; 4]> {
        let p = &self.params;
        assert_eq!(p.len(), self.model.parameter_count(), "parameters of {}", self.model.name());
        match self.model.focal_count() {
            2 => Some([p[0], p[1], p[2], p[3]]),
            1 => Some([p[0], p[0], p[1], p[2]]),
            _ => None,
        }
    }

    /// The parameters after focal lengths and principal point: distortion, or a shape.
    pub fn distortion_params(&self) -> &[f64] {
        match self.model.focal_count() {
            0 => &[],
            focals => &self.params[focals + 2..],
        }
    }
}
