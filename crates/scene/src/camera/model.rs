//! The table of camera models: COLMAP's ids, names and parameter lists.

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

use CameraModel as M;

/// One row per model; the position in the table is the id that COLMAP writes in its files.
const TABLE: [(CameraModel, &str, &[&str]); 18] = [
    (M::SimplePinhole, "SIMPLE_PINHOLE", &["f", "cx", "cy"]),
    (M::Pinhole, "PINHOLE", &["fx", "fy", "cx", "cy"]),
    (M::SimpleRadial, "SIMPLE_RADIAL", &["f", "cx", "cy", "k"]),
    (M::Radial, "RADIAL", &["f", "cx", "cy", "k1", "k2"]),
    (M::Opencv, "OPENCV", &["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"]),
    (M::OpencvFisheye, "OPENCV_FISHEYE", &["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"]),
    (
        M::FullOpencv,
        "FULL_OPENCV",
        &["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"],
    ),
    (M::Fov, "FOV", &["fx", "fy", "cx", "cy", "omega"]),
    (M::SimpleRadialFisheye, "SIMPLE_RADIAL_FISHEYE", &["f", "cx", "cy", "k"]),
    (M::RadialFisheye, "RADIAL_FISHEYE", &["f", "cx", "cy", "k1", "k2"]),
    (
        M::ThinPrismFisheye,
        "THIN_PRISM_FISHEYE",
        &["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "sx1", "sy1"],
    ),
    (
        M::RadTanThinPrismFisheye,
        "RAD_TAN_THIN_PRISM_FISHEYE",
        &[
            "fx", "fy", "cx", "cy", "k0", "k1", "k2", "k3", "k4", "k5", "p0", "p1", "s0", "s1",
            "s2", "s3",
        ],
    ),
    (M::SimpleDivision, "SIMPLE_DIVISION", &["f", "cx", "cy", "k"]),
    (M::Division, "DIVISION", &["fx", "fy", "cx", "cy", "k"]),
    (M::SimpleFisheye, "SIMPLE_FISHEYE", &["f", "cx", "cy"]),
    (M::Fisheye, "FISHEYE", &["fx", "fy", "cx", "cy"]),
    (M::Eucm, "EUCM", &["fx", "fy", "cx", "cy", "alpha", "beta"]),
    (M::Equirectangular, "EQUIRECTANGULAR", &["w", "h"]),
];

impl CameraModel {
    /// Every model, in the order of [`Self::id`].
    pub fn all() -> impl Iterator<Item = Self> {
        TABLE.iter().map(|row| row.0)
    }

    /// COLMAP's number of the model, 0 to 17; 12 and up are new in COLMAP 4.
    pub fn id(self) -> u32 {
        self as u32
    }

    /// The model of a COLMAP number.
    pub fn from_id(id: i64) -> Option<Self> {
        TABLE.get(usize::try_from(id).ok()?).map(|row| row.0)
    }

    /// COLMAP's name, upper case.
    pub fn name(self) -> &'static str {
        TABLE[self as usize].1
    }

    /// The model of a COLMAP name; letter case does not matter.
    pub fn from_name(name: &str) -> Option<Self> {
        TABLE.iter().find(|row| row.1.eq_ignore_ascii_case(name)).map(|row| row.0)
    }

    /// Names of the parameters, in the order of [`Camera::params`](super::Camera::params).
    pub fn parameter_names(self) -> &'static [&'static str] {
        TABLE[self as usize].2
    }

    /// Number of parameters.
    pub fn parameter_count(self) -> usize {
        self.parameter_names().len()
    }

    /// Number of leading focal lengths: 2 with `fx, fy`, 1 with a shared `f`, 0 without.
    pub fn focal_count(self) -> usize {
        match self.parameter_names()[0] {
            "fx" => 2,
            "f" => 1,
            _ => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_and_names_lead_back_to_the_model() {
        for (row, model) in CameraModel::all().enumerate() {
            assert_eq!(model.id() as usize, row);
            assert_eq!(CameraModel::from_id(row as i64), Some(model));
            assert_eq!(CameraModel::from_name(&model.name().to_lowercase()), Some(model));
        }
        assert_eq!(CameraModel::from_id(18), None);
        assert_eq!(CameraModel::from_id(-1), None);
        assert_eq!(CameraModel::from_name("ORTHO"), None);
    }
}
