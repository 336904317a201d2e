//! Depth of the Gaussians, planes, fusion, smoothing and refinement, in this order.

use std::time::Instant;

use glam::{DVec3, Vec3};
use motes_scene::{Gaussians, Surface, UnitWorld};
use rayon::prelude::*;

use super::burnt_out::is_lamp;
use super::creases;
use super::depth_prior;
use super::flatness::{Witnesses, fitted};
use super::options::Options;
use super::planes::{self, Plane, dominant_planes};
use super::raised;
use super::refine::{self, Round};
use super::report::{GeometryReport, StepTime};
use super::rims;
use super::room::{self, Room};
use super::seams;
use super::sheet::Sheet;
use super::silhouettes;
use super::smooth::ThinPlate;
use super::splat_depth::{self, DepthMap};
use super::surface_nets;
use super::tsdf;
use super::view::View;
use super::walls;
use crate::error::DecomposeError;
use crate::mesh::{Mesh, Neighbors, averaged};
use crate::observation::Photo;
use crate::progress::Tick;

/// The parts of the extraction, timed.
struct Parts<'a, 'b> {
    tick: &'a mut Tick<'b>,
    times: Vec<StepTime>,
    started: Option<(&'static str, Instant)>,
}

impl Parts<'_, '_> {
    fn begin(&mut self, name: &'static str, done: f32) -> Result<(), DecomposeError> {
        self.end();
        self.started = Some((name, Instant::now()));
        (self.tick)(done)
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
/// The Gaussians' depth in every view, dominant planes taken out (RANSAC), the rest fused into a
/// truncated signed distance (Curless & Levoy 1996), its zero level smoothed as a thin plate and moved
/// to where the photos agree; each plane is a regular grid of its own. `docs/methods/decompose.md` has
/// the steps, `docs/benchmarks/surface.md` their errors. An empty surface is a legal result: no photos, no Gaussians,
/// nothing that several views agree about. The result does not depend on the number of threads.
///
/// # Errors
/// What `tick` says.
pub(crate) fn extract(
    gaussians: &Gaussians,
    photos: &[&Photo],
    options: &Options,
    tick: &mut Tick<'_>,
) -> Result<(Surface, GeometryReport), DecomposeError> {
    let mut parts = Parts { tick, times: Vec::new(), started: None };
    let centers: Vec<DVec3> =
        photos.iter().map(|p| p.camera_from_world.center_in_world()).collect();
    let unit = UnitWorld::of(&centers, gaussians.means.iter().map(|&m| Vec3::from(m).as_dvec3()));
    let views: Vec<View> = photos.iter().map(|p| View::new(p, &unit)).collect();
    parts.begin("depth", 0.0)?;
    let gaussians = without_backdrop(unit.gaussians(gaussians.clone()));
    let median = splat_depth::splat_depths(gaussians.clone(), &views, 1.0);
    let front = splat_depth::splat_depths(gaussians, &views, options.front_power);
    let (mesh, normals, mut report) = surface_of(&views, median, front, options, &mut parts)?;
    parts.end();
    report.voxel *= unit.length;
    report.triangles = mesh.triangles.len();
    report.steps = parts.times;
    let in_world = |v: &Vec3| unit.point_in_world(v.as_dvec3()).as_vec3().to_array();
    let surface = Surface {
        vertices: mesh.vertices.iter().map(in_world).collect(),
        normals: normals.iter().map(Vec3::to_array).collect(),
        triangles: mesh.triangles,
        ..Surface::default()
    };
    Ok((surface, report))
}

/// Distance from the middle of the cameras, over that of the farthest of them, from which Gaussians are no surface: nothing tells how far
/// away they are, and `train-splat` puts there what stands for the sky, or for a color behind everything.
const BACKDROP: f32 = 10.0;

/// The Gaussians, in the unit world, that may be surface. A ground of little texture may be half transparent before a backdrop of
/// its color, whose depth would be taken for its own.
fn without_backdrop(mut gaussians: Gaussians) -> Gaussians {
    let near = |mean: &[f32; 3]| Vec3::from(*mean).length() <= BACKDROP;
    let rows = (0u32..).zip(&gaussians.means).filter(|(_, mean)| near(mean)).map(|(i, _)| i);
    let rows: Vec<u32> = rows.collect();
    if rows.len() < gaussians.len() {
        gaussians.gather(&rows);
    }
    gaussians
}

/// Edge of a voxel as a share of the longer side of the photos, at most, as long as that is more than a pixel.
const MOST_VOXEL: f32 = 0.005;
/// Edge of a cell of a plane, voxels.
const SHEET_CELL: f32 = 4.0;
/// Pieces that rise less than this many voxels over a plane are noise of its depth.
const CRUMB: f32 = 6.0;
/// Side of the smallest lamp over that of other things.
const LAMP: f32 = 0.5;
/// Open edges up to this many voxels over a plane are extended down to it.
const SKIRT: f32 = 8.0;
/// Pixels between the samples that planes are searched among.
const SAMPLE_STRIDE: usize = 4;
/// Planes that are searched at most: a floor and the walls of a corner.
const MOST_PLANES: usize = 4;

/// Edge of a voxel, pixels, of the wanted edge in photos of this longer side: small photos have too few pixels for large voxels.
fn voxel_pixels(wanted: f32, side: usize) -> f32 {
    wanted.max(0.05).min((MOST_VOXEL * side as f32).max(1.0))
}

/// The surface of depth maps, in the unit world, and its vertex normals. `maps` are medians, which
/// planes are found by; `front` are depths nearer the camera for all else.
fn surface_of(
    views: &[View],
    mut maps: Vec<DepthMap>,
    mut front: Vec<DepthMap>,
    options: &Options,
    parts: &mut Parts<'_, '_>,
) -> Result<(Mesh, Vec<Vec3>, GeometryReport), DecomposeError> {
    let mut report = GeometryReport::default();
    let Some(footprint) = tsdf::median_footprint(views, &maps) else {
        return Ok((Mesh::default(), Vec::new(), report));
    };
    let side = views.iter().map(View::longer_side).max().unwrap_or(0);
    let voxel = footprint * voxel_pixels(options.voxel_pixels, side);
    parts.begin("smooth-depth", 0.15)?;
    let length = options.smooth_untextured;
    report.untextured = depth_prior::smooth_untextured(views, &mut maps, &mut front, voxel, length);
    parts.begin("planes", 0.2)?;
    let Flats { sheets, on_planes, flat } = flats(views, &mut maps, voxel, options, &mut report);
    for ((map, front), flat) in maps.iter_mut().zip(&front).zip(&flat) {
        let pixels = map.depth.iter_mut().zip(&front.depth).zip(flat);
        pixels.filter(|(_, flat)| !**flat).for_each(|((z, front), _)| *z = *front);
    }
    drop(front);
    report.pixels_on_planes = flat.iter().flatten().filter(|&&f| f).count() as f64
        / flat.iter().map(Vec::len).sum::<usize>().max(1) as f64;

    parts.begin("fusion", 0.3)?;
    let limit = options.max_blocks.max(64);
    // Things stand out against what they stand on; a wall behind them is not seen around them as surely.
    let planes = (&sheets[..report.planes], &*on_planes);
    let hull = silhouettes::silhouettes(views, &maps, planes, voxel, options.mirror_spread);
    let carve = options.carve_weight.max(0.0);
    let grid = tsdf::fuse(views, &maps, &flat, &hull, voxel, limit, carve);
    drop(hull);
    let voxel = grid.voxel;
    report.voxel = f64::from(voxel);
    report.blocks = grid.keys.len();
    let least = options.min_views.min(views.len() as u8).max(1);
    let mut mesh = surface_nets::surface_nets(grid, least);
    rims::drop_aprons(&mut mesh, views, &maps, &sheets, voxel);
    let flats = Room::new(&sheets, views, &maps, voxel).meshes(&sheets);
    drop(maps);
    report.pieces_dropped = clean(&mut mesh, views, &sheets, voxel, options);
    parts.begin("smoothing", 0.4)?;
    smooth(&mut mesh, voxel, options);

    let mut planes = Mesh::default();
    sheets.iter().for_each(|s| planes.append(s.mesh()));
    let neighbors = Neighbors::of(&mesh);
    for round in 0..options.refine_rounds {
        parts.begin("refinement", 0.5 + 0.5 * round as f32 / options.refine_rounds as f32)?;
        let round = Round::new(round, options);
        let agreement = refine::refine(&mut mesh, &planes, views, &neighbors, voxel, &round);
        report.agreement.push(agreement);
    }
    report.pieces_dropped += clean(&mut mesh, views, &sheets, voxel, options);
    let faces = creases::flatten(&mut mesh, voxel, options.planar_face_width);
    report.planar_faces = faces.len();
    // Things stand on planes. Before a wall they need not touch it.
    seams::skirts(&mut mesh, &sheets[..report.planes], |mesh, up| {
        creases::reach_down(&faces, mesh, up, SKIRT * voxel)
    });
    let mut normals = mesh.vertex_normals();
    if options.smooth_normals > 0 {
        let neighbors = Neighbors::of(&mesh);
        for _ in 0..options.smooth_normals {
            normals = averaged(&normals, &neighbors);
        }
    }
    for (plane, part) in flats {
        normals.extend(vec![plane.normal; part.vertices.len()]);
        mesh.append(part);
    }
    Ok((mesh, normals, report))
}

/// Planes and walls.
struct Flats {
    sheets: Vec<Sheet>,
    /// Per view and pixel, whether it shows a dominant plane,
    on_planes: Vec<Vec<bool>>,
    /// or any.
    flat: Vec<Vec<bool>>,
}

/// Finds planes and walls, and puts pixels that show them onto them.
fn flats(
    views: &[View],
    maps: &mut [DepthMap],
    voxel: f32,
    options: &Options,
    report: &mut GeometryReport,
) -> Flats {
    let tolerance = options.plane_tolerance * voxel;
    let planes = {
        let samples = planes::samples(views, maps, SAMPLE_STRIDE);
        dominant_planes(&samples, tolerance, voxel, options.plane_share, MOST_PLANES)
    };
    report.planes_found = planes.len();
    let (mut sheets, uneven) = sheets(planes, views, maps, tolerance, voxel);
    report.planes = sheets.len();
    let mut on_planes = seams::flatten(&sheets, views, maps, tolerance, voxel);
    raised::put_down(&sheets, views, maps, &mut on_planes, tolerance, voxel);
    let walls = {
        let known: Vec<Plane> = sheets.iter().map(|s| s.plane).collect();
        put_on_walls(views, maps, (&on_planes, &uneven, &known), tolerance, voxel, options)
    };
    let mut flat = seams::flatten(&walls, views, maps, tolerance, voxel);
    raised::put_down(&walls, views, maps, &mut flat, tolerance, voxel);
    flat.iter_mut().flatten().zip(on_planes.iter().flatten()).for_each(|(f, p)| *f |= p);
    sheets.extend(walls);
    if options.wall_share <= 1.0 {
        let (planes, cell) = (report.planes, SHEET_CELL * voxel);
        let on_sides = room::add_sides(&mut sheets, planes, views, maps, voxel, cell);
        flat.iter_mut().flatten().zip(on_sides.iter().flatten()).for_each(|(f, s)| *f |= s);
    }
    report.walls = sheets.len() - report.planes;
    Flats { sheets, on_planes, flat }
}

/// Finds the planes that bound the scene beside those that are known, and puts pixels that show them onto them.
fn put_on_walls(
    views: &[View],
    maps: &mut [DepthMap],
    (on_planes, uneven, known): (&[Vec<bool>], &[Plane], &[Plane]),
    tolerance: f32,
    voxel: f32,
    options: &Options,
) -> Vec<Sheet> {
    if !(options.wall_share <= 1.0) {
        return Vec::new();
    }
    let bare = |(view, on_planes): (&View, &Vec<bool>)| {
        let texture = depth_prior::texture(view).into_iter();
        texture.zip(on_planes).map(|(t, p)| if *p { 1.0 } else { t }).collect()
    };
    let mut bare: Vec<Vec<f32>> =
        views.par_iter().zip(on_planes).with_max_len(1).map(bare).collect();
    let around = |maps: &[DepthMap], known, told| {
        let mut scene = planes::samples(views, maps, SAMPLE_STRIDE);
        scene.retain(|s| s.footprint <= tsdf::MAX_FOOTPRINT * voxel);
        walls::Surroundings { scene, uneven, known, told, voxel }
    };
    let whole = walls::bare_regions(views, maps, &bare, voxel);
    let told =
        walls::told(&whole, views, maps, |maps| around(maps, known, &[]), options.wall_share);
    let rest;
    let regions = if told.planes.is_empty() {
        &whole
    } else {
        // What photos tell needs no look at depth.
        let put = bare.iter_mut().flatten().zip(told.on.iter().flatten());
        put.filter(|(_, on)| **on).for_each(|(bare, _)| *bare = 1.0);
        rest = walls::bare_regions(views, maps, &bare, voxel);
        &rest
    };
    let known = [known, &told.planes].concat();
    let found = {
        let witnesses = Witnesses::new(views, maps, tolerance, voxel);
        walls::walls(
            regions,
            views,
            &around(maps, &known, &told.planes),
            &witnesses,
            options.wall_share,
        )
    };
    walls::flatten(&found, regions, views, maps, voxel);
    walls::spread(&found, &regions.iter().collect::<Vec<_>>(), views, maps, voxel);
    let planes = [told.planes, found.iter().map(|w| w.plane).collect()].concat();
    let planes = walls::joined(planes, &whole, views, maps, voxel);
    if !found.is_empty() {
        walls::spread_to_rest(&planes, &whole, views, maps, voxel);
    }
    let sheet = |plane: Plane| {
        let sheet = Sheet::new(plane, views, maps, tolerance, voxel, SHEET_CELL * voxel)?;
        Some(sheet.with_openings())
    };
    planes.into_iter().filter_map(sheet).collect()
}

/// The parts of planes that the photos know for flat, and the planes that they know for uneven.
fn sheets(
    planes: Vec<Plane>,
    views: &[View],
    maps: &[DepthMap],
    tolerance: f32,
    voxel: f32,
) -> (Vec<Sheet>, Vec<Plane>) {
    let witnesses = Witnesses::new(views, maps, tolerance, voxel);
    let (mut flat, mut uneven) = (Vec::new(), Vec::new());
    for plane in planes {
        let plane = fitted(plane, &witnesses);
        let sheet = Sheet::new(plane, views, maps, tolerance, voxel, SHEET_CELL * voxel);
        let Some(sheet) = sheet else { continue };
        let rivals = witnesses.rivals(&plane);
        if sheet.is_flat(&rivals) {
            flat.push(sheet.without_bumps(&rivals));
        } else {
            uneven.push(plane);
        }
    }
    (flat, uneven)
}

/// Drops what belongs to the planes and what is too small to be anything. Returns the number of pieces.
fn clean(
    mesh: &mut Mesh,
    views: &[View],
    sheets: &[Sheet],
    voxel: f32,
    options: &Options,
) -> usize {
    seams::cut_planes(mesh, sheets, voxel);
    // What no camera comes near is as rough as the pixels that see it.
    let grain = |p: Vec3| {
        let footprint = |view: &View| view.project(p).map(|q| q.z * view.footprint());
        let least = views.iter().filter_map(footprint).reduce(f32::min).unwrap_or(voxel);
        least.max(voxel) * if is_lamp(p, views, sheets) { LAMP } else { 1.0 }
    };
    let small = mesh.drop_small_components(options.min_component.powi(2), grain);
    small + seams::drop_crumbs(mesh, sheets, CRUMB, &grain)
}

fn smooth(mesh: &mut Mesh, voxel: f32, options: &Options) {
    let n = mesh.vertices.len();
    let neighbors = Neighbors::of(mesh);
    let (weight, target, trust) = (vec![1.0; n], vec![0.0; n], vec![1.0; n]);
    for _ in 0..2 {
        let mut normals = mesh.vertex_normals();
        for _ in 0..2 {
            normals = averaged(&normals, &neighbors);
        }
        let plate = ThinPlate {
            mesh,
            normals: &normals,
            neighbors: &neighbors,
            weight: &weight,
            target: &target,
            stiffness: options.stiffness,
            voxel,
            trust: &trust,
            steady: &trust,
            rest_passes: options.rest_passes,
        };
        let u = plate.solve(vec![0.0; n], 60);
        mesh.vertices.iter_mut().zip(&u).zip(&normals).for_each(|((x, &u), &n)| *x += n * u);
    }
}

#[cfg(test)]
pub(super) mod tests;
