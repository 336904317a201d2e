//! Intrinsics as the JSON gives them, and the camera they make with an image size.

use motes_scene::{Camera, CameraModel};

use super::document::IntrinsicKeys;
use crate::colmap::MAX_IMAGE_SIDE;

/// Intrinsics of a frame. The size may be missing: then it is that of the photo.
#[derive(Clone, Debug, PartialEq)]
pub struct Intrinsics {
    /// Projection; the distortion says whether a perspective camera needs more than a pinhole.
    model: Projection,
    /// Width and height in pixels, when the file has them.
    pub size: Option<(usize, usize)>,
    focal: Focal,
    center: (Option<f64>, Option<f64>),
    k: [f64; 4],
    p: [f64; 2],
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Projection {
    Perspective,
    Fisheye,
    Equirectangular,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Focal {
    Pixels(f64, f64),
    /// Fields of view along x and, if different pixels are not square, y; radians.
    Angles(f64, Option<f64>),
    None,
}

impl Intrinsics {
    pub(super) fn of(shared: &IntrinsicKeys, own: &IntrinsicKeys) -> Result<Self, String> {
        let pick = |get: fn(&IntrinsicKeys) -> Option<f64>| get(own).or(get(shared));
        let number = |name: &str, get: fn(&IntrinsicKeys) -> Option<f64>| match pick(get) {
            Some(value) if !value.is_finite() => Err(format!("{name} is not finite")),
            value => Ok(value),
        };
        let length = |name: &str, get: fn(&IntrinsicKeys) -> Option<f64>| match pick(get) {
            Some(value) if !(1e-3..=1e7).contains(&value) => {
                Err(format!("{name} is {value}, which is not a length in pixels"))
            }
            value => Ok(value),
        };
        let angle = |name: &str, get: fn(&IntrinsicKeys) -> Option<f64>| match pick(get) {
            Some(value) if !(value > 1e-6 && value < std::f64::consts::PI) => {
                Err(format!("{name} is {value}, which is not a field of view in radians"))
            }
            value => Ok(value),
        };
        let model = projection(shared, own)?;
        let k = [
            number("k1", |keys| keys.k1)?.unwrap_or(0.0),
            number("k2", |keys| keys.k2)?.unwrap_or(0.0),
            number("k3", |keys| keys.k3)?.unwrap_or(0.0),
            number("k4", |keys| keys.k4)?.unwrap_or(0.0),
        ];
        let p = [
            number("p1", |keys| keys.p1)?.unwrap_or(0.0),
            number("p2", |keys| keys.p2)?.unwrap_or(0.0),
        ];
        if model == Projection::Perspective && k[3] != 0.0 {
            return Err("k4 of a perspective camera has no agreed meaning and is not read".into());
        }
        if model == Projection::Fisheye && p != [0.0; 2] {
            return Err("p1 and p2 of a fisheye camera are not read".into());
        }
        let size = match (length("w", |keys| keys.w)?, length("h", |keys| keys.h)?) {
            (Some(w), Some(h)) => Some((whole(w, "w")?, whole(h, "h")?)),
            (None, None) => None,
            _ => return Err("only one of w and h is given".into()),
        };
        let fl_x = length("fl_x", |keys| keys.fl_x)?;
        let fl_y = length("fl_y", |keys| keys.fl_y)?;
        let angle_x = angle("camera_angle_x", |keys| keys.camera_angle_x)?;
        let angle_y = angle("camera_angle_y", |keys| keys.camera_angle_y)?;
        let focal = match (model, fl_x, fl_y, angle_x) {
            (Projection::Equirectangular, ..) => Focal::None,
            (_, Some(x), y, _) => Focal::Pixels(x, y.unwrap_or(x)),
            (_, None, Some(y), None) => Focal::Pixels(y, y),
            (_, None, _, Some(x)) => Focal::Angles(x, angle_y),
            (_, None, None, None) => {
                return Err("there is no focal length: neither fl_x nor camera_angle_x".into());
            }
        };
        let center = (number("cx", |keys| keys.cx)?, number("cy", |keys| keys.cy)?);
        Ok(Self { model, size, focal, center, k, p })
    }

    /// The camera for a photo of `width` x `height` pixels; the size is used only where the file
    /// has none. A perspective camera without distortion becomes a pinhole.
    pub fn camera(&self, width: usize, height: usize) -> Camera {
        let (width, height) = self.size.unwrap_or((width, height));
        let (w, h) = (width as f64, height as f64);
        let from_angle = |side: f64, angle: f64| 0.5 * side / (0.5 * angle).tan();
        let (fx, fy) = match self.focal {
            Focal::Pixels(x, y) => (x, y),
            Focal::Angles(x, y) => {
                let fx = from_angle(w, x);
                (fx, y.map_or(fx, |y| from_angle(h, y)))
            }
            Focal::None => {
                let model = CameraModel::Equirectangular;
                return Camera { model, width, height, params: vec![w, h] };
            }
        };
        let (cx, cy) = (self.center.0.unwrap_or(0.5 * w), self.center.1.unwrap_or(0.5 * h));
        let [k1, k2, k3, k4] = self.k;
        let [p1, p2] = self.p;
        let mut params = vec![fx, fy, cx, cy];
        let model = if self.model == Projection::Fisheye {
            params.extend([k1, k2, k3, k4]);
            CameraModel::OpencvFisheye
        } else if k3 != 0.0 {
            params.extend([k1, k2, p1, p2, k3, 0.0, 0.0, 0.0]);
            CameraModel::FullOpencv
        } else if [k1, k2, p1, p2] != [0.0; 4] {
            params.extend([k1, k2, p1, p2]);
            CameraModel::Opencv
        } else {
            CameraModel::Pinhole
        };
        Camera { model, width, height, params }
    }
}

fn projection(shared: &IntrinsicKeys, own: &IntrinsicKeys) -> Result<Projection, String> {
    let name = own.camera_model.as_ref().or(shared.camera_model.as_ref());
    let fisheye = own.is_fisheye.or(shared.is_fisheye).unwrap_or(false);
    match name.map(|name| name.to_ascii_uppercase()).as_deref() {
        None if fisheye => Ok(Projection::Fisheye),
        // nerfstudio reads distortion for all of these alike.
        None | Some("OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL") => {
            Ok(Projection::Perspective)
        }
        Some("OPENCV_FISHEYE") => Ok(Projection::Fisheye),
        Some("EQUIRECTANGULAR") => Ok(Projection::Equirectangular),
        Some(other) => Err(format!(
            "camera_model \"{}\" is unknown; OPENCV, OPENCV_FISHEYE, PINHOLE, SIMPLE_PINHOLE and \
             EQUIRECTANGULAR can be read",
            other.escape_debug()
        )),
    }
}

fn whole(value: f64, name: &str) -> Result<usize, String> {
    let rounded = value.round();
    if (value - rounded).abs() < 1e-6 && (1.0..=MAX_IMAGE_SIDE as f64).contains(&rounded) {
        Ok(rounded as usize)
    } else {
        Err(format!("{name} is {value}, which is not a plausible image size"))
    }
}
