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
///
/// The material arrays are empty before there is a decomposition.
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
}

impl Surface {
    /// Whether the vertices carry a material.
    pub fn has_materials(&self) -> bool {
        !self.vertices.is_empty() && self.base_color_linear.len() == self.vertices.len()
    }

    /// Whether all arrays have the lengths that they must have and all triangles have corners.
    pub fn is_consistent(&self) -> bool {
        let n = self.vertices.len();
        let full = |len: usize| len == n || len == 0;
        self.normals.len() == n
            && full(self.base_color_linear.len())
            && self.roughness.len() == self.base_color_linear.len()
            && self.metallic.len() == self.base_color_linear.len()
            && self.triangles.iter().flatten().all(|&v| (v as usize) < n)
    }
}
