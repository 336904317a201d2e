//! What fusion leaves under the rims of planes.
//!
//! A plane has a mesh of its own, but the pixels beside it are fused. Fusion keeps what is unseen behind a surface for a few voxels, and a
//! view that looks through a place counts less there than one that sees a surface before it. So a table gets an apron that hangs
//! from its rim, in front of the ground that photos show there.

use glam::Vec3;
use rayon::prelude::*;

use super::sheet::Sheet;
use super::splat_depth::DepthMap;
use super::tsdf::TRUNCATION;
use super::view::View;
use crate::mesh::Mesh;

/// How far under a sheet, and how far beside it, its rim may hang, voxels; and how far its vertices may be off.
const REACH: f32 = 2.0 * TRUNCATION;
const OFF: f32 = 1.0;
/// A depth so many voxels behind a place shows what is behind it, and one so many from it shows the place.
const THROUGH: f32 = 1.5 * TRUNCATION;
const AT: f32 = 1.5;
/// Photos, counted as sharp as they are, that look through a rim.
const LEAST: f32 = 2.0;
/// Cosine of the angle between normal and sight from which a photo sees a vertex.
const LEAST_COSINE: f32 = 0.2;
/// Pixels to each side of a vertex that are looked at, at most.
const MOST_PIXELS: usize = 4;

/// Drops triangles under and beside the sheets that more photos look through than see.
pub(super) fn drop_aprons(
    mesh: &mut Mesh,
    views: &[View],
    maps: &[DepthMap],
    sheets: &[Sheet],
    voxel: f32,
) {
    let normals = mesh.vertex_normals();
    let is_apron = |(&p, &n): (&Vec3, &Vec3)| {
        if !sheets.iter().any(|s| is_under(s, p, voxel)) {
            return false;
        }
        let (mut through, mut at) = (0.0, 0.0);
        for (view, map) in views.iter().zip(maps) {
            // A photo looks through the front of an apron. From behind, the plane hides it.
            if n.dot((view.center - p).normalize_or_zero()) > LEAST_COSINE {
                match look(p, view, map, voxel) {
                    Some((Look::Through, weight)) => through += weight,
                    Some((Look::At, weight)) => at += weight,
                    None => {}
                }
            }
        }
        through >= LEAST && through >= at
    };
    let places = mesh.vertices.par_iter().zip(&normals).with_min_len(256);
    let apron: Vec<bool> = places.map(is_apron).collect();
    let keep = |t: &[u32; 3]| t.iter().filter(|&&v| apron[v as usize]).count() < 2;
    let keep: Vec<bool> = mesh.triangles.iter().map(keep).collect();
    mesh.retain(|t| keep[t]);
}

/// Whether a place is where an apron of the sheet would hang.
fn is_under(sheet: &Sheet, p: Vec3, voxel: f32) -> bool {
    let height = sheet.plane.height(p) / voxel;
    if !(-REACH..=OFF).contains(&height) {
        return false;
    }
    let along = sheet.plane.normal.any_orthonormal_vector() * (REACH * voxel);
    let across = sheet.plane.normal.cross(along);
    let steps = [-1.0, 0.0, 1.0];
    steps.iter().any(|&i| steps.iter().any(|&j| sheet.covers(p + along * i + across * j)))
}

/// What a photo says about a place.
enum Look {
    Through,
    At,
}

/// The word of a photo about a place and its weight; `None` where it does not show it, or something before it.
fn look(p: Vec3, view: &View, map: &DepthMap, voxel: f32) -> Option<(Look, f32)> {
    let q = view.project(p)?;
    let pixel = view.pixel(q.x, q.y)?;
    let footprint = q.z * view.footprint();
    let unit = voxel.max(footprint);
    // Half a voxel to each side: at a step of depth one pixel decides what is seen.
    let half = ((0.5 * voxel / footprint).round() as usize).min(MOST_PIXELS);
    let (x, y) = (pixel % view.width, pixel / view.width);
    let (mut nearest, mut off) = (f32::MAX, f32::MAX);
    for row in y.saturating_sub(half)..(y + half + 1).min(view.height) {
        for column in x.saturating_sub(half)..(x + half + 1).min(view.width) {
            let z = map.depth[row * view.width + column];
            // Where nothing is known, nothing is looked through.
            let z = if z > 0.0 { z } else { q.z };
            nearest = nearest.min(z);
            off = off.min((z - q.z).abs());
        }
    }
    let weight = (voxel / footprint).powi(2).min(1.0) * view.weight(pixel);
    if off <= AT * unit {
        Some((Look::At, weight))
    } else if nearest > q.z + THROUGH * unit {
        Some((Look::Through, weight))
    } else {
        None
    }
}

#[cfg(test)]
mod tests;
