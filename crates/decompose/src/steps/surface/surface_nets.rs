//! The zero level of a sparse grid as triangles: one vertex per cell that the level passes, at the
//! mean of its crossings with the cell's edges (naive surface nets, Gibson 1998).

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use super::tsdf::{Grid, SIDE, VOXELS, local};
use crate::mesh::Mesh;

const PADDED: usize = SIDE + 1;
const CORNERS: usize = PADDED * PADDED * PADDED;
/// Corners of a cell, x fastest.
const EDGES: [(usize, usize); 12] = [
    (0, 1),
    (2, 3),
    (4, 5),
    (6, 7),
    (0, 2),
    (1, 3),
    (4, 6),
    (5, 7),
    (0, 4),
    (1, 5),
    (2, 6),
    (3, 7),
];
const NONE: u16 = u16::MAX;

/// Distances of a block with the first layer of its upper neighbors, NaN where nothing was seen, and by how many views.
fn padded(grid: &Grid, block: usize) -> ([f32; CORNERS], [u8; CORNERS]) {
    let key = grid.keys[block];
    let mut out = ([f32::NAN; CORNERS], [0; CORNERS]);
    for corner in 0..8usize {
        let shift = IVec3::new((corner & 1) as i32, (corner >> 1 & 1) as i32, (corner >> 2) as i32);
        let Some(source) = grid.find(key + shift) else { continue };
        let source = &grid.blocks[source];
        let span = |s: i32| if s == 0 { 0..SIDE } else { 0..1 };
        for z in span(shift.z) {
            for y in span(shift.y) {
                for x in span(shift.x) {
                    let i = (z * SIDE + y) * SIDE + x;
                    let at = IVec3::new(x as i32, y as i32, z as i32) + shift * SIDE as i32;
                    let to = (at.z as usize * PADDED + at.y as usize) * PADDED + at.x as usize;
                    out.0[to] = source.distance[i].to_f32();
                    out.1[to] = source.seen[i];
                }
            }
        }
    }
    out
}

/// What one block contributes: vertices, and the cells that they belong to; no table where the level does not pass.
#[derive(Default)]
struct Cells {
    vertices: Vec<Vec3>,
    table: Option<Box<Table>>,
}

/// Per cell of a block, its vertex, and the axes along which its first corner's edge is crossed.
struct Table {
    vertex_of: [u16; VOXELS],
    /// Bit `a`: the edge along axis `a` is crossed; bit `a + 3`: from inside to outside.
    crossings: [u8; VOXELS],
}

fn cells(grid: &Grid, block: usize, least: u8) -> Cells {
    let (values, seen) = padded(grid, block);
    let origin = grid.keys[block] * SIDE as i32;
    let mut out = Cells::default();
    for cell in 0..VOXELS {
        let at = local(cell);
        let index = |c: usize| {
            let (x, y, z) =
                (at.x as usize + (c & 1), at.y as usize + (c >> 1 & 1), at.z as usize + (c >> 2));
            (z * PADDED + y) * PADDED + x
        };
        let d: [f32; 8] = std::array::from_fn(|c| values[index(c)]);
        if d.iter().any(|v| v.is_nan()) || (0..8).all(|c| seen[index(c)] < least) {
            continue;
        }
        let inside = d.map(|v| v < 0.0);
        if inside.iter().all(|&i| i == inside[0]) {
            continue;
        }
        let (mut sum, mut count) = (Vec3::ZERO, 0.0);
        for (a, b) in EDGES {
            if inside[a] != inside[b] {
                let t = d[a] / (d[a] - d[b]);
                let corner =
                    |c: usize| Vec3::new((c & 1) as f32, (c >> 1 & 1) as f32, (c >> 2) as f32);
                sum += corner(a).lerp(corner(b), t);
                count += 1.0;
            }
        }
        let empty = || Box::new(Table { vertex_of: [NONE; VOXELS], crossings: [0; VOXELS] });
        let table = out.table.get_or_insert_with(empty);
        table.vertex_of[cell] = out.vertices.len() as u16;
        out.vertices.push(((origin + at).as_vec3() + sum / count) * grid.voxel);
        for (axis, end) in [1, 2, 4].into_iter().enumerate() {
            if inside[0] != inside[end] {
                table.crossings[cell] |= 1 << axis | u8::from(inside[0]) << (axis + 3);
            }
        }
    }
    out
}

/// The mesh of the level where the distance is zero, where at least `least` views saw it.
pub(super) fn surface_nets(mut grid: Grid, least: u8) -> Mesh {
    let cells: Vec<Cells> =
        (0..grid.keys.len()).into_par_iter().map(|b| cells(&grid, b, least)).collect();
    grid.blocks = Vec::new();
    let mut first = Vec::with_capacity(cells.len());
    let mut vertices = Vec::new();
    for c in &cells {
        first.push(vertices.len() as u32);
        vertices.extend_from_slice(&c.vertices);
    }
    let faces = |block: usize| {
        let mut triangles = Vec::new();
        let key = grid.keys[block];
        // Blocks below along each axis, by the same bits as corners.
        let below: [Option<usize>; 8] = std::array::from_fn(|c| {
            let shift = IVec3::new((c & 1) as i32, (c >> 1 & 1) as i32, (c >> 2) as i32);
            if c == 0 { Some(block) } else { grid.find(key - shift) }
        });
        let vertex = |at: IVec3| {
            let under = at.cmplt(IVec3::ZERO);
            let b = below[under.bitmask() as usize]?;
            let p = (at & 7).as_uvec3();
            let cell = ((p.z as usize * SIDE) + p.y as usize) * SIDE + p.x as usize;
            let v = cells[b].table.as_ref()?.vertex_of[cell];
            (v != NONE).then(|| first[b] + u32::from(v))
        };
        let crossings = cells[block].table.iter().flat_map(|table| &table.crossings);
        for (cell, &crossed) in crossings.enumerate() {
            for axis in 0..3 {
                if crossed >> axis & 1 == 0 {
                    continue;
                }
                let at = local(cell);
                let (u, v) = (IVec3::AXES[(axis + 1) % 3], IVec3::AXES[(axis + 2) % 3]);
                let quad = [at - u - v, at - v, at, at - u].map(vertex);
                if let [Some(a), Some(b), Some(c), Some(d)] = quad {
                    let outwards = crossed >> (axis + 3) & 1 == 1;
                    let (b, d) = if outwards { (b, d) } else { (d, b) };
                    let p = |i: u32| vertices[i as usize];
                    // The shorter diagonal: fewer slivers.
                    if p(a).distance_squared(p(c)) <= p(b).distance_squared(p(d)) {
                        triangles.extend([[a, b, c], [a, c, d]]);
                    } else {
                        triangles.extend([[a, b, d], [b, c, d]]);
                    }
                }
            }
        }
        triangles
    };
    let triangles: Vec<Vec<[u32; 3]>> = (0..grid.keys.len()).into_par_iter().map(faces).collect();
    let mut mesh = Mesh { vertices, triangles: triangles.concat() };
    mesh.retain(|_| true);
    mesh
}
