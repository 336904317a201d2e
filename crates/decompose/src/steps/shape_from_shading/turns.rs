//! How normals turn when vertices move along them.

use glam::Vec3;
use rayon::prelude::*;

use crate::mesh::Mesh;

/// Vertices per parallel chunk.
const CHUNK: usize = 1024;

/// Rows of a sparse map: those of `v` are `entries[start[v]..start[v + 1]]`, by ascending column.
pub(super) struct Rows<T> {
    start: Vec<u32>,
    entries: Vec<(u32, T)>,
}

impl<T: Copy + Send + Sync> Rows<T> {
    fn new(rows: Vec<Vec<(u32, T)>>) -> Self {
        let mut start = Vec::with_capacity(rows.len() + 1);
        start.push(0);
        let mut end = 0;
        start.extend(rows.iter().map(|row| {
            end += row.len() as u32;
            end
        }));
        Self { start, entries: rows.concat() }
    }

    #[inline]
    pub(super) fn at(&self, v: usize) -> &[(u32, T)] {
        &self.entries[self.start[v] as usize..self.start[v + 1] as usize]
    }

    /// The same places with other values, of row, column and value.
    pub(super) fn map<S: Copy + Send + Sync>(&self, of: impl Fn(usize, T) -> S + Sync) -> Rows<S> {
        let row = |v: usize| self.at(v).iter().map(|&(j, value)| (j, of(v, value))).collect();
        let rows = (0..self.start.len() - 1).into_par_iter().with_min_len(CHUNK).map(row);
        Rows::new(rows.collect())
    }

    /// Columns as rows.
    pub(super) fn transposed(&self) -> Self {
        let count = self.start.len() - 1;
        let mut rows = vec![Vec::new(); count];
        for v in 0..count {
            self.at(v).iter().for_each(|&(j, value)| rows[j as usize].push((v as u32, value)));
        }
        Self::new(rows)
    }
}

/// `t_v = Σ_j c_vj u_j`: the turn of the unit normal of vertex `v`, weighted by area as that of a [`Mesh`], to first order in the
/// displacements `u_j` of vertices along `normals`. With `x_a` moved by `δ`, twice the area vector of the triangle `a, b, c` changes by
/// `δ × (b - c)`.
pub(super) fn turns(mesh: &Mesh, normals: &[Vec3], free: &[bool]) -> Rows<Vec3> {
    let count = mesh.vertices.len();
    let mut around = vec![Vec::new(); count];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        corners.iter().for_each(|&v| around[v as usize].push(t as u32));
    }
    let row = |v: usize| -> Vec<(u32, Vec3)> {
        if !free[v] {
            return Vec::new();
        }
        let mut row: Vec<(u32, Vec3)> = Vec::with_capacity(8);
        let mut area = Vec3::ZERO;
        for &t in &around[v] {
            let t = mesh.triangles[t as usize];
            area += mesh.area_normal(t);
            for k in 0..3 {
                let [a, b, c] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
                let opposite = mesh.vertices[b as usize] - mesh.vertices[c as usize];
                let change = normals[a as usize].cross(opposite);
                match row.iter_mut().find(|(j, _)| *j == a) {
                    Some((_, sum)) => *sum += change,
                    None => row.push((a, change)),
                }
            }
        }
        let (unit, length) = (area.normalize_or_zero(), area.length());
        if !(length > 0.0) {
            return Vec::new();
        }
        row.sort_by_key(|(j, _)| *j);
        for (_, c) in &mut row {
            *c = (*c - unit * unit.dot(*c)) / length;
        }
        row
    };
    Rows::new((0..count).into_par_iter().with_min_len(CHUNK).map(row).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_those_of_finite_differences() {
        let n = 6u32;
        let mut mesh = Mesh::default();
        for k in 0..n * n {
            let (x, y) = ((k % n) as f32, (k / n) as f32);
            mesh.vertices.push(Vec3::new(x, y, 0.3 * (x * 1.3).sin() + 0.2 * (y * x * 0.4).cos()));
        }
        for k in (0..n * (n - 1)).filter(|k| k % n + 1 < n) {
            mesh.triangles.extend([[k, k + 1, k + n], [k + 1, k + n + 1, k + n]]);
        }
        let normals = mesh.vertex_normals();
        let rows = turns(&mesh, &normals, &vec![true; (n * n) as usize]);
        let columns = rows.transposed();
        let step = 1e-3;
        for j in [0usize, 7, 14, 21, 35] {
            let moved = |by: f32| {
                let mut mesh = mesh.clone();
                mesh.vertices[j] += normals[j] * by;
                mesh.vertex_normals()
            };
            let (up, down) = (moved(step), moved(-step));
            for v in 0..(n * n) as usize {
                let numeric = (up[v] - down[v]) / (2.0 * step);
                let row = rows.at(v).iter().find(|(k, _)| *k as usize == j);
                let analytic = row.map_or(Vec3::ZERO, |(_, c)| *c);
                assert!((numeric - analytic).length() < 2e-3, "{v} {j}: {numeric} {analytic}");
                let column = columns.at(j).iter().find(|(k, _)| *k as usize == v);
                assert_eq!(column.map_or(Vec3::ZERO, |(_, c)| *c), analytic);
            }
        }
    }
}
