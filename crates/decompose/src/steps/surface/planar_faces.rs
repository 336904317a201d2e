//! Planar faces of objects: boxes, books, blocks.
//!
//! Photos leave bumps of half a voxel on a flat face, which is six degrees of its normals. A piece of surface is grown from where normals
//! turn least, as far as it keeps to one plane (region growing, Besl & Jain 1988), and taken for flat when it is wide, its heights fill little of the
//! band about the plane, it hardly bends, and creases end it: anything round fills the band, bends, and goes on beyond it.

use std::mem::replace;

use glam::Vec3;

use super::planes::{Plane, least_squares};
use crate::mesh::{Mesh, Neighbors, averaged};

/// Half of the band about the plane, voxels.
const BAND: f32 = 1.0;
/// Cosine of the angle up to which normals agree with the plane: bumps turn them by 30 degrees.
const AGREE: f32 = 0.85;
/// Cosine of the angle from which on they turn away from what was found flat (18 degrees).
const RIM: f32 = 0.95;
/// Rings of neighbors that the first plane is laid through.
const SEED_RINGS: usize = 5;
/// Growths, each about the plane through what the one before held.
const GROWTHS: usize = 5;
/// Root mean square of the heights, at most this share of half the band: it is 0.58 where the band is filled evenly.
const FILLED: f32 = 0.42;
/// Share of what surrounds the piece that its band alone keeps out, as normals there still agree, and the root mean square of the slope that it
/// may bend by then: 3.5 degrees where creases end it, 2 where half of it goes on.
const BENT: [(f64, f64); 2] = [(0.25, 0.06), (0.5, 0.035)];
/// Seeds that are tried at most.
const TRIES: usize = 1500;
/// Pits and bumps of a planar face up to this deep are taken for noise, voxels.
const PIT: f32 = 4.0;
/// And up to this share of its vertices.
const PIT_SHARE: f32 = 0.25;

/// A flat face.
pub(super) struct PlanarFace {
    pub(super) plane: Plane,
    /// Ascending.
    pub(super) vertices: Vec<u32>,
}

impl PlanarFace {
    /// Adds small pieces that the planar face surrounds.
    pub(super) fn take_pits(&mut self, mesh: &Mesh, neighbors: &Neighbors, voxel: f32) {
        let most = (PIT_SHARE * self.vertices.len() as f32) as usize;
        let (mut inside, mut met) = (Vec::<u32>::new(), Marks::new(mesh.vertices.len()));
        self.vertices.iter().for_each(|v| _ = met.insert(*v));
        for k in 0..self.vertices.len() {
            for &start in neighbors.at(self.vertices[k] as usize) {
                if !met.insert(start) {
                    continue;
                }
                let mut piece = vec![start];
                let mut next = 0;
                while next < piece.len() {
                    let around = neighbors.at(piece[next] as usize).iter();
                    next += 1;
                    piece.extend(around.filter(|j| met.insert(**j)));
                }
                let height = |v: &u32| self.plane.height(mesh.vertices[*v as usize]).abs();
                if piece.len() <= most && piece.iter().all(|v| height(v) <= PIT * voxel) {
                    inside.extend(&piece);
                }
            }
        }
        self.vertices.extend(inside);
        self.vertices.sort_unstable();
    }
}

/// Flat faces, those first that normals turn least in.
pub(super) fn find(mesh: &Mesh, neighbors: &Neighbors, voxel: f32, width: f32) -> Vec<PlanarFace> {
    let own = mesh.vertex_normals();
    let mut smooth = own.clone();
    for _ in 0..4 {
        smooth = averaged(&smooth, neighbors);
    }
    let mut wide = smooth.clone();
    for _ in 0..8 {
        wide = averaged(&wide, neighbors);
    }
    let mut seeds: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    let turn = |v: &u32| 1.0 - smooth[*v as usize].dot(wide[*v as usize]);
    seeds.sort_by(|a, b| turn(a).total_cmp(&turn(b)).then(a.cmp(b)));
    let met = Marks::new(own.len());
    let mut search = Search { mesh, neighbors, normals: &smooth, voxel, met };
    let (mut taken, mut tried) = (vec![false; own.len()], vec![false; own.len()]);
    let mut faces = Vec::new();
    let mut tries = 0;
    for seed in seeds {
        if tries == TRIES {
            break;
        }
        if taken[seed as usize] || tried[seed as usize] {
            continue;
        }
        tries += 1;
        let Some((face, around)) = search.grow(seed, &taken) else { continue };
        // What lies around a seed would grow to the same.
        around.iter().for_each(|&v| tried[v as usize] = true);
        if search.is_flat(&face, width) {
            // With its rim, which would be a frame of its own.
            face.vertices.iter().for_each(|&v| taken[v as usize] = true);
            faces.push(search.without_rim(face));
        }
    }
    faces
}

/// A set of vertices that is emptied at once: thousands of pieces are grown, most of them small.
struct Marks {
    /// Number of the set that each vertex was last put in.
    last: Vec<u32>,
    now: u32,
}

impl Marks {
    fn new(vertices: usize) -> Self {
        Self { last: vec![0; vertices], now: 1 }
    }

    fn clear(&mut self) {
        self.now += 1;
    }

    /// Whether the vertex was not in the set.
    fn insert(&mut self, v: u32) -> bool {
        replace(&mut self.last[v as usize], self.now) != self.now
    }
}

struct Search<'a> {
    mesh: &'a Mesh,
    neighbors: &'a Neighbors,
    normals: &'a [Vec3],
    voxel: f32,
    /// Of the piece that is grown.
    met: Marks,
}

impl Search<'_> {
    fn fit(&self, vertices: &[u32], before: Plane) -> Option<Plane> {
        let points: Vec<Vec3> = vertices.iter().map(|&v| self.mesh.vertices[v as usize]).collect();
        least_squares(&points, before)
    }

    /// The piece about a seed that keeps to a plane, and what lies around the seed.
    fn grow(&mut self, seed: u32, taken: &[bool]) -> Option<(PlanarFace, Vec<u32>)> {
        let (mesh, normals) = (self.mesh, self.normals);
        let normal = normals[seed as usize];
        let mut plane = Plane { normal, offset: normal.dot(mesh.vertices[seed as usize]) };
        let around = self.spread(seed, taken, SEED_RINGS, |v| normals[v].dot(normal) > 0.8);
        plane = self.fit(&around, plane)?;
        let (mut vertices, band) = (Vec::new(), BAND * self.voxel);
        for _ in 0..GROWTHS {
            vertices = self.spread(seed, taken, usize::MAX, |v| {
                plane.height(mesh.vertices[v]).abs() < band && normals[v].dot(plane.normal) > AGREE
            });
            if vertices.len() < around.len() {
                break;
            }
            plane = self.fit(&vertices, plane)?;
        }
        Some((PlanarFace { plane, vertices }, around))
    }

    /// Vertices that are connected to the seed through what `holds`, in so many rings.
    fn spread(
        &mut self,
        seed: u32,
        taken: &[bool],
        rings: usize,
        holds: impl Fn(usize) -> bool,
    ) -> Vec<u32> {
        self.met.clear();
        self.met.insert(seed);
        let mut out = vec![seed];
        let mut ring = 0..1;
        for _ in 0..rings {
            for k in ring.clone() {
                for &j in self.neighbors.at(out[k] as usize) {
                    if !taken[j as usize] && holds(j as usize) && self.met.insert(j) {
                        out.push(j);
                    }
                }
            }
            ring = ring.end..out.len();
            if ring.is_empty() {
                break;
            }
        }
        out
    }

    /// Without what begins to turn away: an edge may be round.
    fn without_rim(&self, mut face: PlanarFace) -> PlanarFace {
        let normal = face.plane.normal;
        face.vertices.retain(|&v| self.normals[v as usize].dot(normal) > RIM);
        face
    }

    /// Share of the vertices around a piece whose normals agree with its plane.
    fn ended_by_band(&mut self, face: &PlanarFace) -> f64 {
        self.met.clear();
        face.vertices.iter().for_each(|v| _ = self.met.insert(*v));
        let (mut by_band, mut all) = (0usize, 0usize);
        for j in face.vertices.iter().flat_map(|&v| self.neighbors.at(v as usize)) {
            if self.met.insert(*j) {
                all += 1;
                let agrees = self.normals[*j as usize].dot(face.plane.normal) > AGREE;
                by_band += usize::from(agrees);
            }
        }
        by_band as f64 / all.max(1) as f64
    }

    /// Whether a piece is wide, fills little of its band and hardly bends.
    fn is_flat(&mut self, face: &PlanarFace, width: f32) -> bool {
        let count = face.vertices.len() as f64;
        let normal = face.plane.normal.as_dvec3();
        let u = normal.any_orthonormal_vector();
        let v = normal.cross(u);
        let places = face.vertices.iter().map(|&i| self.mesh.vertices[i as usize].as_dvec3());
        let places: Vec<_> = places.map(|p| p / f64::from(self.voxel)).collect();
        let middle = places.iter().sum::<glam::DVec3>() / count;
        let flat: Vec<[f64; 3]> = places
            .iter()
            .map(|p| *p - middle)
            .map(|d| [d.dot(u), d.dot(v), d.dot(normal)])
            .collect();
        let mean = |of: &dyn Fn(&[f64; 3]) -> f64| flat.iter().map(of).sum::<f64>() / count;
        let (uu, uv, vv) = (mean(&|d| d[0] * d[0]), mean(&|d| d[0] * d[1]), mean(&|d| d[1] * d[1]));
        let narrow = 0.5 * (uu + vv) - (0.25 * (uu - vv).powi(2) + uv * uv).sqrt();
        // As wide as a strip with this spread.
        let across = (12.0 * narrow.max(0.0)).sqrt();
        let filled = mean(&|d| d[2] * d[2]).sqrt();
        // The slope of a strip that bends so much: its height has the root mean square w^2 k / 26.8, its slope w k / 3.46.
        let bent = 7.75 * bending(&flat) / across.max(1e-9);
        let ended = self.ended_by_band(face);
        let most_bent =
            BENT.into_iter().find(|(share, _)| ended <= *share).map_or(-1.0, |(_, most)| most);
        across >= f64::from(width) && filled <= f64::from(FILLED * BAND) && bent <= most_bent
    }
}

/// Root mean square of the part of the heights (third) that is quadratic in the place (first two).
fn bending(places: &[[f64; 3]]) -> f64 {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let monomials: [fn(&[f64; 3]) -> f64; 6] =
        [|_| 1.0, |d| d[0], |d| d[1], |d| d[0] * d[0], |d| d[0] * d[1], |d| d[1] * d[1]];
    // Gram-Schmidt.
    for monomial in monomials {
        let mut row: Vec<f64> = places.iter().map(monomial).collect();
        for other in &basis {
            let along = dot(&row, other);
            row.iter_mut().zip(other).for_each(|(r, o)| *r -= along * o);
        }
        let length = dot(&row, &row).sqrt();
        row.iter_mut().for_each(|r| *r /= length.max(1e-12));
        basis.push(row);
    }
    let heights: Vec<f64> = places.iter().map(|d| d[2]).collect();
    let squares: f64 = basis[3..].iter().map(|row| dot(row, &heights).powi(2)).sum();
    (squares / places.len().max(1) as f64).sqrt()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
