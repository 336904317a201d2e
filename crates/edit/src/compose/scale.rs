//! How long a unit of the scene is.

use glam::DVec3;
use motes_math::median::median;

/// Something whose size is known, meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScaleClue {
    /// The answer itself.
    MetersPerUnit(f64),
    /// The distance of two points of the world: the height of a door.
    Length {
        /// World.
        from: DVec3,
        /// World.
        to: DVec3,
        /// Their distance.
        meters: f64,
    },
    /// How high the cameras were held above the ground.
    CameraHeight(f64),
}

/// Meters per world unit; `None` where the clue says nothing: points that coincide, cameras on the ground. `cameras` are centers in world,
/// `ground` is the height of the ground along `up`.
pub fn meters_per_unit(
    clue: &ScaleClue,
    cameras: &[DVec3],
    up: DVec3,
    ground: Option<f64>,
) -> Option<f64> {
    let found = match *clue {
        ScaleClue::MetersPerUnit(meters) => meters,
        ScaleClue::Length { from, to, meters } => meters / from.distance(to),
        // The median: some photos are taken kneeling.
        ScaleClue::CameraHeight(meters) => {
            meters / (median(cameras.iter().map(|c| c.dot(up)))? - ground?)
        }
    };
    (found > 0.0 && found.is_finite()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_clue_gives_the_length_of_a_unit() {
        let cameras = [1.0, 1.2, 0.3].map(|z| DVec3::new(4.0, 0.0, z));
        let of = |clue, ground| meters_per_unit(&clue, &cameras, DVec3::Z, ground);
        assert_eq!(of(ScaleClue::MetersPerUnit(0.5), None), Some(0.5));
        let door = ScaleClue::Length { from: DVec3::ZERO, to: DVec3::Z * 4.0, meters: 2.0 };
        assert_eq!(of(door, None), Some(0.5));
        assert_eq!(of(ScaleClue::CameraHeight(1.6), Some(0.2)), Some(2.0));
        let none = ScaleClue::Length { from: DVec3::ONE, to: DVec3::ONE, meters: 2.0 };
        assert_eq!(of(none, None), None);
        assert_eq!(of(ScaleClue::CameraHeight(1.6), None), None);
        assert_eq!(of(ScaleClue::CameraHeight(1.6), Some(5.0)), None);
    }
}
