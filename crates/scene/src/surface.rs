//! Where light meets the scene: an explicit surface with its material.

/// A triangle mesh with a material at every vertex; `V` vertices, `T` triangles.
///
/// | field | shape | value |
/// |---|---|---|
/// | `vertices` | `[V, 3]` | world units |
/// | `normals` | `[V, 3]` | unit, world, out of the matter |
/// | `triangles` | `[T, 3]` | indices of vertices, counter-clockwise seen from outside |
/// | `base_color_linear` | `[V, 3]` | 0 to 1, Rec. 709 |
/// | `roughness`, `metallic` | `[V]` | 0 to 1 |
/// | `emission_linear` | `[E, 3]`, `E <= V` | radiance of a lamp, linear, photo units, 0 or more; vertices from `E` on are dark |
///
/// The material arrays are empty before there is a decomposition, `emission_linear` where nothing shines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Positions in world.
    pub vertices: Vec<[f32; 3]>,
    /// Unit normals for shading.
    pub normals: Vec<[f32; 3]>,
    /// Three vertices each.
    pub triangles: Vec<[u32; 3]>,
    /// Diffuse albedo of a dielectric, `F_0` of a metal.
    pub base_color_linear: Vec<[f32; 3]>,
    /// Perceptual roughness.
    pub roughness: Vec<f32>,
    /// 0 dielectric, 1 metal.
    pub metallic: Vec<f32>,
    /// What the first vertices send out on their own; a triangle shines where its three corners do.
    pub emission_linear: Vec<[f32; 3]>,
}

impl Surface {
    /// Whether the vertices carry a material.
    pub fn has_materials(&self) -> bool {
        !self.vertices.is_empty() && self.base_color_linear.len() == self.vertices.len()
    }

    /// What vertex `v` sends out on its own; none where it is dark.
    pub fn emission(&self, v: usize) -> Option<[f32; 3]> {
        self.emission_linear.get(v).copied().filter(|e| e.iter().any(|c| *c > 0.0))
    }

    /// Whether any vertex shines.
    pub fn shines(&self) -> bool {
        (0..self.emission_linear.len()).any(|v| self.emission(v).is_some())
    }

    /// Whether all arrays have the lengths that they must have and all triangles have corners.
    pub fn is_consistent(&self) -> bool {
        let n = self.vertices.len();
        let full = |len: usize| len == n || len == 0;
        self.normals.len() == n
            && full(self.base_color_linear.len())
            && self.roughness.len() == self.base_color_linear.len()
            && self.metallic.len() == self.base_color_linear.len()
            && self.emission_linear.len() <= n
            && self.triangles.iter().flatten().all(|&v| (v as usize) < n)
    }
}
