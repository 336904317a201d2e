//! Where planes and the rest of the surface meet.

use std::collections::BTreeMap;

use glam::Vec3;

use super::sheet::Sheet;
use super::splat_depth::DepthMap;
use super::view::View;
use crate::mesh::Mesh;

/// Cosine of the angle up to which a triangle lies along a plane (45 degrees).
const ALONG: f32 = 0.7;

/// Puts pixels onto the planes; `true` for those.
pub(super) fn flatten(
    sheets: &[Sheet],
    views: &[View],
    maps: &mut [DepthMap],
    tolerance: f32,
    voxel: f32,
) -> Vec<Vec<bool>> {
    let mut flat: Vec<Vec<bool>> = maps.iter().map(|m| vec![false; m.depth.len()]).collect();
    for sheet in sheets {
        for ((view, map), flat) in views.iter().zip(&mut *maps).zip(&mut flat) {
            let put = sheet.flatten(view, map, tolerance, voxel);
            flat.iter_mut().zip(put).for_each(|(f, p)| *f |= p);
        }
    }
    flat
}

/// Drops what lies on the sheets, which have meshes of their own, and under them. What is deeper than a plane beside its sheet is no part of
/// it: a mattress that gives way, a niche in a wall, the floor before a table.
pub(super) fn cut_planes(mesh: &mut Mesh, sheets: &[Sheet], voxel: f32) {
    let keep: Vec<bool> = mesh
        .triangles
        .iter()
        .map(|&t| {
            let n = mesh.area_normal(t).normalize_or_zero();
            let corners = mesh.corners(t);
            sheets.iter().all(|s| {
                let high = corners.map(|p| s.plane.height(p)).into_iter().fold(f32::MIN, f32::max);
                let is_beside = corners.iter().any(|p| !s.covers(*p));
                is_beside || high > if n.dot(s.plane.normal) > ALONG { 0.5 * voxel } else { 0.0 }
            })
        })
        .collect();
    mesh.retain(|t| keep[t]);
}

/// Extends open edges that end within `reach` (of every vertex over a sheet) over a sheet down to it, along the surface: depth maps blur where a thing
/// stands, and light would pass through the gap. What bulges goes on inwards, what widens goes straight down, so that no skirt
/// shows beyond its thing.
pub(super) fn skirts(mesh: &mut Mesh, sheets: &[Sheet], reach: impl Fn(&Mesh, Vec3) -> Vec<f32>) {
    let edges = mesh.open_edges();
    let normals = mesh.vertex_normals();
    for sheet in sheets {
        let mut foot_of = BTreeMap::new();
        let reach = reach(mesh, sheet.plane.normal);
        for &(a, b) in &edges {
            let ends = [b, a].map(|v| (v, mesh.vertices[v as usize]));
            let heights = ends.map(|(_, p)| sheet.plane.height(p));
            let reach = reach[a as usize].min(reach[b as usize]);
            if !heights.iter().all(|&h| h > 0.0 && h < reach) {
                continue;
            }
            let [c, d] = ends.map(|(v, p)| {
                *foot_of.entry(v).or_insert_with(|| {
                    let (up, height) = (sheet.plane.normal, sheet.plane.height(p));
                    let n = normals[v as usize];
                    let flat = n - up * n.dot(up);
                    // Toward the inside as far as the surface leans over, 45 degrees at most.
                    let lean = (-n.dot(up) / flat.length().max(1e-3)).clamp(0.0, 1.0);
                    let inwards = -flat.normalize_or_zero() * lean;
                    mesh.vertices.push(p + (inwards - up) * height);
                    mesh.vertices.len() as u32 - 1
                })
            });
            // The triangle beyond the edge runs from a to b, so this side runs from b to a.
            mesh.triangles.extend([[b, a, d], [b, d, c]]);
        }
    }
}

/// Drops pieces that never rise by `height` (in units of `grain`, per vertex) over the sheet below them: noise of the plane's depth. A piece
/// that reaches beyond the sheet is more than that.
pub(super) fn drop_crumbs(
    mesh: &mut Mesh,
    sheets: &[Sheet],
    height: f32,
    grain: &dyn Fn(Vec3) -> f32,
) -> usize {
    let labels = mesh.components();
    let mut dropped = vec![false; mesh.vertices.len()];
    for sheet in sheets {
        let mut top = vec![f32::MIN; mesh.vertices.len()];
        for (&label, &t) in labels.iter().zip(&mesh.triangles) {
            for p in mesh.corners(t) {
                let height =
                    if sheet.covers(p) { sheet.plane.height(p) / grain(p) } else { f32::MAX };
                top[label as usize] = top[label as usize].max(height);
            }
        }
        dropped.iter_mut().zip(top).for_each(|(d, top)| *d |= top > f32::MIN && top < height);
    }
    mesh.retain(|t| !dropped[labels[t] as usize]);
    dropped.iter().filter(|&&d| d).count()
}
