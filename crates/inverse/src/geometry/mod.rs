//! From Gaussians and photos to an explicit surface.

mod mesh;
mod options;
mod planes;
mod report;
mod sheet;
mod smooth;
mod splat_depth;
mod surface_nets;
mod tsdf;
mod view;

use std::ops::ControlFlow;
use std::time::Instant;

use glam::{DVec3, Vec3};
use motes_scene::{Gaussians, Surface, UnitWorld};
use thiserror::Error;

pub use options::GeometryOptions;
pub use report::{GeometryReport, StepTime};

use crate::Photo;
use mesh::{Mesh, Neighbours};
use planes::dominant_planes;
use rayon::prelude::*;
use sheet::Sheet;
use smooth::ThinPlate;
use splat_depth::DepthMap;
use view::View;

/// Why there is no surface.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum GeometryError {
    /// The observer asked for it.
    #[error("the extraction of the surface was cancelled")]
    Cancelled,
}

/// Called before every step with its name and the share of the work that is done, 0 to 1.
pub type Observer<'a> = dyn FnMut(&'static str, f32) -> ControlFlow<()> + 'a;

struct Steps<'a> {
    observer: &'a mut Observer<'a>,
    times: Vec<StepTime>,
    started: Option<(&'static str, Instant)>,
}

impl Steps<'_> {
    fn begin(&mut self, name: &'static str, done: f32) -> Result<(), GeometryError> {
        self.end();
        self.started = Some((name, Instant::now()));
        match (self.observer)(name, done) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(GeometryError::Cancelled),
        }
    }

    fn end(&mut self) {
        if let Some((name, start)) = self.started.take() {
            let seconds = start.elapsed().as_secs_f64();
            self.times.push(StepTime { name: name.into(), seconds });
        }
    }
}

/// The surface that the photos show: vertices and normals in world, materials empty.
///
/// The Gaussians' depth in every view (median of the transmittance), dominant planes taken out
/// (RANSAC), the rest fused into a truncated signed distance (Curless & Levoy 1996), its zero level
/// smoothed as a thin plate, each plane as a regular grid of its own. An empty surface is a legal
/// result: no photos, no Gaussians, nothing that several views agree about.
///
/// # Errors
/// When the observer asks to stop.
pub fn extract<'a>(
    gaussians: &Gaussians,
    photos: &[Photo],
    options: &GeometryOptions,
    observer: &'a mut Observer<'a>,
) -> Result<(Surface, GeometryReport), GeometryError> {
    let mut steps = Steps { observer, times: Vec::new(), started: None };
    let centers: Vec<DVec3> =
        photos.iter().map(|p| p.camera_from_world.center_in_world()).collect();
    let unit = UnitWorld::of(&centers, gaussians.means.iter().map(|&m| Vec3::from(m).as_dvec3()));
    let views: Vec<View> = photos.iter().map(|p| View::new(p, &unit)).collect();
    steps.begin("depth", 0.0)?;
    let maps = splat_depth::splat_depths(&unit.gaussians(gaussians.clone()), &views);
    let (mesh, normals, mut report) = fused(&views, maps, options, &mut steps)?;
    steps.end();
    report.voxel *= unit.length;
    report.triangles = mesh.triangles.len();
    report.steps = steps.times;
    let in_world = |v: &Vec3| unit.point_in_world(v.as_dvec3()).as_vec3().to_array();
    let surface = Surface {
        vertices: mesh.vertices.iter().map(in_world).collect(),
        normals: normals.iter().map(Vec3::to_array).collect(),
        triangles: mesh.triangles,
        ..Surface::default()
    };
    Ok((surface, report))
}

/// The surface of depth maps, in the unit world, and its vertex normals.
fn fused(
    views: &[View],
    mut maps: Vec<DepthMap>,
    options: &GeometryOptions,
    steps: &mut Steps,
) -> Result<(Mesh, Vec<Vec3>, GeometryReport), GeometryError> {
    let mut report = GeometryReport::default();
    let Some(footprint) = tsdf::median_footprint(views, &maps) else {
        return Ok((Mesh::default(), Vec::new(), report));
    };
    let voxel = footprint * options.voxel_pixels.max(0.05);
    steps.begin("planes", 0.2)?;
    let tolerance = options.plane_tolerance * voxel;
    let samples = planes::samples(views, &maps, SAMPLE_STRIDE);
    let planes = dominant_planes(&samples, tolerance, voxel, options.plane_share, MOST_PLANES);
    let cell = SHEET_CELL * voxel;
    let sheets: Vec<Sheet> = planes
        .into_iter()
        .filter_map(|p| Sheet::new(p, views, &maps, tolerance, voxel, cell))
        .collect();
    let flat = flatten(&sheets, views, &mut maps, tolerance, voxel);
    report.planes = sheets.len();
    report.pixels_on_planes = flat.iter().flatten().filter(|&&f| f).count() as f64
        / flat.iter().map(Vec::len).sum::<usize>().max(1) as f64;
    steps.begin("fusion", 0.3)?;
    let grid = tsdf::fuse(views, &maps, &flat, voxel, options.max_blocks.max(64));
    report.voxel = f64::from(grid.voxel);
    report.blocks = grid.keys.len();
    let least = options.min_views.min(views.len() as u8).max(1);
    let mut mesh = surface_nets::surface_nets(&grid, least);
    cut_planes(&mut mesh, &sheets, grid.voxel);
    report.pieces_dropped =
        mesh.drop_small_components((options.min_component * grid.voxel).powi(2));
    report.pieces_dropped += drop_crumbs(&mut mesh, &sheets, 2.0 * tolerance);
    steps.begin("smoothing", 0.6)?;
    smooth(&mut mesh, options);
    let mut normals = mesh.vertex_normals();
    for sheet in &sheets {
        let part = sheet.mesh();
        normals.extend(vec![sheet.plane.normal; part.vertices.len()]);
        mesh.append(part);
    }
    Ok((mesh, normals, report))
}

/// Puts pixels onto the planes; `true` for those.
fn flatten(
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

/// Edge of a cell of a plane, voxels.
const SHEET_CELL: f32 = 4.0;
/// Pixels between the samples that planes are searched among.
const SAMPLE_STRIDE: usize = 4;
/// Planes that are searched at most: a floor and the walls of a corner.
const MOST_PLANES: usize = 4;

/// Drops what lies on the sheets, which have meshes of their own.
fn cut_planes(mesh: &mut Mesh, sheets: &[Sheet], voxel: f32) {
    let keep: Vec<bool> = mesh
        .triangles
        .iter()
        .map(|&t| {
            let n = mesh.area_normal(t).normalize_or_zero();
            sheets.iter().all(|s| {
                let high =
                    mesh.corners(t).map(|p| s.plane.height(p)).into_iter().fold(f32::MIN, f32::max);
                high > if n.dot(s.plane.normal) > 0.7 { 0.5 * voxel } else { 0.0 }
            })
        })
        .collect();
    mesh.retain(|t| keep[t]);
}

/// Drops pieces that never rise by `height` over the sheet below them: noise of the plane's depth.
fn drop_crumbs(mesh: &mut Mesh, sheets: &[Sheet], height: f32) -> usize {
    let labels = mesh.components();
    let mut dropped = vec![false; mesh.vertices.len()];
    for sheet in sheets {
        let mut top = vec![f32::MIN; mesh.vertices.len()];
        for (&label, &t) in labels.iter().zip(&mesh.triangles) {
            for p in mesh.corners(t) {
                top[label as usize] = top[label as usize].max(sheet.plane.height(p));
            }
        }
        dropped.iter_mut().zip(top).for_each(|(d, top)| *d |= top > f32::MIN && top < height);
    }
    mesh.retain(|t| !dropped[labels[t] as usize]);
    dropped.iter().filter(|&&d| d).count()
}

fn smooth(mesh: &mut Mesh, options: &GeometryOptions) {
    let n = mesh.vertices.len();
    let neighbours = Neighbours::of(mesh);
    let (weight, target, bend) = (vec![1.0; n], vec![0.0; n], vec![1.0; n]);
    for _ in 0..2 {
        let mut normals = mesh.vertex_normals();
        for _ in 0..2 {
            normals = averaged(&normals, &neighbours);
        }
        let plate = ThinPlate {
            mesh,
            normals: &normals,
            neighbours: &neighbours,
            weight: &weight,
            target: &target,
            stiffness: options.stiffness,
            bend: &bend,
        };
        let u = plate.solve(60);
        mesh.vertices.iter_mut().zip(&u).zip(&normals).for_each(|((x, &u), &n)| *x += n * u);
    }
}

fn averaged(normals: &[Vec3], neighbours: &Neighbours) -> Vec<Vec3> {
    let of = |v: usize| {
        let sum: Vec3 = neighbours.at(v).iter().map(|&j| normals[j as usize]).sum();
        (sum + normals[v]).normalize_or(normals[v])
    };
    (0..normals.len()).into_par_iter().with_min_len(4096).map(of).collect()
}

#[cfg(test)]
mod tests;
