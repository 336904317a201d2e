//! Adding another splat, scene or mesh.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use motes_codecs::mesh::Mesh;
use motes_math::srgb;
use motes_scene::{
    CONFIDENCE_COLUMN, ColumnValues, ExtraColumn, Gaussians, MATERIAL_COLUMNS, Materials, Residual,
    Selection, Surface,
};

use super::color::show_linear;
use super::materials::LibraryMaterial;
use super::measure::{Bounds, Extent, center_of};
use super::mesh::{area, count_for_pixels, gaussians_on, surface_of};
use super::transform::transform;
use crate::{AT_REST, EditState, Origin, Similarity, Source};

/// Something to be inserted, in its own world.
#[derive(Clone, Debug)]
pub struct Asset {
    /// What the user called it.
    pub name: String,
    /// Its Gaussians.
    pub gaussians: Gaussians,
    /// Its surface, when it has one.
    pub surface: Option<Surface>,
    /// The mesh that its Gaussians were made on, in a number of our choice.
    pub mesh: Option<Mesh>,
    /// Size of a pixel of the photos at its place, in its own units; 0 where there are none.
    pub pixel: f64,
    /// Its direction up, unit.
    pub up: DVec3,
}

/// How large it becomes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AssetSize {
    /// Times a factor.
    Factor(f64),
    /// A height, world units.
    Height(f64),
    /// The larger side of its footprint, world units.
    Footprint(f64),
}

impl Asset {
    /// Extent of all its Gaussians in its own world; `None` when it has none.
    pub fn extent(&self) -> Option<Extent> {
        let rows: Vec<u32> = (0..self.gaussians.len() as u32).collect();
        Extent::of(&self.gaussians, &rows, self.up)
    }

    /// Bounds of all its Gaussians in its own world; `None` when it has none.
    pub fn bounds(&self) -> Option<Bounds> {
        Bounds::of(&self.gaussians, 0..self.gaussians.len() as u32)
    }

    /// Whether none of its Gaussians has a finite center.
    pub fn is_nowhere(&self) -> bool {
        (0..self.gaussians.len() as u32).all(|row| center_of(&self.gaussians, row).is_none())
    }

    /// Turns all of it into a material of the library.
    pub fn make_of(&mut self, material: &LibraryMaterial) {
        let mut materials =
            Materials::of(&self.gaussians).unwrap_or_else(|_| guessed_materials(&self.gaussians));
        let LibraryMaterial { base_color_linear: base, roughness, metallic, .. } = *material;
        materials.base_color_linear.fill(base);
        materials.roughness.fill(roughness);
        materials.metallic.fill(metallic);
        materials.attach(&mut self.gaussians);
        if let Some(surface) = &mut self.surface {
            let n = surface.vertices.len();
            surface.base_color_linear = vec![base; n];
            surface.roughness = vec![roughness; n];
            surface.metallic = vec![metallic; n];
        }
        let stride = 3 * self.gaussians.sh_coefficients();
        for sh in self.gaussians.sh.chunks_exact_mut(stride) {
            show_linear(sh, base);
        }
    }

    /// How many Gaussians a mesh becomes where pixels are this large, in its own units; none where it is no mesh or no pixel is known.
    pub fn count_for_pixels(&self, pixel: f64) -> Option<u64> {
        let surface = self.surface.as_ref().filter(|_| self.mesh.is_some() && pixel > 0.0)?;
        Some(count_for_pixels(area(surface) / (pixel * pixel)))
    }

    /// Makes the Gaussians of a mesh anew, in another number and of a material of the library where one is given.
    pub fn remake(&mut self, count: u64, material: Option<&LibraryMaterial>) {
        let Some(mesh) = &self.mesh else { return };
        self.gaussians = gaussians_on(mesh, Some(count as usize));
        if let Some(material) = material {
            self.make_of(material);
        }
    }

    /// The factor that gives it a size; `None` where it has no extent to be scaled.
    pub fn scale_for(&self, size: AssetSize) -> Option<f64> {
        let extent = self.extent()?;
        let scale = match size {
            AssetSize::Factor(factor) => factor,
            AssetSize::Height(height) => height / extent.height(),
            AssetSize::Footprint(side) => side / extent.footprint(),
        };
        (scale > 0.0 && scale.is_finite()).then_some(scale)
    }

    /// How far it reaches from its base across up, but for a hundredth of its Gaussians; in its own units.
    pub fn reach(&self) -> f64 {
        let Some(extent) = self.extent() else { return 0.0 };
        let base = extent.base();
        let mut far: Vec<f64> = (0..self.gaussians.len() as u32)
            .filter_map(|row| center_of(&self.gaussians, row))
            .map(|(p, _)| (p - base).reject_from(self.up).length())
            .collect();
        far.sort_by(f64::total_cmp);
        far.get((0.99 * far.len() as f64) as usize).or(far.last()).copied().unwrap_or(0.0)
    }

    /// The motion that puts its base at `at`, its up onto `up`, and turns it by `turn_deg` about up.
    pub fn placement(
        &self,
        at: DVec3,
        up: DVec3,
        turn_deg: f64,
        size: AssetSize,
    ) -> Option<Similarity> {
        let extent = self.extent()?;
        let scale = self.scale_for(size)?;
        let turn = DQuat::from_axis_angle(up, turn_deg.to_radians());
        let rotation = turn * DQuat::from_rotation_arc(self.up, up);
        let base = extent.base();
        Some(Similarity::about(base, rotation, scale, at - base))
    }
}

/// What had to be invented.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InsertNotes {
    /// Its material is a guess from its colors.
    pub guessed_material: bool,
    /// Squares stand for its surface.
    pub guessed_surface: bool,
    /// Columns that one side lacked; the other has zeros.
    pub filled_columns: Vec<String>,
}

/// Appends an asset, moved by `placement`, and returns the selection of its Gaussians.
pub fn insert(
    state: &mut EditState,
    asset: Asset,
    placement: &Similarity,
) -> (Selection, InsertNotes) {
    let mut notes = InsertNotes::default();
    let Asset { name, mut gaussians, mut surface, .. } = asset;
    let is_decomposed = state.parts.is_some();
    if is_decomposed && Materials::of(&gaussians).is_err() {
        guessed_materials(&gaussians).attach(&mut gaussians);
        notes.guessed_material = true;
    }
    if is_decomposed
        && surface.is_none()
        && let Ok(materials) = Materials::of(&gaussians)
    {
        surface = Some(surface_of(&gaussians, &materials));
        notes.guessed_surface = true;
    }
    let degree = gaussians.sh_degree.max(state.gaussians.sh_degree);
    if gaussians.sh_degree < degree {
        gaussians = gaussians.with_sh_degree(degree);
    }
    if state.gaussians.sh_degree < degree {
        state.gaussians = state.gaussians.with_sh_degree(degree);
    }
    if !is_decomposed && Materials::of(&state.gaussians).is_err() {
        // A plain splat does not grow a material for a part of it.
        let is_of_scenes =
            |name: &str| MATERIAL_COLUMNS.contains(&name) || Residual::is_column(name);
        gaussians.extra.retain(|c| !is_of_scenes(&c.name));
    }
    notes.filled_columns = same_columns(&mut state.gaussians, &mut gaussians);
    // Nothing is left unexplained where nothing is said.
    notes.filled_columns.retain(|name| !Residual::is_column(name) && name != CONFIDENCE_COLUMN);
    let source = state.sources.len() as u32;
    state.sources.push(Source {
        name,
        gaussians: is_decomposed.then(|| Arc::new(gaussians.clone())),
        surface: surface.map(Arc::new),
    });
    let (first, n) = (state.len(), gaussians.len());
    let origin = |row| Origin { source, row, motion: AT_REST };
    state.append(gaussians, (0..n as u32).map(origin).collect());
    let rows: Vec<u32> = (first as u32..(first + n) as u32).collect();
    transform(state, &rows, placement);
    (Selection::where_true(state.len(), |i| i >= first), notes)
}

/// Gives both the same columns in the same order and types; returns the names of those that one lacked.
fn same_columns(to: &mut Gaussians, from: &mut Gaussians) -> Vec<String> {
    let mut filled = Vec::new();
    let zeros = |like: &ExtraColumn, n: usize| match &like.values {
        // What has no doubts about itself is sure.
        ColumnValues::F32(_) if like.name == CONFIDENCE_COLUMN => ColumnValues::F32(vec![1.0; n]),
        ColumnValues::I8(_) => ColumnValues::I8(vec![0; n]),
        ColumnValues::U8(_) => ColumnValues::U8(vec![0; n]),
        ColumnValues::I16(_) => ColumnValues::I16(vec![0; n]),
        ColumnValues::U16(_) => ColumnValues::U16(vec![0; n]),
        ColumnValues::I32(_) => ColumnValues::I32(vec![0; n]),
        ColumnValues::U32(_) => ColumnValues::U32(vec![0; n]),
        ColumnValues::F32(_) => ColumnValues::F32(vec![0.0; n]),
        ColumnValues::F64(_) => ColumnValues::F64(vec![0.0; n]),
    };
    let mut ordered = Vec::with_capacity(to.extra.len());
    for column in &to.extra {
        let same_type = |c: &ExtraColumn| {
            c.name == column.name
                && std::mem::discriminant(&c.values) == std::mem::discriminant(&column.values)
        };
        match from.extra.iter().position(same_type) {
            Some(at) => ordered.push(from.extra.swap_remove(at)),
            None => {
                filled.push(column.name.clone());
                let values = zeros(column, from.means.len());
                ordered.push(ExtraColumn { name: column.name.clone(), values });
            }
        }
    }
    // A column of the same name and another type gives way to the scene's.
    from.extra.retain(|c| to.extra.iter().all(|t| t.name != c.name));
    from.extra.sort_by(|a, b| a.name.cmp(&b.name));
    for column in std::mem::take(&mut from.extra) {
        filled.push(column.name.clone());
        let values = zeros(&column, to.means.len());
        to.extra.push(ExtraColumn { name: column.name.clone(), values });
        ordered.push(column);
    }
    from.extra = ordered;
    filled
}

/// Material from colors alone: the shown color as base color, matte, normals along the shortest axis away from the middle.
pub(crate) fn guessed_materials(gaussians: &Gaussians) -> Materials {
    const ROUGHNESS: f32 = 0.6;
    let n = gaussians.len();
    let rows: Vec<u32> = (0..n as u32).collect();
    let middle = Extent::of(gaussians, &rows, DVec3::Z).map_or(DVec3::ZERO, |e| e.centroid);
    let normal = |row: usize| {
        let scales = gaussians.log_scales[row];
        let thin = (0..3).min_by(|a, b| scales[*a].total_cmp(&scales[*b])).unwrap_or(2);
        let [w, x, y, z] = gaussians.rotations[row].map(f64::from);
        let axis = DQuat::from_xyzw(x, y, z, w).normalize() * DVec3::AXES[thin];
        let outward = DVec3::from_array(gaussians.means[row].map(f64::from)) - middle;
        let axis = if axis.dot(outward) < 0.0 { -axis } else { axis };
        let axis = if axis.is_finite() { axis } else { DVec3::Z };
        axis.as_vec3().to_array()
    };
    let base =
        |row: usize| gaussians.mean_color(row).map(|v| srgb::decode(v.max(0.0).clamp(0.0, 1.0)));
    Materials {
        normals: (0..n).map(normal).collect(),
        base_color_linear: (0..n).map(base).collect(),
        roughness: vec![ROUGHNESS; n],
        metallic: vec![0.0; n],
        visibility: vec![1.0; n],
        observations: vec![0; n],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asset(degree: u8) -> Asset {
        let gaussians = motes_testkit::random_gaussians(9, 400, degree);
        Asset {
            name: "asset".into(),
            gaussians,
            surface: None,
            mesh: None,
            pixel: 0.0,
            up: DVec3::Y,
        }
    }

    #[test]
    fn an_asset_stands_where_it_was_put() {
        let mut state =
            EditState::new("t", motes_testkit::random_gaussians(3, 20, 1), None, None, DVec3::Z);
        let asset = asset(3);
        let at = DVec3::new(4.0, -2.0, 0.5);
        let motion = asset.placement(at, DVec3::Z, 30.0, AssetSize::Height(0.8)).unwrap();
        let (selection, notes) = insert(&mut state, asset, &motion);
        assert_eq!(notes, InsertNotes::default());
        assert_eq!((state.len(), selection.count(), state.gaussians.sh_degree), (420, 400, 3));
        let extent = Extent::of(&state.gaussians, &selection.rows(), DVec3::Z).unwrap();
        assert!((extent.base() - at).length() < 1e-4, "{extent:?}");
        assert!((extent.height() - 0.8).abs() < 1e-4, "its own up is the scene's: {extent:?}");
        assert_eq!(state.origins[20].source, 1);
        assert!(state.gaussians.is_consistent());
    }

    #[test]
    fn columns_that_one_side_lacks_are_zero() {
        let mut scene = motes_testkit::random_gaussians(3, 4, 0);
        let column = |name: &str, values| ExtraColumn { name: name.into(), values };
        scene.extra.push(column("label", ColumnValues::U8(vec![7; 4])));
        let mut asset = asset(0);
        asset.gaussians.extra.push(column("label", ColumnValues::F32(vec![1.0; 400])));
        asset.gaussians.extra.push(column("age", ColumnValues::F32(vec![2.0; 400])));
        let mut state = EditState::new("t", scene, None, None, DVec3::Z);
        let (_, notes) = insert(&mut state, asset, &Similarity::IDENTITY);
        assert_eq!(notes.filled_columns, ["label", "age"]);
        let ColumnValues::U8(labels) = &state.gaussians.extra[0].values else { panic!() };
        assert_eq!((labels[3], labels[4]), (7, 0));
        let ColumnValues::F32(ages) = &state.gaussians.extra[1].values else { panic!() };
        assert_eq!((ages[3], ages[4]), (0.0, 2.0));
    }
}
