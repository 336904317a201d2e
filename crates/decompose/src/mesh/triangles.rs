//! Triangle meshes while they are worked on.

use glam::Vec3;
use motes_math::disjoint_sets::DisjointSets;
use motes_math::median::upper_median;
use motes_scene::Surface;
use rayon::prelude::*;

use super::conjugate_gradients::Value;

/// Vertices of the unit world and triangles, counter-clockwise from outside.
#[derive(Clone, Default)]
pub(crate) struct Mesh {
    pub(crate) vertices: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Mesh {
    pub(crate) fn of(surface: &Surface) -> Self {
        Self {
            vertices: surface.vertices.iter().map(|&v| Vec3::from(v)).collect(),
            triangles: surface.triangles.clone(),
        }
    }

    /// Median length of an edge of the triangles of which all corners are among these vertices; none when they have no extent.
    pub(crate) fn median_edge(&self, among: &[bool]) -> Option<f32> {
        let counted = self.triangles.iter().filter(|t| t.iter().all(|&v| among[v as usize]));
        let mut all: Vec<f32> = counted
            .map(|t| (self.vertices[t[0] as usize] - self.vertices[t[1] as usize]).length())
            .collect();
        upper_median(&mut all, f32::total_cmp).filter(|edge| *edge > 0.0 && edge.is_finite())
    }

    #[inline]
    pub(crate) fn corners(&self, triangle: [u32; 3]) -> [Vec3; 3] {
        triangle.map(|v| self.vertices[v as usize])
    }

    /// Twice the area times the unit normal.
    #[inline]
    pub(crate) fn area_normal(&self, triangle: [u32; 3]) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a)
    }

    /// Unit normals of the vertices, weighted by area; an unused vertex points along +z.
    pub(crate) fn vertex_normals(&self) -> Vec<Vec3> {
        let mut normals = vec![Vec3::ZERO; self.vertices.len()];
        for &t in &self.triangles {
            let n = self.area_normal(t);
            t.iter().for_each(|&v| normals[v as usize] += n);
        }
        normals.iter().map(|n| n.normalize_or(Vec3::Z)).collect()
    }

    /// Keeps the triangles that `keep` names, and the vertices that they use. Returns the old index of every vertex.
    pub(crate) fn retain(&mut self, keep: impl Fn(usize) -> bool) -> Vec<u32> {
        let mut index = 0;
        self.triangles.retain(|_| {
            index += 1;
            keep(index - 1)
        });
        let mut new_of = vec![u32::MAX; self.vertices.len()];
        let mut old_of = Vec::new();
        for v in self.triangles.as_flattened_mut() {
            let slot = &mut new_of[*v as usize];
            if *slot == u32::MAX {
                *slot = old_of.len() as u32;
                old_of.push(*v);
            }
            *v = *slot;
        }
        self.vertices = old_of.iter().map(|&v| self.vertices[v as usize]).collect();
        old_of
    }

    /// Adds the vertices and triangles of another mesh.
    pub(crate) fn append(&mut self, other: Mesh) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(other.vertices);
        self.triangles.extend(other.triangles.into_iter().map(|t| t.map(|v| v + first)));
    }

    /// Edges of one triangle only, in its direction.
    pub(crate) fn open_edges(&self) -> Vec<(u32, u32)> {
        let mut edges: Vec<(u32, u32)> =
            self.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
        edges.sort_unstable();
        let open = |&(a, b): &(u32, u32)| edges.binary_search(&(b, a)).is_err();
        edges.iter().copied().filter(open).collect()
    }

    /// A number per triangle, equal for triangles that are connected.
    pub(crate) fn components(&self) -> Vec<u32> {
        let mut pieces = DisjointSets::new(self.vertices.len());
        for &[a, b, c] in &self.triangles {
            pieces.join(a, b);
            pieces.join(a, c);
        }
        self.triangles.iter().map(|t| pieces.root(t[0])).collect()
    }

    /// Drops connected pieces smaller than `area`, in squares of the grain at each triangle. Returns how many.
    pub(crate) fn drop_small_components(
        &mut self,
        area: f32,
        grain: impl Fn(Vec3) -> f32,
    ) -> usize {
        let labels = self.components();
        let mut areas = vec![0.0f32; self.vertices.len()];
        for (&label, &t) in labels.iter().zip(&self.triangles) {
            let square = grain(self.vertices[t[0] as usize]).powi(2);
            areas[label as usize] += 0.5 * self.area_normal(t).length() / square;
        }
        let dropped = areas.iter().filter(|&&a| a > 0.0 && !(a >= area)).count();
        self.retain(|t| areas[labels[t] as usize] >= area);
        dropped
    }
}

/// Vertices joined by an edge: those of `v` are `list[start[v]..start[v + 1]]`, ascending.
pub(crate) struct Neighbors {
    start: Vec<u32>,
    list: Vec<u32>,
}

impl Neighbors {
    pub(crate) fn of(mesh: &Mesh) -> Self {
        let mut edges: Vec<(u32, u32)> = mesh
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)])
            .collect();
        edges.sort_unstable();
        edges.dedup();
        let mut start = vec![0u32; mesh.vertices.len() + 1];
        for &(a, _) in &edges {
            start[a as usize + 1] += 1;
        }
        for v in 1..start.len() {
            start[v] += start[v - 1];
        }
        Self { start, list: edges.into_iter().map(|(_, b)| b).collect() }
    }

    /// Mean of a value over a vertex and its neighbors.
    #[inline]
    pub(crate) fn mean<T: Value>(&self, values: &[T], v: usize) -> T {
        let ring = self.at(v);
        let sum = ring.iter().fold(T::default(), |sum, &j| sum + values[j as usize]);
        (sum + values[v]) / (ring.len() + 1) as f32
    }

    /// [`Self::mean`] of all vertices, so many times over.
    pub(crate) fn smoothed<T: Value>(&self, mut values: Vec<T>, passes: usize) -> Vec<T> {
        for _ in 0..passes {
            let mean = |v: usize| self.mean(&values, v);
            values = (0..values.len()).into_par_iter().with_min_len(4096).map(mean).collect();
        }
        values
    }

    /// Mean of the neighbors less the vertex; nothing without neighbors.
    #[inline]
    pub(crate) fn laplacian<T: Value>(&self, values: &[T], v: usize) -> T {
        let ring = self.at(v);
        if ring.is_empty() {
            return T::default();
        }
        let sum = ring.iter().fold(T::default(), |sum, &j| sum + values[j as usize]);
        sum / ring.len() as f32 - values[v]
    }

    /// The transpose of [`Self::laplacian`], of values whose parts per neighbor are `parts`.
    #[inline]
    pub(crate) fn laplacian_transposed<T: Value>(&self, parts: &[T], v: usize) -> T {
        let ring = self.at(v);
        let sum = ring.iter().fold(T::default(), |sum, &j| sum + parts[j as usize]);
        sum - parts[v] * ring.len() as f32
    }

    /// A value divided by the number of neighbors; nothing without neighbors.
    #[inline]
    pub(crate) fn part<T: Value>(&self, value: T, v: usize) -> T {
        let count = self.at(v).len();
        if count == 0 { T::default() } else { value / count as f32 }
    }

    /// One value per vertex and neighbor, in the order of [`Self::at`].
    pub(crate) fn pairs(&self, of: impl Fn(usize, usize) -> f32 + Sync) -> Vec<f32> {
        let of = &of;
        let row = |v: usize| self.at(v).iter().map(move |&j| of(v, j as usize));
        (0..self.start.len() - 1).into_par_iter().with_min_len(1024).flat_map_iter(row).collect()
    }

    /// Those of [`Self::pairs`] that are of one vertex.
    #[inline]
    pub(crate) fn row<'a>(&self, pairs: &'a [f32], v: usize) -> &'a [f32] {
        &pairs[self.start[v] as usize..self.start[v + 1] as usize]
    }

    #[inline]
    pub(crate) fn at(&self, v: usize) -> &[u32] {
        &self.list[self.start[v] as usize..self.start[v + 1] as usize]
    }
}

/// Normals averaged with those of the neighbors.
pub(crate) fn averaged(normals: &[Vec3], neighbors: &Neighbors) -> Vec<Vec3> {
    let of = |v: usize| {
        let sum: Vec3 = neighbors.at(v).iter().map(|&j| normals[j as usize]).sum();
        (sum + normals[v]).normalize_or(normals[v])
    };
    (0..normals.len()).into_par_iter().with_min_len(4096).map(of).collect()
}
