//! The pinhole that replaces a distorted camera.

use glam::{DVec2, DVec3};
use motes_scene::{Camera, Pinhole};

/// Half of the widest field of view that a pinhole image is given, as a tangent (120 degrees in
/// all): beyond it a few degrees of a fisheye would fill most of the pixels.
const TANGENT_CAP: f64 = 1.732_050_8;
/// Places per side of the photo at which the lens is asked where the border looks.
const BORDER_SAMPLES: usize = 96;

/// A camera applied to a photo that may have another size than the model says.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PhotoCamera {
    camera: Camera,
    /// Photo size, pixels.
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Photo pixels per model pixel.
    scale: DVec2,
}

impl PhotoCamera {
    /// `None` when the photo does not have the aspect of the camera's image: it is then another
    /// photo, a crop, or turned.
    pub(crate) fn new(camera: Camera, width: usize, height: usize) -> Option<Self> {
        let (w, h) = (width as f64, height as f64);
        let (cw, ch) = (camera.width as f64, camera.height as f64);
        let along_long_side = if cw >= ch { w / cw } else { h / ch };
        // A resized photo is rounded to whole pixels, by some programs downwards.
        let agrees =
            (cw * along_long_side - w).abs() <= 1.01 && (ch * along_long_side - h).abs() <= 1.01;
        agrees.then(|| Self { camera, width, height, scale: DVec2::new(w / cw, h / ch) })
    }

    pub(crate) fn pixel_from_direction(&self, direction: DVec3) -> Option<DVec2> {
        Some(self.camera.pixel_from_direction(direction)? * self.scale)
    }

    fn direction_from_pixel(&self, pixel: DVec2) -> Option<DVec3> {
        self.camera.direction_from_pixel(pixel / self.scale)
    }

    /// Whether the size of the photo is the model's.
    pub(crate) fn is_model_size(&self) -> bool {
        self.scale == DVec2::ONE
    }

    /// The pinhole at the size of the photo, when there is nothing to undistort.
    pub(crate) fn as_pinhole(&self) -> Option<Pinhole> {
        Some(self.camera.as_pinhole()?.resized(self.width, self.height))
    }

    /// The pinhole for the undistorted photo, of the same size as the photo: focal lengths are
    /// scaled by one factor until every pixel has content (or, with `keep_border`, until all
    /// content has a pixel), and the principal point moves only as far as that needs.
    ///
    /// Returns it with the share of the tangent range that [`TANGENT_CAP`] cut off, or a cause
    /// when the photo has no usable field of view.
    pub(crate) fn undistorted(&self, keep_border: bool) -> Result<(Pinhole, bool), String> {
        let (w, h) = (self.width as f64, self.height as f64);
        let [fx, fy, cx, cy] = self.camera.affine().ok_or("a panorama is not a pinhole")?;
        let (fx, fy) = (fx * self.scale.x, fy * self.scale.y);
        let (cx, cy) = (cx * self.scale.x, cy * self.scale.y);
        let mut capped = false;
        // Where a border pixel looks on the plane z = 1, along one axis; `outward` is the sign of
        // that side.
        let mut look = |pixel: DVec2, axis: usize, outward: f64| {
            let tangent =
                self.direction_from_pixel(pixel).filter(|d| d.z > 0.0).map(|d| d[axis] / d.z);
            match tangent {
                Some(t) if t * outward <= TANGENT_CAP => t,
                _ => {
                    capped = true;
                    outward * TANGENT_CAP
                }
            }
        };
        let steps = || (0..=BORDER_SAMPLES).map(|i| i as f64 / BORDER_SAMPLES as f64);
        let left: Vec<f64> = steps().map(|t| look(DVec2::new(0.0, t * h), 0, -1.0)).collect();
        let right: Vec<f64> = steps().map(|t| look(DVec2::new(w, t * h), 0, 1.0)).collect();
        let top: Vec<f64> = steps().map(|t| look(DVec2::new(t * w, 0.0), 1, -1.0)).collect();
        let bottom: Vec<f64> = steps().map(|t| look(DVec2::new(t * w, h), 1, 1.0)).collect();
        let smallest = |v: &[f64]| v.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = |v: &[f64]| v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (x, y) = if keep_border {
            ((smallest(&left), largest(&right)), (smallest(&top), largest(&bottom)))
        } else {
            ((largest(&left), smallest(&right)), (largest(&top), smallest(&bottom)))
        };
        if !(x.1 - x.0 > 1e-6 && y.1 - y.0 > 1e-6) {
            return Err(
                "the distortion leaves no rectangle of the photo: its parameters are wrong".into(),
            );
        }
        let (zoom_x, zoom_y) = (w / (fx * (x.1 - x.0)), h / (fy * (y.1 - y.0)));
        let zoom = if keep_border { zoom_x.min(zoom_y) } else { zoom_x.max(zoom_y) };
        let (fx, fy) = (fx * zoom, fy * zoom);
        let center = |f: f64, c: f64, size: f64, (low, high): (f64, f64)| {
            let (a, b) = (low, high - size / f);
            -(-c / f).clamp(a.min(b), a.max(b)) * f
        };
        let (cx, cy) = (center(fx, cx * zoom, w, x), center(fy, cy * zoom, h, y));
        Ok((Pinhole { fx, fy, cx, cy, width: self.width, height: self.height }, capped))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motes_scene::CameraModel;

    fn radial(k: f64) -> PhotoCamera {
        let camera = Camera {
            model: CameraModel::SimpleRadial,
            width: 400,
            height: 300,
            params: vec![350.0, 205.0, 148.0, k],
        };
        PhotoCamera::new(camera, 400, 300).unwrap()
    }

    fn sources(camera: &PhotoCamera, pinhole: &Pinhole) -> Vec<DVec2> {
        let corners =
            [(0.5, 0.5), (399.5, 0.5), (0.5, 299.5), (399.5, 299.5), (200.0, 0.5), (0.5, 150.0)];
        let ray = |(u, v): (f64, f64)| {
            DVec3::new((u - pinhole.cx) / pinhole.fx, (v - pinhole.cy) / pinhole.fy, 1.0)
        };
        corners.iter().map(|&c| camera.pixel_from_direction(ray(c)).unwrap()).collect()
    }

    #[test]
    fn every_pixel_has_content_and_little_is_lost() {
        for k in [-0.12, -0.01, 0.0, 0.02, 0.15] {
            let camera = radial(k);
            let (pinhole, capped) = camera.undistorted(false).unwrap();
            assert!(!capped);
            let sources = sources(&camera, &pinhole);
            assert!(
                sources
                    .iter()
                    .all(|p| (0.0..=400.0).contains(&p.x) && (0.0..=300.0).contains(&p.y)),
                "{k}"
            );
            let touches =
                sources.iter().any(|p| p.x < 2.0 || p.y < 2.0 || p.x > 398.0 || p.y > 298.0);
            assert!(touches, "{k}: {sources:?}");
        }
    }

    #[test]
    fn without_distortion_nothing_changes() {
        let (pinhole, _) = radial(0.0).undistorted(false).unwrap();
        let (fx, cx, cy) = (pinhole.fx, pinhole.cx, pinhole.cy);
        assert!(
            (fx - 350.0).abs() < 1e-9 && (cx - 205.0).abs() < 1e-9 && (cy - 148.0).abs() < 1e-9
        );
    }

    #[test]
    fn keeping_the_border_shows_all_of_the_photo() {
        let camera = radial(-0.12);
        let (pinhole, _) = camera.undistorted(true).unwrap();
        for (u, v) in [(0.0, 0.0), (400.0, 300.0), (0.0, 300.0), (200.0, 0.0)] {
            let d = camera.direction_from_pixel(DVec2::new(u, v)).unwrap();
            let (x, y) = (pinhole.fx * d.x / d.z + pinhole.cx, pinhole.fy * d.y / d.z + pinhole.cy);
            assert!(
                (-1e-6..=400.0 + 1e-6).contains(&x) && (-1e-6..=300.0 + 1e-6).contains(&y),
                "{x} {y}"
            );
        }
    }

    #[test]
    fn a_hemispherical_fisheye_is_capped() {
        let camera = Camera {
            model: CameraModel::SimpleFisheye,
            width: 600,
            height: 600,
            params: vec![190.0, 300.0, 300.0],
        };
        let camera = PhotoCamera::new(camera, 600, 600).unwrap();
        let (pinhole, capped) = camera.undistorted(false).unwrap();
        assert!(capped);
        assert!((300.0 / pinhole.fx - TANGENT_CAP).abs() < 1e-9);
    }

    #[test]
    fn a_photo_of_another_shape_is_refused() {
        let camera = radial(0.1).camera;
        assert!(PhotoCamera::new(camera.clone(), 200, 150).is_some());
        assert!(PhotoCamera::new(camera.clone(), 133, 99).is_some());
        assert!(PhotoCamera::new(camera.clone(), 300, 400).is_none());
        assert!(PhotoCamera::new(camera, 400, 290).is_none());
    }
}
