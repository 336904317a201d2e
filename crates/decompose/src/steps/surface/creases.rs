//! Where flat faces meet: vertices are put onto faces, edges and corners.

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec3;
use motes_math::median::quantile;

use super::planar_faces::{PlanarFace, find};
use crate::mesh::{Mesh, Neighbors};

/// Rings around a planar face that may belong to its edges.
const EDGE_RINGS: usize = 3;
/// Farthest that a vertex beside a planar face is moved, voxels.
const EDGE_REACH: f32 = 2.0;
/// Vertices beside a planar face and nearer to it than this lie on it, voxels.
const ON_FACE: f32 = 0.3;
/// Vertices nearer to an edge than this come to lie on it, voxels.
const ON_EDGE: f32 = 1.2;
/// Cosine of the angle between a face that rises from a sheet and the sheet's normal, at most.
const UPRIGHT: f32 = 0.5;
/// Median distance from the planes of a sharp edge, at most, voxels: 0.7 to 0.9 there, 1.2 where a cube of 30 is rounded by 4.
const SHARP: f32 = 1.0;
/// Cosine of the angle between two planes below which they have an edge.
const CREASE: f32 = 0.9;

/// How far above a sheet every vertex may end and be extended down to it: `least`, or for what rises from the sheet as a flat face half
/// of that face's own height. Its foot is in the shade, where photos tell little.
pub(super) fn reach_down(faces: &[PlanarFace], mesh: &Mesh, up: Vec3, least: f32) -> Vec<f32> {
    let mut reach = vec![least; mesh.vertices.len()];
    for face in faces.iter().filter(|face| face.plane.normal.dot(up).abs() < UPRIGHT) {
        let height = |v: &u32| mesh.vertices[*v as usize].dot(up);
        let heights = || face.vertices.iter().map(height);
        let tall = heights().fold(f32::MIN, f32::max) - heights().fold(f32::MAX, f32::min);
        face.vertices.iter().for_each(|&v| reach[v as usize] = (0.5 * tall).max(least));
    }
    reach
}

/// Puts flat faces at least `width` voxels wide onto their planes.
pub(super) fn flatten(mesh: &mut Mesh, voxel: f32, width: f32) -> Vec<PlanarFace> {
    let neighbors = Neighbors::of(mesh);
    let mut faces = find(mesh, &neighbors, voxel, width);
    faces.iter_mut().for_each(|face| face.take_pits(mesh, &neighbors, voxel));
    let mut planes_at: Vec<Vec<u16>> = vec![Vec::new(); mesh.vertices.len()];
    for (k, face) in faces.iter().enumerate() {
        let mut is_reached = vec![false; mesh.vertices.len()];
        let mut ring = face.vertices.clone();
        for &v in &ring {
            is_reached[v as usize] = true;
            planes_at[v as usize].push(k as u16);
        }
        for _ in 0..EDGE_RINGS {
            ring = next_ring(&ring, &neighbors, &mut is_reached);
            let height = |v: u32| face.plane.height(mesh.vertices[v as usize]).abs();
            for &v in ring.iter().filter(|v| height(**v) <= EDGE_REACH * voxel) {
                planes_at[v as usize].push(k as u16);
            }
        }
    }
    let mut own = vec![u16::MAX; mesh.vertices.len()];
    for (k, face) in faces.iter().enumerate() {
        face.vertices.iter().for_each(|&v| own[v as usize] = k as u16);
    }
    let edges = sharp_edges(&faces, mesh, &planes_at, voxel);
    for (v, near) in planes_at.iter().enumerate() {
        let at = Beside { faces: &faces, edges: &edges, near, own: own[v], voxel };
        mesh.vertices[v] = at.moved(mesh.vertices[v]);
    }
    faces
}

/// pairs of planar faces whose edge is sharp, ascending: of the vertices near both planes, half lie within a voxel of each. What is round,
/// or cut off, keeps away from one of them.
fn sharp_edges(
    faces: &[PlanarFace],
    mesh: &Mesh,
    planes_at: &[Vec<u16>],
    voxel: f32,
) -> BTreeSet<(u16, u16)> {
    let mut apart: BTreeMap<(u16, u16), Vec<f32>> = BTreeMap::new();
    for (p, near) in mesh.vertices.iter().zip(planes_at) {
        let height = |k: u16| faces[k as usize].plane.height(*p).abs();
        for (i, &b) in near.iter().enumerate() {
            for &a in &near[..i] {
                apart.entry((a, b)).or_default().push(height(a).max(height(b)));
            }
        }
    }
    let is_sharp = |values: &mut Vec<f32>| quantile(values, 0.5) <= Some(SHARP * voxel);
    apart.into_iter().filter_map(|(pair, mut v)| is_sharp(&mut v).then_some(pair)).collect()
}

/// A vertex near some planar faces.
struct Beside<'a> {
    faces: &'a [PlanarFace],
    edges: &'a BTreeSet<(u16, u16)>,
    /// Ascending.
    near: &'a [u16],
    /// The planar face that it lies in, or none.
    own: u16,
    voxel: f32,
}

impl Beside<'_> {
    /// Where the vertex at `p` belongs.
    fn moved(&self, p: Vec3) -> Vec3 {
        let plane = |k: u16| self.faces[k as usize].plane;
        let height = |k: u16| plane(k).height(p).abs();
        let nearest = self.near.iter().copied().min_by(|&a, &b| height(a).total_cmp(&height(b)));
        let is_own = self.near.contains(&self.own);
        let Some(first) = is_own.then_some(self.own).or(nearest) else { return p };
        let flat = plane(first);
        let mut out = p - flat.normal * flat.height(p);
        let mut along: Option<Vec3> = None;
        for &k in self.near {
            let other = plane(k);
            let cosine = flat.normal.dot(other.normal);
            let is_edge = self.edges.contains(&(k.min(first), k.max(first)));
            if k == first || !is_edge || cosine.abs() > CREASE {
                continue;
            }
            let Some(edge) = along else {
                // Within the first plane, straight to the second.
                let aside = (other.normal - flat.normal * cosine) / (1.0 - cosine * cosine);
                let step = aside * other.height(out);
                if step.length() <= ON_EDGE * self.voxel {
                    out -= step;
                    along = flat.normal.cross(other.normal).try_normalize();
                }
                continue;
            };
            // Along the edge of the two, to the third.
            let slope = other.normal.dot(edge);
            let step = edge * (other.height(out) / slope);
            if slope.abs() > 0.3 && step.length() <= ON_EDGE * self.voxel {
                out -= step;
            }
        }
        // Beside a planar face: what is round between two faces stays round.
        let beside = along.is_some() || height(first) <= ON_FACE * self.voxel;
        let near = beside && (out - p).length() <= EDGE_REACH * self.voxel;
        if is_own || near { out } else { p }
    }
}

fn next_ring(ring: &[u32], neighbors: &Neighbors, is_reached: &mut [bool]) -> Vec<u32> {
    let mut next = Vec::new();
    for &v in ring {
        for &j in neighbors.at(v as usize) {
            if !std::mem::replace(&mut is_reached[j as usize], true) {
                next.push(j);
            }
        }
    }
    next
}

#[cfg(test)]
mod tests {
    use glam::Vec3Swizzles;
    use motes_math::rng::keyed_rng;
    use rand::RngExt;

    use super::*;

    /// A cube of half edge 20 (edges rounded by `radius`), or a ball of radius 24, as vertices about 1 apart with noise along the normal.
    fn mesh(radius: Option<f32>, noise: f32) -> Mesh {
        const SIDE: i32 = 40;
        let mut mesh = Mesh::default();
        let mut index = BTreeMap::new();
        let mut vertex = |mesh: &mut Mesh, c: [i32; 3]| {
            *index.entry(c).or_insert_with(|| {
                let q = Vec3::from(c.map(|v| (v - SIDE / 2) as f32));
                let p = match radius {
                    None => q.normalize() * 24.0,
                    Some(r) => {
                        let core = q.clamp(Vec3::splat(r - 20.0), Vec3::splat(20.0 - r));
                        core + (q - core).normalize_or_zero() * r.min((q - core).length())
                    }
                };
                let mut rng = keyed_rng(1, 2, mesh.vertices.len() as u64);
                let aside = (0..3).map(|_| rng.random::<f32>() - 0.5).sum::<f32>() * 2.0 * noise;
                mesh.vertices.push(p + q.normalize() * aside);
                mesh.vertices.len() as u32 - 1
            })
        };
        for axis in 0..3 {
            for side in [0, SIDE] {
                for i in 0..SIDE {
                    for j in 0..SIDE {
                        let mut corner = |di: i32, dj: i32| {
                            let mut c = [side; 3];
                            (c[(axis + 1) % 3], c[(axis + 2) % 3]) = (i + di, j + dj);
                            vertex(&mut mesh, c)
                        };
                        let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                        let quad = [[a, b, c], [a, c, d]];
                        let turn =
                            |[a, b, c]: [u32; 3]| if side == 0 { [a, c, b] } else { [a, b, c] };
                        mesh.triangles.extend(quad.map(turn));
                    }
                }
            }
        }
        mesh
    }

    /// Root mean square distance of the vertices from the faces of a cube of half edge 20, and of what was its edge from there.
    fn off(mesh: &Mesh, before: &Mesh) -> [f32; 2] {
        let (mut squares, mut counts) = ([0.0f32; 2], [0.0f32; 2]);
        for (p, q) in mesh.vertices.iter().zip(&before.vertices) {
            let sorted = |p: &Vec3| {
                let mut a = p.abs().to_array();
                a.sort_by(f32::total_cmp);
                a
            };
            let ([_, b, c], [_, before, _]) = (sorted(p), sorted(q));
            squares[0] += (c - 20.0).powi(2);
            counts[0] += 1.0;
            if before > 19.5 {
                squares[1] += (b - 20.0).powi(2);
                counts[1] += 1.0;
            }
        }
        [0, 1].map(|k| (squares[k] / counts[k]).sqrt())
    }

    #[test]
    fn a_bumpy_cube_becomes_flat_and_its_edges_sharp() {
        let (mut cube, clean) = (mesh(Some(1.0), 0.3), mesh(Some(1.0), 0.0));
        let before = off(&cube, &clean);
        assert_eq!(flatten(&mut cube, 1.0, 20.0).len(), 6);
        let after = off(&cube, &clean);
        assert!(after[0] < 0.3 * before[0] && after[1] < 0.5 * before[1], "{before:?} {after:?}");
    }

    #[test]
    fn what_is_round_stays_as_it_is() {
        let ball = mesh(None, 0.3);
        let mut flat = ball.clone();
        assert!(flatten(&mut flat, 1.0, 20.0).is_empty());
        assert_eq!(flat.vertices, ball.vertices);
        // Faces of a rounded cube are flat, its edges are not.
        let mut cube = mesh(Some(7.0), 0.1);
        let before = cube.clone();
        assert_eq!(flatten(&mut cube, 1.0, 20.0).len(), 6);
        for (p, q) in cube.vertices.iter().zip(&before.vertices) {
            let beyond = q.abs().to_array().into_iter().filter(|v| *v > 16.0).count();
            assert!(beyond < 2 || p.distance(*q) < 0.5, "{q} moved to {p}");
        }
    }

    #[test]
    fn a_pit_is_filled_and_small_or_broken_meshes_are_left_alone() {
        let mut cube = mesh(Some(1.0), 0.05);
        for p in &mut cube.vertices {
            if p.z > 19.0 && p.x.hypot(p.y) < 3.0 {
                p.z -= 2.5;
            }
        }
        let faces = flatten(&mut cube, 1.0, 20.0);
        assert_eq!(faces.len(), 6);
        let deepest =
            cube.vertices.iter().map(|p| 20.0 - p.abs().max_element()).fold(0.0, f32::max);
        assert!(deepest < 0.6, "{deepest}");
        assert!(flatten(&mut mesh(Some(1.0), 0.0), 1.0, f32::INFINITY).is_empty());
        for vertices in [vec![], vec![Vec3::ZERO; 3], vec![Vec3::NAN; 3]] {
            let triangles = if vertices.is_empty() { vec![] } else { vec![[0, 1, 2]] };
            let mut broken = Mesh { vertices, triangles };
            assert!(flatten(&mut broken, 1.0, 0.0).is_empty());
        }
    }

    #[test]
    fn faces_that_end_above_a_sheet_reach_down_by_half_their_height() {
        let mut cube = mesh(Some(1.0), 0.0);
        let faces = flatten(&mut cube, 1.0, 20.0);
        let reach = reach_down(&faces, &cube, Vec3::Z, 8.0);
        let wall = cube
            .vertices
            .iter()
            .position(|p| p.x > 19.9 && p.yz().abs().max_element() < 3.0)
            .unwrap();
        let top = cube
            .vertices
            .iter()
            .position(|p| p.z > 19.9 && p.xy().abs().max_element() < 3.0)
            .unwrap();
        assert!(reach[wall] > 15.0 && reach[wall] < 21.0, "{}", reach[wall]);
        assert_eq!(reach[top], 8.0);
    }
}
