//! The walls of a room that photos show too little of to tell them alone.
//!
//! Most rooms have right angles (Manhattan world, Coughlan & Yuille 1999). Beside a wall that was found, only the distance of the others
//! is unknown, and the noisy depth at the rims of a few photos tells it. Without them light comes in where the walls are.

use glam::Vec3;
use motes_math::median::upper_median;
use motes_scene::camera_path::mean_up;

use super::planes::{Plane, Sample, reach, samples};
use super::seams;
use super::sheet::Sheet;
use super::splat_depth::DepthMap;
use super::view::View;
use super::walls::{BEHIND, NEAR};
use crate::mesh::Mesh;

/// Sine of the angle to the vertical up to which a plane is upright (20 degrees), cosine of that up to which it is level (25 degrees).
const UPRIGHT: f32 = 0.34;
const LEVEL: f32 = 0.9;
/// Cosine of the angle up to which a wall is at right angles already (5 degrees), and up to which it is a side that depth has askew (15).
const SQUARE: f32 = 0.996;
const ASKEW: f32 = 0.966;
/// Cosine of the angle from a side up to which a pixel faces as it does (45 degrees).
const FACES: f32 = 0.7;
/// Share of what the photos see that must lie on a side, which is at least half of what faces as it does and lies as far out; and how
/// near that is on it, voxels or their footprints: depth hangs before a bare wall here and behind it there.
const LEAST_SIDE: f32 = 0.01;
const ON_SIDE: f32 = 10.0;
/// Pixels between samples of what the photos see.
const STRIDE: usize = 8;

/// What photos tell of a place where they show no wall.
pub(super) enum Shown {
    /// It is in no picture,
    Nowhere,
    /// behind something,
    Hidden,
    /// or looked through.
    Through,
}

/// What bounds a scene.
pub(super) struct Room<'a> {
    views: &'a [View],
    maps: &'a [DepthMap],
    voxel: f32,
    up: Vec3,
    /// With nearly nothing behind them.
    planes: Vec<Plane>,
    samples: Vec<Sample>,
}

impl<'a> Room<'a> {
    pub(super) fn new(
        sheets: &[Sheet],
        views: &'a [View],
        maps: &'a [DepthMap],
        voxel: f32,
    ) -> Self {
        let cameras: Vec<_> = views.iter().map(|v| v.camera_from_unit).collect();
        let up = mean_up(&cameras).map_or(Vec3::Z, |up| up.as_vec3());
        let level = sheets.iter().map(|s| s.plane.normal).find(|n| n.dot(up) > LEVEL);
        let samples = samples(views, maps, STRIDE);
        let up = level.unwrap_or(up);
        let bounds = |p: &Plane| p.bounds(&samples, BEHIND, NEAR * voxel, voxel);
        let planes = sheets.iter().map(|s| s.plane).filter(bounds).collect();
        Self { views, maps, voxel, up, planes, samples }
    }

    /// Unit vector away from the floor.
    pub(super) fn up(&self) -> Vec3 {
        self.up
    }

    /// Whether a place lies behind none of the planes that bound the scene.
    pub(super) fn holds(&self, p: Vec3) -> bool {
        self.planes.iter().all(|plane| plane.height(p) >= -NEAR * self.voxel)
    }

    fn has_wall(&self, plane: &Plane) -> bool {
        plane.normal.dot(self.up).abs() <= UPRIGHT && self.planes.contains(plane)
    }

    /// The meshes of sheets, of upright walls with what photos leave out of them: light that it reflects is that of the wall beside it.
    pub(super) fn meshes(&self, sheets: &[Sheet]) -> Vec<(Plane, Mesh)> {
        let mesh = |sheet: &Sheet| {
            let completed = self.has_wall(&sheet.plane).then(|| sheet.completed(self)).flatten();
            (sheet.plane, completed.as_ref().unwrap_or(sheet).mesh())
        };
        sheets.iter().map(mesh).collect()
    }

    /// Walls at right angles to the first that was found, and the one across from it, where none was found.
    fn sides(&self) -> Vec<Plane> {
        let Some(wall) = self.planes.iter().find(|p| self.has_wall(p)) else { return Vec::new() };
        let along = wall.normal.reject_from_normalized(self.up).normalize();
        let across = self.up.cross(along);
        let is_new = |n: &Vec3| self.planes.iter().all(|p| p.normal.dot(*n) < SQUARE);
        let directions = [along, -along, across, -across].into_iter().filter(is_new);
        directions.filter_map(|normal| self.side(normal)).collect()
    }

    /// The wall of a normal that most of what faces that way, and lies outermost, lies on.
    fn side(&self, normal: Vec3) -> Option<Plane> {
        let height = |s: &Sample| s.position.dot(normal);
        let mut all: Vec<f32> = self.samples.iter().map(height).collect();
        all.sort_unstable_by(f32::total_cmp);
        let outer = *all.get((BEHIND * all.len() as f32) as usize)? + ON_SIDE * self.voxel;
        let facing = self.samples.iter().filter(|s| s.normal.dot(normal) > FACES);
        let mut heights: Vec<f32> = facing.map(height).filter(|h| *h <= outer).collect();
        let offset = upper_median(&mut heights, f32::total_cmp)?;
        let held = heights.iter().filter(|h| (*h - offset).abs() <= ON_SIDE * self.voxel).count();
        let least = (LEAST_SIDE * all.len() as f32).max(0.5 * heights.len() as f32);
        (held as f32 >= least).then_some(Plane { normal, offset })
    }

    /// What photos tell of a place on a plane where they show nothing of it.
    pub(super) fn shown(&self, plane: &Plane, p: Vec3) -> Shown {
        let (mut is_shown, mut through) = (false, 0);
        for (view, map) in self.views.iter().zip(self.maps) {
            let Some(q) = view.project(p) else { continue };
            let Some(i) = view.pixel(q.x, q.y) else { continue };
            is_shown = true;
            let z = map.depth[i];
            let near = reach(ON_SIDE * self.voxel, q.z * view.footprint(), self.voxel);
            let height = plane.height(view.place(view.at(i as u32), z));
            // Where nothing is, a photo looks through.
            through += match z > 0.0 && height >= -near {
                true if height <= near => -1,
                true => 0,
                false => 1,
            };
        }
        match is_shown {
            false => Shown::Nowhere,
            true if through > 0 => Shown::Through,
            true => Shown::Hidden,
        }
    }
}

/// Adds the sides of the room to the sheets, in the place of walls that depth has askew, and puts pixels that show them onto them, `true`
/// for those. The first `planes` sheets stay.
pub(super) fn add_sides(
    sheets: &mut Vec<Sheet>,
    planes: usize,
    views: &[View],
    maps: &mut [DepthMap],
    voxel: f32,
    cell: f32,
) -> Vec<Vec<bool>> {
    let room = Room::new(sheets, views, maps, voxel);
    let (sides, bounds) = (room.sides(), room.planes);
    let near = ON_SIDE * voxel;
    let side = |plane| Some(Sheet::new(plane, views, maps, near, voxel, cell)?.with_openings());
    let sides: Vec<Sheet> = sides.into_iter().filter_map(side).collect();
    let on_sides = seams::flatten(&sides, views, maps, near, voxel);
    let is_askew = |p: &Plane| {
        bounds.contains(p) && sides.iter().any(|s| s.plane.normal.dot(p.normal) > ASKEW)
    };
    let walls = sheets.split_off(planes);
    sheets.extend(walls.into_iter().filter(|s| !is_askew(&s.plane)));
    sheets.extend(sides);
    on_sides
}

#[cfg(test)]
pub(super) mod tests;
