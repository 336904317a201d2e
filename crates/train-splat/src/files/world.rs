//! Into the unit world and back: photos, points and models of a capture.

use crate::{FitOptions, FreezeGroup, TrainingImage};
use glam::{DVec3, Vec3};
use motes_scene::{Capture, Pose, SparsePoints, UnitWorld};

/// The unit world of a capture; the world itself when lengths are to stay as they are to the last bit.
pub(super) fn unit_world(capture: &Capture, options: &FitOptions) -> UnitWorld {
    use FreezeGroup::{Geometry, Means, Scales};
    if options.freeze.iter().any(|group| matches!(group, Geometry | Means | Scales)) {
        return UnitWorld::IDENTITY;
    }
    let centers: Vec<DVec3> =
        capture.views.iter().map(|view| view.camera_from_world.center_in_world()).collect();
    UnitWorld::of(&centers, capture.points.positions.iter().map(|p| Vec3::from(*p).as_dvec3()))
}

/// Moves photos into the unit world; returns where they were.
pub(super) fn into_unit(world: &UnitWorld, images: &mut [TrainingImage]) -> Vec<Pose> {
    let moved = |image: &mut TrainingImage| {
        let pose = image.camera_from_world;
        if *world != UnitWorld::IDENTITY {
            image.camera_from_world = world.pose(&pose);
        }
        pose
    };
    images.iter_mut().map(moved).collect()
}

/// Moves points into the unit world.
pub(super) fn points_into_unit(world: &UnitWorld, points: &mut SparsePoints) {
    if *world != UnitWorld::IDENTITY {
        for position in &mut points.positions {
            *position = world.point(Vec3::from(*position).as_dvec3()).as_vec3().to_array();
        }
    }
}
